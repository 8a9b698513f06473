"""Scripts beside the dictionaries: mesh, case, the whole matrix, a Slurm array, Dask."""

from __future__ import annotations

from ident.cfd.template import Slurm

# Where a package or installer puts OpenFOAM, for a shell that has not sourced it.
_ENVIRONMENT = """\
cd "$(dirname "$0")" || exit 1
if [ -z "$WM_PROJECT_DIR" ]; then
  for place in /usr/share/openfoam /usr/lib/openfoam/openfoam* /opt/OpenFOAM/OpenFOAM-v*; do
    if [ -f "$place/etc/controlDict" ]; then
      case "$place" in
        /usr/share/*) export WM_PROJECT_DIR="$place" ;;
        *) . "$place/etc/bashrc" ;;
      esac
    fi
  done
fi
"""


def mesh() -> str:
    """``Allmesh``: the mesh of one surface and grid, made once, whoever asks first."""
    return f"""#!/bin/bash
# Makes the mesh once: cases that share it ask for it side by side.
{_ENVIRONMENT}
exec 9>lock
flock 9
[ -f made ] && exit 0
rm -rf constant/polyMesh
for step in blockMesh "snappyHexMesh -overwrite" topoSet checkMesh; do
  name=${{step%% *}}
  if ! $step >log.$name 2>&1 9>&-; then
    echo "failed $name" >state
    exit 1
  fi
done
echo done >state
touch made
"""


def case(mesh: str, solver: str, cores: int) -> str:
    """``Allrun`` of a case; a number after it is how many iterations (or seconds) a steady (unsteady) run goes on."""
    if cores > 1:
        run = f"""run decomposePar -force
run {solver} mpirun -np {cores} {solver} -parallel
run reconstructPar -latestTime"""
    else:
        run = f"run {solver}"
    return f"""#!/bin/bash
# ./Allrun       runs the case, or what is left of it
# ./Allrun 500   lets a run that ended go on for 500 iterations (seconds of an unsteady run)
{_ENVIRONMENT}
run() {{
  name=$1
  if [ $# -gt 2 ]; then shift; fi
  echo "running $name $$ $(uname -n)" >state
  "$@" >log.$name 2>&1 && return
  echo "failed $name" >state
  # What a dead run wrote is not read as one that ended.
  if [ -d postProcessing ]; then
    rm -rf dead_postProcessing
    mv postProcessing dead_postProcessing
  fi
  exit 1
}}
if ! [ -n "$1" ] && [ "$(cat state 2>/dev/null)" = done ]; then exit 0; fi
echo "running mesh $$ $(uname -n)" >state
if ! "{mesh}/Allmesh"; then
  echo "failed mesh" >state
  exit 1
fi
ln -sfn "../{mesh}/constant/polyMesh" constant/polyMesh
[ -d 0 ] || cp -r 0.orig 0
if [ -n "$1" ]; then
  last=$(foamListTimes -withZero -latestTime 2>/dev/null | tail -n 1)
  foamDictionary system/controlDict -entry endTime -set "$(awk "BEGIN {{ print $last + $1 }}")" >/dev/null || exit 1
fi
{run}
echo done >state
"""


def matrix() -> str:
    """``Allrun`` of the matrix: every case, one after the other; a dead one does not stop the rest."""
    return """#!/bin/bash
# Runs every case of cases.txt that is not done, one after the other.
cd "$(dirname "$0")" || exit 1
failed=0
while read -r case; do
  echo "$case"
  if ! "$case/Allrun" </dev/null; then
    echo "  died: $(cat "$case/state"); ident runs . shows the end of its log"
    failed=1
  fi
done <cases.txt
exit $failed
"""


def array(slurm: Slurm, cores: int, cases: int) -> str:
    """``slurm.sh``: a job array, a case a task."""
    more = [f"#SBATCH --partition={slurm.partition}"] if slurm.partition else []
    more += [f"#SBATCH --account={slurm.account}"] if slurm.account else []
    lines = "\n".join(
        [*more, f"#SBATCH --array=1-{cases}", f"#SBATCH --ntasks={cores}", f"#SBATCH --time={slurm.time}"]
    )
    return f"""#!/bin/bash
#SBATCH --job-name=ident-cases
{lines}
#SBATCH --output=slurm-%A_%a.out
# sbatch slurm.sh, in this folder
cd "$SLURM_SUBMIT_DIR" || exit 1
case=$(sed -n "${{SLURM_ARRAY_TASK_ID}}p" cases.txt)
exec "$case/Allrun"
"""


def dask() -> str:
    """``submit_dask.py``: the cases as tasks of a Dask cluster."""
    return '''"""Run every case of cases.txt on a Dask cluster: python submit_dask.py ADDRESS (none: this machine)."""

import subprocess
import sys
from pathlib import Path

from distributed import Client, as_completed

HERE = Path(__file__).resolve().parent


def run(case):
    return case, subprocess.run([str(HERE / case / "Allrun")], stdin=subprocess.DEVNULL).returncode


if __name__ == "__main__":
    cases = (HERE / "cases.txt").read_text().split()
    with Client(*sys.argv[1:2]) as client:
        failed = 0
        for done in as_completed(client.map(run, cases, pure=False)):
            case, code = done.result()
            failed += code != 0
            print(case, "done" if code == 0 else "died", flush=True)
    sys.exit(1 if failed else 0)
'''
