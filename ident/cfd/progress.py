"""How far a matrix of cases is: which runs are done, converged, to be restarted, dead."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ident.captive.campaign import Campaign
from ident.captive.readers.openfoam import loads
from ident.cfd.case import Case
from ident.cfd.matrix import Matrix
from ident.cfd.template import settings
from sim.boat.catalogue import OUTPUTS
from sim.files.temporary import is_alive

_TIME = re.compile(rb"^Time = ([0-9.eE+-]+)", re.MULTILINE)
_END = 400000
# Lines of a log's end that are shown of a dead run.
LINES = 12
# A run of another machine whose log has been silent for so long is taken to have stopped [s].
_SILENT = 1800.0


@dataclass(frozen=True)
class State:
    """One case, of one run on one grid.

    Attributes
    ----------
    run_id, grid, folder : Which.
    word : ``waiting``, ``running``, ``done``, ``died`` or ``stopped`` (killed from outside).
    step : Program that runs or died.
    share : Done of its iterations or time, from 0 to 1.
    end : End of the log of one that died or stopped.
    """

    run_id: str
    grid: str
    folder: Path
    word: str
    step: str = ""
    share: float = 0.0
    end: str = ""


@dataclass(frozen=True)
class Progress:
    """A matrix and how far it is.

    Attributes
    ----------
    matrix : Its cases.
    states : Of every case.
    unconverged : Run -> why its loads are not believed, of those that are back.
    """

    matrix: Matrix
    states: tuple[State, ...]
    unconverged: dict[str, str]

    def of(self, word: str) -> list[State]:
        """The cases in a state."""
        return [s for s in self.states if s.word == word]

    @property
    def restart(self) -> list[tuple[str, str]]:
        """(command, why) of every case that has to be started again, or to go on."""
        out = [(f"{s.folder}/Allrun", f"{s.word} in {s.step}") for s in self.states if s.word in ("died", "stopped")]
        steady = {c.run_id: c.iterations for c in self.matrix.cases if c.iterations}
        again = {s.run_id: s for s in reversed(self.states) if s.word == "done"}
        for name, why in self.unconverged.items():
            if name in again and name in steady:
                states_of_run = [s for s in self.states if s.run_id == name and (f"{s.grid}:" in why)]
                out += [(f"{s.folder}/Allrun {steady[name] // 2}", why) for s in states_of_run]
        return out

    def to_dict(self) -> dict[str, Any]:
        """For a program to read."""
        return {
            "cases": [{**vars(s), "folder": s.folder.as_posix()} for s in self.states],
            "unconverged": self.unconverged,
            "restart": [{"command": c, "why": w} for c, w in self.restart],
        }


def progress(matrix: Matrix, campaign: Campaign) -> Progress:
    """How far a matrix is.

    Parameters
    ----------
    matrix : From ``read_matrix``.
    campaign : The runs of its folder that are back.
    """
    states = tuple(_state(matrix.folder, case, grid) for case in matrix.cases for grid in case.grids)
    unconverged = {}
    back = {h.run_id.split("-")[0]: h for h in campaign.reduced}
    for case in matrix.cases:
        if case.run_id not in back:
            continue
        if not case.iterations:
            fitted = back[case.run_id].fit
            why = "" if fitted.converged else fitted.verdict
        else:
            verdicts = (_settled(matrix.folder / "cases" / case.run_id / grid, case) for grid in case.grids)
            why = "; ".join(text for text in verdicts if text)
        if why:
            unconverged[case.run_id] = why
    return Progress(matrix, states, unconverged)


def _settled(folder: Path, case: Case) -> str:
    """Why the loads of a steady case are still on their way; empty when they are not.

    The means of the two halves of the window are compared, by the largest force and the largest moment.
    """
    share = settings()["window"]
    part = "hull" if case.test == "self_propulsion" else case.part
    rows = np.vstack([values for values, _, _ in loads(folder / "postProcessing" / f"forces_{part}")])
    window = rows[rows[:, 0] > rows[-1, 0] - share * case.iterations]
    if rows[-1, 0] < case.iterations or len(window) < 4:
        return f"{folder.name}: {rows[-1, 0]:g} of {case.iterations} iterations"
    early, late = (half[:, 1:].mean(axis=0) for half in np.array_split(window, 2))
    size = np.repeat([np.abs(late[:3]).max(), np.abs(late[3:]).max()], 3)
    change = np.abs(late - early) / np.where(size > 0.0, size, 1.0)
    worst = int(np.argmax(change))
    if change[worst] <= settings()["settled"]:
        return ""
    return f"{folder.name}: {OUTPUTS[worst]} still changes by {100 * change[worst]:.2g} % of the largest load"


def _state(root: Path, case: Case, grid: str) -> State:
    folder = root / "cases" / case.run_id / grid
    state: Callable[..., State] = lambda word, **more: State(case.run_id, grid, folder, word, **more)  # noqa: E731
    try:
        words = (folder / "state").read_text(encoding="utf-8").split()
    except OSError:
        # Output without a state was written by other means than Allrun.
        return state("done", share=1.0) if (folder / "postProcessing").is_dir() else state("waiting")
    if words[:1] == ["done"]:
        return state("done", share=1.0)
    step = words[1] if len(words) > 1 else "start"
    log = folder / f"log.{step}"
    if step == "mesh":
        log = _log_of_mesh(root / "meshes" / case.mesh / grid)
    share = _share(log, case)
    if words[:1] == ["failed"]:
        return state("died", step=step, share=share, end=_last_lines(log))
    if _stopped(words, log, folder):
        return state("stopped", step=step, share=share, end=_last_lines(log))
    return state("running", step=step, share=share)


def _stopped(words: list[str], log: Path, folder: Path) -> bool:
    """Whether a case that says it runs does not: its process is gone, or it has been silent for long."""
    from platform import node

    if len(words) > 3 and words[3] == node() and words[2].isdecimal():
        return not is_alive(int(words[2]))
    place = log if log.is_file() else folder / "state"
    with contextlib.suppress(OSError):
        return time.time() - place.stat().st_mtime > _SILENT
    return False


def _log_of_mesh(folder: Path) -> Path:
    """The log of the program that a mesh died in: the youngest."""
    logs = sorted(folder.glob("log.*"), key=lambda p: p.stat().st_mtime)
    return logs[-1] if logs else folder / "log.blockMesh"


def _tail(log: Path) -> bytes:
    try:
        with log.open("rb") as stream:
            stream.seek(0, 2)
            stream.seek(max(0, stream.tell() - _END))
            return stream.read()
    except OSError:
        return b""


def _share(log: Path, case: Case) -> float:
    times = _TIME.findall(_tail(log))
    whole = case.iterations or case.duration
    if not times or not whole:
        return 0.0
    with contextlib.suppress(ValueError):
        return min(1.0, float(times[-1]) / whole)
    return 0.0


def _last_lines(log: Path) -> str:
    """The end of a log, from the solver's own message of a fault where there is one."""
    text = _tail(log).decode("utf-8", "replace")
    lines = [line for line in text.splitlines() if line.strip()]
    fatal = next((i for i in range(len(lines) - 1, -1, -1) if "FOAM FATAL" in lines[i]), None)
    shown = lines[fatal : fatal + LINES] if fatal is not None else lines[-LINES:]
    return "\n".join([str(log), *shown])
