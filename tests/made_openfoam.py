"""Force files as versions of OpenFOAM write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from made_campaigns import CONSTANTS

REAL = Path(__file__).parent / "data" / "openfoam_v1912_plate"
# time, then pressure, viscous and porous force and moment vectors
TIMES = np.round(np.arange(1, 41) * 0.05, 6)
RNG = np.random.default_rng(7)
FORCE = RNG.standard_normal((40, 3, 3)) + np.array([[5, 3, 1], [0.5, 0.2, 0.1], [0, 0, 0]])
MOMENT = RNG.standard_normal((40, 3, 3)) + np.array([[1, 2, 30], [0.1, 0.2, 0.3], [0, 0, 0]])
FORCE[:, 2], MOMENT[:, 2] = 0.0, 0.0
COFR = "# CofR          : (5.000000e-01 0.000000e+00 0.000000e+00)\n"


def vector(v) -> str:
    return "(" + " ".join(f"{x:.6e}" for x in v) + ")"


def grouped(header: str, shares: int, local: bool = False, moving: bool = False, rows=slice(None)) -> str:
    """``forces.dat`` of the Foundation: bracketed groups, no totals."""
    text = "# Forces        \n" + ("" if moving else COFR) + f"# Time          {header}\n"
    for t, f, m in zip(TIMES[rows], FORCE[rows], MOMENT[rows], strict=True):
        loads = f"\t({' '.join(map(vector, f[:shares]))}) ({' '.join(map(vector, m[:shares]))})"
        point = vector((0.1 * t, 0, 0)) if moving else ""
        text += f"{t:<16g}{point}{loads}{loads if local else ''}\n"
    return text


def single(title: str, data, brackets: bool, porous: bool, rows=slice(None)) -> str:
    """``force.dat`` and ``moment.dat`` of OpenCFD: total first."""
    shares = ["total", "pressure", "viscous", *(["porous"] if porous else [])]
    named = [f"{s}_x {s}_y {s}_z" for s in shares]
    header = "\t".join(f"({n})" if brackets else n for n in named)
    text = f"# {title:<14}\n{COFR}#\n# Time          \t{header}\n"
    for t, v in zip(TIMES[rows], data[rows], strict=True):
        found = [v.sum(axis=0), *v[: 3 if porous else 2]]
        cells = [vector(x) if brackets else " ".join(f"{y:.8e}" for y in x) for x in found]
        text += f"{t:<16g}\t{chr(9).join(cells)}\n"
    return text


P3 = "(pressure viscous porous)"
P2 = "(pressure viscous)"
VERSIONS = {
    "Foundation 4, OpenCFD v1606": {"forces.dat": grouped(f"forces{P3} moment{P3}", 3)},
    "Foundation 8": {"forces.dat": grouped(f"forces{P3}\tmoments{P3}", 3)},
    "Foundation 8, local system": {
        "forces.dat": grouped(f"forces{P3}\tmoments{P3}\tlocalForces{P3}\tlocalMoments{P3}", 3, local=True)
    },
    "Foundation 11": {"forces.dat": grouped(f"forces{P2}\tmoments{P2}", 2)},
    "Foundation 11, porous": {"forces.dat": grouped(f"forces{P3}\tmoments{P3}", 3)},
    "Foundation 13, moving": {"movingForces.dat": grouped(f"CofR\tforces{P2}\tmoments{P2}", 2, moving=True)},
    "before 2.3": {"forces.dat": grouped("forces(pressure, viscous) moment(pressure, viscous)", 2)},
    "OpenCFD v1912": {
        "force.dat": single("Force", FORCE, True, False),
        "moment.dat": single("Moment", MOMENT, True, False),
    },
    "OpenCFD v1912, porous": {
        "force.dat": single("Force", FORCE, True, True),
        "moment.dat": single("Moment", MOMENT, True, True),
    },
    "OpenCFD v2212": {
        "force.dat": single("Force", FORCE, False, False),
        "moment.dat": single("Moment", MOMENT, False, False),
    },
    "OpenCFD v2212, porous": {
        "force.dat": single("Force", FORCE, False, True),
        "moment.dat": single("Moment", MOMENT, False, True),
    },
}
SOURCE = '[[source]]\nfiles = "run"\nrows = "history"\n'
PARTS = '[source.parts]\nforcesPlate = "hull"\nforcesRudder = "stern_plane_1"\n'
STATE = CONSTANTS.replace('part = "hull"\n', "").replace('"2 m/s"', '"1 m/s"').replace('"5 deg"', '"-8 deg"')
