"""Authority: arithmetic. A ratio a quarter worse than recorded is named, either way round."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim.bench.boat import frozen_boat
from sim.bench.guard import fallen, recorded
from sim.bench.measure import shortest


def _today(**changes):
    return {line.name: line.value for line in recorded()} | changes


def test_recorded_numbers_pass_and_times_are_not_guarded():
    times = {line.name: 100.0 * line.value for line in recorded() if not line.better}
    assert fallen(_today(**times)) == []


@pytest.mark.parametrize("line", [line for line in recorded() if line.better], ids=lambda line: line.name)
def test_a_ratio_that_falls_by_more_than_a_quarter_is_named(line):
    worse = 0.74 if line.better == "more" else 1.0 / 0.74
    near = 0.76 if line.better == "more" else 1.0 / 0.76
    assert fallen(_today(**{line.name: near * line.value})) == []
    assert [text.split(":")[0] for text in fallen(_today(**{line.name: worse * line.value}))] == [line.name]
    assert fallen(_today(**{line.name: float("nan")})) != []


def test_who_waits_is_not_slower():
    import time

    found = shortest({"works": lambda: sum(range(2000)), "waits": lambda: time.sleep(0.01)}, 5)
    assert found["waits"] < 0.001
    assert 0.0 < found["works"] < 0.01


def test_the_frozen_boat_has_the_shape_of_the_fitted_one(coefficients):
    shape = {(c.term.name, c.part): c.values.size for c in frozen_boat()}
    assert shape == {(c.term.name, c.part): c.values.size for c in coefficients}


def test_commands_that_are_timed_are_those_of_the_command_line(tmp_path):
    from ident.cli import main
    from ident.commands import times

    for shown, arguments in times.commands(tmp_path, tmp_path).items():
        command = main.commands[arguments[0]]
        options = {name for parameter in command.params for name in parameter.opts}
        assert shown.split()[1] == arguments[0]
        assert {a for a in arguments if a.startswith("--")} <= options


def test_the_larger_campaigns_that_are_timed_have_every_run_so_often(tmp_path):
    import csv

    from ident.commands import times

    campaign = Path(__file__).parents[1] / "raw_captive_data" / "bb2"
    times.larger(campaign, tmp_path, (3,))
    (arguments,) = (a for a in times.commands(campaign, tmp_path, (3,)).values() if a[1] == str(tmp_path / "x3"))
    files = sorted(campaign.glob("*.csv"))
    assert len(files) > 10
    for path in files:
        with path.open(encoding="utf-8") as own, (Path(arguments[1]) / path.name).open(encoding="utf-8") as made:
            assert len(list(csv.reader(made))) - 1 == 3 * (len(list(csv.reader(own))) - 1)


def test_a_command_that_fails_is_not_timed():
    import subprocess

    from ident.commands import times

    with pytest.raises(subprocess.CalledProcessError):
        times.timed("nothing", ["no-such-command"])
