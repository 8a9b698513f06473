"""The first flight of an installation: its loop is compiled on another core while the case is read and trimmed."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from functools import partial

from ident.processes import meanwhile
from sim import compiled
from sim.files.errors import InputError
from sim.flight.ahead import compile_loop, is_compiled
from sim.flight.case import load_case


@contextlib.contextmanager
def loop_of(case: str | os.PathLike[str] | None) -> Iterator[None]:
    """Compile the loop of a flight meanwhile, where it is not kept yet and there is a core for it.

    Parameters
    ----------
    case : Bundled case or path to a case file, whose mistakes are left to who flies it; None for all bundled ones,
        some of which are in waves.
    """
    in_waves = True
    if case is not None:
        try:
            flown = load_case(os.fspath(case))[0]
        except InputError:
            yield
            return
        in_waves = flown.waves is not None or flown.environment.free_surface
    if is_compiled(in_waves):
        yield
        return
    with meanwhile(partial(_quietly, in_waves), 0):
        yield


def _quietly(in_waves: bool) -> None:
    compiled.say_nothing()
    compile_loop(in_waves)
