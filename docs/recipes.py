"""Recipes of docs/readers.md: example files by the libraries that write them, read by the real command.

``blocks()`` makes a campaign folder for each, runs ``ident runs`` on it as a user would, and returns the lines of
``campaign.toml`` that the format asks for, the command and what it printed.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from click.testing import CliRunner
from recipe_files import (
    LOADS,
    RECORD,
    RUNS,
    SERIES,
    counted,
    excel,
    foam,
    hdf5,
    lvm,
    matlab,
    matlab73,
    monitors,
    netcdf,
    ods,
    packed,
    plots,
    polar,
    su2,
    tank,
    tdms,
    tecplot,
    text_file,
    text_rows,
    universal,
)

from ident.captive.campaign import read_campaign
from ident.cli import main

HEAD = """name = "made"
vehicle = "bb2"
facility = "none"
provenance = "made up"
[frame]
x = "forward"
y = "starboard"
z = "down"
angles = "flight"
[moment_point]
x_m = 0.0
y_m = 0.0
z_m = 0.0
about = "body origin"
[scale]
ratio = 1.0
length_m = 70.2
[fluid]
density_kgpm3 = 1000.0
source = "made up"
[inertia]
model_inertia_in_loads = false
[uncertainty]
floor = 0.1
source = "made up"
[quality]
measured = { factor = 1.0, meaning = "as measured" }
"""
DRIFT = """[source.constants]
test = "drift_horizontal"
part = "hull"
quality = "measured"
U = "2 m/s"
alpha = "0 deg"
D0 = "25 m"
"""
STEADY = '[source.reduction]\nkind = "steady"\n'
# Columns of a terminal that the pages have room for.
WIDTH = "100"


@dataclass(frozen=True)
class Recipe:
    """A source of files.

    Attributes
    ----------
    name : Of its folder and of its block in the page.
    source : Lines of ``[[source]]`` that the format asks for.
    write : Writes its files into a folder.
    constants : Lines that are the same for every format, below them.
    """

    name: str
    source: str
    write: Callable[[Path], None]
    constants: str = DRIFT + 'beta = "5 deg"\n' + STEADY


_WORKSPACE = ["[Name]", "hull_001", "", "[Data]", "Accumulated Time Step, Time [s], Force X, Force Y, Moment Z"]
_MONDATA = '"ACCUMULATED TIMESTEP","USER POINT,Physical Time","USER POINT,FX","USER POINT,FY","USER POINT,MZ"'
_FLUENT = ['"report-file-0"', '"Time Step" "force-x etc.."', '("Time Step" "flow-time" "force-x" "force-y" "moment-z")']
_EFFORTS = ["# Efforts on body 1", "# Time  Fx  Fy  Mz"]
_CSV = ["beta;Fx [kN];Fy [kN];Mz [kN m]"] + [
    ";".join(f"{v / s:g}".replace(".", ",") for v, s in zip(row, (1.0, 1e3, 1e3, 1e3), strict=True)) for row in RUNS
]
_POLAR = 'test = "plane_deflection"\npart = "sail_planes"\nquality = "measured"\nU = "2 m/s"\nalpha = "0 deg"\n'
_POLAR = f'[source.constants]\n{_POLAR}beta = "0 deg"\nD0 = "25 m"\nrel_sigma = 0.05\n'
_TABLE = DRIFT + "rel_sigma = 0.03\n"
_THREE = '[source.columns]\n{0} = "time [s]"\n{1} = "X [N]"\n{2} = "Y [N]"\n{3} = "N [N m]"\n'


def _history(files: str, more: str = "") -> str:
    return f'[[source]]\nfiles = "{files}"\nrows = "history"\n{more}'


RECIPES = (
    Recipe(
        "csv",
        '[[source]]\nfiles = "drift_2019.csv"       # beta;Fx [kN];Fy [kN];Mz [kN m], decimal commas\n'
        '[source.columns]\nbeta = "beta [deg]"\nFx = "X"\nFy = "Y"\nMz = "N"\n',
        text_file("drift_2019.csv", _CSV),
        _TABLE,
    ),
    Recipe(
        "openfoam",
        _history(
            "cases/drift_*",
            "match = 'drift_(?P<beta_deg>-?[0-9.]+)$'\n"
            "rho_inf = 1.0                    # rho rhoInf; rhoInf 1;  -> times [fluid] density\n"
            "vehicle_origin = [32.3, 0, 0]    # in mesh axes; leave out when CofR is the moment point\n"
            '[source.parts]\nforcesHull = "hull"\n',
        ),
        text_file("cases/drift_5/postProcessing/forcesHull/0/forces.dat", foam("(32.3 0 0)")),
        DRIFT.replace('part = "hull"\n', "") + STEADY,
    ),
    Recipe(
        "foam-extend",
        _history(
            "cases/drift_*",
            "match = 'drift_(?P<beta_deg>-?[0-9.]+)$'\n"
            "rho_inf = 1.0\n"
            "cofr = [32.3, 0, 0]              # the file does not say it: CofR of the function object\n"
            "vehicle_origin = [32.3, 0, 0]\n[source.parts]\n"
            'forcesHull = "hull"              # with several regions: "water/forcesHull"\n',
        ),
        text_file("cases/drift_5/postProcessing/water/forcesHull/0/forces.dat", foam("")),
        DRIFT.replace('part = "hull"\n', "") + STEADY,
    ),
    Recipe(
        "starccm",
        _history(
            "monitors/*.csv",
            "[source.patterns]\n'^Physical Time:' = \"time\"\n'^Drag Monitor: ' = \"X\"              "
            "# unit from the header's brackets\n'^Side Monitor: ' = \"Y\"\n"
            "'^Yaw Moment Monitor: ' = \"N [N m]\"  # or stated here, when the header has none\n",
        ),
        text_file("monitors/drift_5.csv", monitors()),
    ),
    Recipe(
        "tank",
        _history(
            "run*.asc",
            'names = ["time [s]", "X [N]", "Y [N]", "N [N m]", "column 5"]\nignore = ["column 5"]\n'
            '# or: header_pattern = "^Time" with [source.columns]\n',
        ),
        text_file("run7.asc", tank()),
    ),
    Recipe(
        "excel",
        '[[source]]\nfiles = "drift_2019.xlsx"\ntable = "drift"                  # worksheet\n'
        'header_pattern = "^beta"         # first row of names, below a title\nunits_row = true\n'
        'skip = "^mean"                   # rows that are no data\n',
        excel,
        _TABLE,
    ),
    Recipe("opendocument", '[[source]]\nfiles = "drift_2019.ods"\n', ods, _TABLE),
    Recipe(
        "matlab",
        _history(
            "run*.mat",
            'table = "run7"                   # struct; a matrix also needs names = [...]\n'
            '[source.columns]\nFx = "X [N]"\n',
        ),
        matlab,
    ),
    Recipe("matlab-7.3", _history("run*.mat", '[source.columns]\nFx = "X [N]"\n'), matlab73),
    Recipe(
        "hdf5",
        _history("run*.h5", 'table = "run/7"                  # group; units are read from the attribute `units`\n'),
        hdf5,
    ),
    Recipe("netcdf", _history("run*.nc"), netcdf),
    Recipe(
        "tdms",
        _history(
            "run*.tdms", 'table = "run"                    # group; waveforms get a column time from their increment\n'
        ),
        tdms,
    ),
    Recipe(
        "lvm",
        _history("run*.lvm", 'ignore = ["Comment"]\n' + _THREE.format("X_Value", "Fx", "Fy", "Mz")),
        text_file("run7.lvm", lvm()),
    ),
    Recipe("gzip", _history("run*.csv.gz"), packed),
    Recipe(
        "fluent",
        _history(
            "drift_*.out", 'ignore = ["Time Step"]\n' + _THREE.format("flow-time", "force-x", "force-y", "moment-z")
        ),
        text_file("drift_5.out", [*_FLUENT, *counted(" ")]),
    ),
    Recipe(
        "su2",
        _history(
            "history_*.csv",
            'normalisation = "half_rho_A"\n[source.patterns]\n'
            "'^Inner_Iter$' = \"time [s]\"      # steady; Cur_Time or Time_Iter of an unsteady run\n"
            "'^CFx$' = \"X [-]\"\n'^CFy$' = \"Y [-]\"\n'^CMz$' = \"N [-]\"\n[source.reference]\narea_m2 = 2.1\n"
            'length_m = 5.0\nsource = "REF_AREA and REF_LENGTH of the configuration"\n',
        ),
        text_file("history_5.csv", su2()),
    ),
    Recipe(
        "plots",
        _history(
            "plots_*.csv",
            "[source.patterns]\n'^Iteration$' = \"time [s]\"\n'^X ' = \"X\"\n'^Y ' = \"Y\"\n'^N ' = \"N\"\n",
        ),
        text_file("plots_5.csv", plots()),
    ),
    Recipe(
        "tecplot",
        _history("drift_5.dat", 'table = "run"                    # title of the zone\n'),
        text_file("drift_5.dat", tecplot()),
    ),
    Recipe("universal", _history("run*.unv", '[source.columns]\n"Mz:bal" = "N"\n'), universal),
    Recipe(
        "cfx",
        _history(
            "monitor_*.csv",
            'ignore = ["ACCUMULATED TIMESTEP"]\n'
            + _THREE.format(*(f'"USER POINT,{n}"' for n in ("Physical Time", "FX", "FY", "MZ"))),
        ),
        text_file("monitor_5.csv", [_MONDATA, *counted(",", ".9e")]),
    ),
    Recipe(
        "cfx-workspace",
        _history(
            "monitor_*.csv",
            'delimiter = ","\nheader_pattern = \'^Accumulated Time Step\'\nignore = ["Accumulated Time Step"]\n'
            + _THREE.format('"Time"', '"Force X"', '"Force Y"', '"Moment Z"').replace('"Time" ', '"Time" '),
        ),
        text_file("monitor_5.csv", [*_WORKSPACE, *counted(", ", ".9e")]),
    ),
    Recipe(
        "efforts",
        _history("efforts_*.dat", "header_pattern = 'Time +Fx'\n" + _THREE.format("Time", "Fx", "Fy", "Mz")),
        text_file("efforts_5.dat", [*_EFFORTS, *text_rows("  ", RECORD, "16.9E")]),
    ),
    Recipe(
        "xfoil",
        '[[source]]\nfiles = "polar.txt"\nheader_pattern = "^ *alpha +CL"\nskip = "^ *-+ "\n'
        'normalisation = "half_rho_A"\nignore = ["CD", "CDp", "CM", "Top_Xtr", "Bot_Xtr"]\n'
        '[source.columns]\nalpha = "plane [deg]"\nCL = "Z [-]"\n'
        "[source.factor]\nCL = -1.0                        # lift is up, Z down\n"
        '[source.reference]\narea_m2 = 11.89\nsource = "both sail planes: twice 2.908 m by 2.044 m"\n',
        text_file("polar.txt", polar()),
        _POLAR,
    ),
)


@contextmanager
def _in(folder: Path, width: str) -> Iterator[None]:
    """Another working folder and width of the terminal."""
    before, columns = Path.cwd(), os.environ.get("COLUMNS")
    os.chdir(folder)
    os.environ["COLUMNS"] = width
    try:
        yield
    finally:
        os.chdir(before)
        os.environ.pop("COLUMNS")
        if columns is not None:
            os.environ["COLUMNS"] = columns


def ran(recipe: Recipe, folder: Path) -> str:
    """What the command prints of a recipe's campaign below a folder; a refusal ends the generator."""
    campaign = folder / "campaigns" / recipe.name
    campaign.mkdir(parents=True)
    (campaign / "campaign.toml").write_text(HEAD + recipe.source + recipe.constants, "utf-8")
    recipe.write(campaign)
    with _in(folder, WIDTH):
        done = CliRunner().invoke(main, ["runs", f"campaigns/{recipe.name}"])
    if done.exit_code:
        raise SystemExit(f"recipe {recipe.name}: exit code {done.exit_code}\n{done.output}")
    _as_written(recipe, campaign)
    return "\n".join(line.rstrip() for line in done.output.strip().splitlines())


def _as_written(recipe: Recipe, campaign: Path) -> None:
    """End the generator where what was read is not what was written."""
    runs = read_campaign(campaign).runs
    names = [o for o in LOADS if o in runs and runs[o].notna().any()]
    if recipe.name == "xfoil":
        return
    wanted = RUNS[:, 1:] if len(runs) > 1 else SERIES.mean(axis=0, keepdims=True)
    # A plot of every second iteration has every second sample.
    if names != list(LOADS) or not np.allclose(runs[names].to_numpy(float), wanted, rtol=1e-4):
        raise SystemExit(f"recipe {recipe.name}: read {runs[names].to_numpy(float)}, written {wanted}")


def blocks() -> dict[str, str]:
    """Block of each recipe: its lines of ``campaign.toml``, the command, and its output."""
    made = {}
    with tempfile.TemporaryDirectory() as folder:
        for recipe in RECIPES:
            printed = ran(recipe, Path(folder))
            command = f"ident runs campaigns/{recipe.name}"
            made[f"recipe-{recipe.name}"] = (
                f"```toml\n{recipe.source.rstrip()}\n```\n\n```sh\n{command}\n```\n\n```text\n{printed}\n```"
            )
    return made
