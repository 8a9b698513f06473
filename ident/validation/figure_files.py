"""Who draws the figures of flown cases: all cores where there are many, a process made ready ahead for one."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ident.drawing import ahead, beside

if TYPE_CHECKING:
    from ident.validation.result import Validation

# From flown cases to the files of their figures.
Drawn: TypeAlias = Callable[[list["Validation"]], list[Path]]
_NEEDED = ("matplotlib.figure", "matplotlib.backends.backend_agg", "ident.validation.wave_case_figures")


@contextlib.contextmanager
def figures_of_one(folder: Path, kind: str) -> Iterator[Drawn]:
    """What draws one case: a process that gets ready while the case is flown.

    Parameters
    ----------
    folder : Where to write.
    kind : Format: png, svg or pdf.
    """
    with ahead(*_NEEDED) as draw:
        yield partial(_one, draw, folder, kind)


def figures_of_many(folder: Path, kind: str, done: list[Validation]) -> list[Path]:
    """Figures of many cases, on all cores.

    Parameters
    ----------
    folder, kind : As of ``figures_of_one``.
    done : Flown cases.
    """
    from ident.validation.wave_case_figures import figures_of, harmonics_over_depth

    flown = [one.flown for one in done]
    drawn = beside(figures_of, [(one, folder, kind) for one in flown], workers=0)
    return [*(figure for of_case in drawn for figure in of_case), *harmonics_over_depth(flown, folder, kind)]


def _one(draw: Callable[..., Any], folder: Path, kind: str, done: list[Validation]) -> list[Path]:
    from ident.validation.wave_case_figures import figures_of, harmonics_over_depth

    flown = done[0].flown
    return [*draw(figures_of, flown, folder, kind), *draw(harmonics_over_depth, [flown], folder, kind)]
