"""The command line's own rules: help is quick, every command shows an example, the wheel has all of it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from setuptools import find_packages

from ident.cli import main

ROOT = Path(__file__).parents[1]
HEAVY = ("numpy", "pandas", "numba", "pydantic", "rich", "scipy", "matplotlib", "sim")


@pytest.mark.parametrize("arguments", [["--help"], ["fit", "--help"], ["validate", "--help"]], ids=" ".join)
def test_help_imports_nothing_heavy(arguments):
    program = (
        "import sys\nfrom ident.cli import main\n"
        f"try:\n    main({arguments})\nexcept SystemExit as done:\n    assert not done.code\n"
        f"print('loaded', [m for m in {HEAVY} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "Example" in done.stdout or "ident fit" in done.stdout
    assert done.stdout.splitlines()[-1] == "loaded []"


@pytest.mark.parametrize(("name", "ours"), [("ident", True), ("/opt/bin/ident", True), ("user_script.py", False)])
def test_what_is_in_memory_is_looked_through_neither_during_a_command_nor_at_its_end(name, ours):
    """It takes a tenth of a command, and a third of a second after it; a program of the user's own is left alone."""
    program = (
        f"import sys, gc, atexit; sys.argv = [{name!r}]\n"
        "from ident.cli import click, main\n"
        "before, during = gc.get_threshold(), []\n"
        "main.add_command(click.Command('look', callback=lambda: during.extend(gc.get_threshold())))\n"
        "main(['look'], standalone_mode=False)\n"
        "assert gc.get_threshold() == before and during[0] >= 10 * before[0], during\n"
        "assert not gc.get_freeze_count()\n"
        "atexit.register(lambda: print(gc.get_freeze_count() > 0))\n"
        "atexit._run_exitfuncs()\n"
        "print(gc.get_freeze_count() > 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["False", str(ours)]


def test_every_command_of_the_readme_is_there_with_an_example():
    text = (ROOT / "README.md").read_text("utf-8")
    named = set(re.findall(r"`ident ([a-z]+)", text))
    assert named == set(main.commands)
    for name in main.commands:
        shown = CliRunner().invoke(main, [name, "--help"])
        assert shown.exit_code == 0
        assert f"Example: ident {name}" in shown.output
        assert f"ident {name}" in text, name


def test_every_package_folder_is_in_the_wheel():
    with (ROOT / "pyproject.toml").open("rb") as stream:
        rule = tomllib.load(stream)["tool"]["setuptools"]["packages"]["find"]
    packages = find_packages(ROOT, include=rule["include"])
    folders = {p.parent for top in ("ident", "sim") for p in (ROOT / top).rglob("*.py")}
    assert sorted(packages) == sorted(".".join(f.relative_to(ROOT).parts) for f in folders)


def test_documentation_is_generated_from_the_checkout_it_lies_in(tmp_path):
    """An older copy of the package that is found first must not write its text into this checkout."""
    (tmp_path / "ident").mkdir()
    (tmp_path / "ident" / "__init__.py").write_text("raise SystemExit('the other copy')\n")
    shutil.copytree(tmp_path / "ident", tmp_path / "sim")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, str(ROOT / "docs" / "generate.py"), "--help"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "--check" in done.stdout
