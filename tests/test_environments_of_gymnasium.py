"""Authority: Gymnasium's own checks, and the plant that the environments move, to the last digit."""

from __future__ import annotations

import math
import subprocess
import sys
import time
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import ident.environments
from sim.files.errors import InputError
from sim.flight.case import Case, WavesData, load_case
from sim.flight.fleet import FleetPlant
from sim.flight.guidance import LineOfSight
from sim.flight.plant import Plant
from sim.flight.simulate import waves_of


@pytest.mark.parametrize("task", ident.environments.TASKS)
def test_every_environment_is_one_by_gymnasiums_check(task, fitted_db):
    env = gymnasium.make(f"ident/{task}-v0", case="hzz20", db=fitted_db, period=0.5, duration=20.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Commands are radians: what an agent scales is its own business.
        warnings.filterwarnings("ignore", message=".*(normalized|infinity|Box).*")
        check_env(env.unwrapped)
    env.reset(seed=1)
    truncated, steps = False, 0
    while not truncated:
        observation, reward, terminated, truncated, _ = env.step(np.array([0.0, 0.05]))
        assert not terminated
        assert np.isfinite(observation).all()
        assert math.isfinite(reward)
        steps += 1
    assert steps == 40


@pytest.mark.parametrize("case", ["hzz20", "ss5-4m"])
def test_an_environment_moves_its_boat_as_the_plant_does(case, fitted_db):
    env = gymnasium.make("ident/DepthKeeping-v0", case=case, db=fitted_db)
    plant = Plant.from_database(case, fitted_db)
    env.reset(seed=3)
    for k in range(60):
        action = np.array([0.1 * math.sin(0.1 * k), -0.2])
        said = env.step(action)[4]
        assert np.array_equal(said["state"], plant.step(dV=action[0], dH=action[1]))
    assert abs(said["state"][11]) > 1e-4


@pytest.mark.parametrize(
    "code",
    [
        "import ident, gymnasium; print(gymnasium.spec('ident/Zigzag-v0').id)",
        "import gymnasium, ident; print(gymnasium.spec('ident/Zigzag-v0').id)",
        "import gymnasium; print(gymnasium.make('ident:ident/Zigzag-v0', case='nowhere'))",
    ],
)
def test_one_import_or_the_name_itself_registers_the_environments(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if "nowhere" in code:
        # Known to Gymnasium, and asked for a case that there is not.
        assert "InputError" in done.stderr
    else:
        assert done.stdout == "ident/Zigzag-v0\n", done.stderr


def test_many_boats_at_once_are_as_many_plants(coefficients, fitted_db):
    """Each boat of a fleet steps as its own plant, to the last digit; printed: boats' steps a second."""
    case, count = load_case("hzz20")[0], 2000
    fleet, plant = FleetPlant(case, coefficients, count), Plant(case, coefficients)
    fleet.commands[:, 1] = np.linspace(-0.3, 0.3, count)
    fleet.step(3)
    began = time.perf_counter()
    fleet.step(40)
    print(f"{40 * count / (time.perf_counter() - began):.3g} steps/s of {count} boats")
    for k in (0, 777, count - 1):
        plant.reset()
        plant.step(3, dH=fleet.commands[k, 1])
        assert np.array_equal(plant.step(40), fleet.state[k])
    with pytest.raises(InputError, match="none in calm water"):
        fleet.reset(phases=[1.0])
    env = gymnasium.make_vec("ident/CourseKeeping-v0", num_envs=8, case="hzz20", db=fitted_db, duration=1.0, spread=0.1)
    first, _ = env.reset(seed=5)
    assert np.ptp(first[:, -1]) > 0.01
    for _ in range(20):
        observation, reward, terminated, truncated, _ = env.step(np.zeros((8, 2)))
    assert truncated.all()
    assert not terminated.any()
    env.step(np.zeros((8, 2)))
    assert not env.step(np.zeros((8, 2)))[3].any()
    assert observation.shape == (8, 10) == first.shape
    assert (reward < 0.0).all()


def _seaway(seed: int) -> Case:
    """A long-crested sea in which a seed is the phases, for a boat whose sail comes near the surface."""
    case = load_case("ss5-4m")[0]
    waves = {"kind": "bretschneider", "sea_state": 5, "direction_deg": 150.0, "components": 12, "seed": seed}
    return case.model_copy(update={"waves": WavesData(**waves, second_order=False)})


def test_each_boat_of_a_fleet_is_in_a_sea_of_its_own(coefficients):
    """A boat with the phases of a seed steps as the plant of that seed, to the last digit, after a reset too."""
    seeds = range(3, 8)
    fleet = FleetPlant(_seaway(3), coefficients, len(seeds))
    fleet.reset(phases=[waves_of(_seaway(seed)).phase for seed in seeds])
    angles = np.linspace(-0.2, 0.2, len(seeds))
    fleet.commands[:, 1] = angles
    fleet.step(30)
    again = np.array([False, True, False, False, True])
    fleet.reset(again)
    fleet.commands[:, 1] = angles
    for _ in range(3):
        fleet.step(7)
    for k in (0, 3, 4):
        plant = Plant(_seaway(seeds[k]), coefficients)
        if not again[k]:
            plant.step(30, dH=angles[k])
        for _ in range(3):
            plant.step(7, dH=angles[k])
        assert np.array_equal(plant.state, fleet.state[k])
        assert plant.time == fleet.time[k]
    assert np.ptp(fleet.state[:, 10]) > 1e-3
    plant.reset(phases=fleet.phases[3])
    plant.step(30, dH=angles[3])
    for _ in range(3):
        plant.step(7)
    assert np.array_equal(plant.state, fleet.state[3])
    fleet.state[2, 0] = math.nan
    fleet.step()
    assert np.isnan(fleet.state[2, 0])
    assert np.isfinite(np.delete(fleet.state, 2, axis=0)).all()
    with pytest.raises(InputError, match="12 finite numbers, one a component of the waves, or 5 times"):
        fleet.reset(phases=[0.0])


@pytest.mark.parametrize("task", ident.environments.TASKS)
def test_every_task_in_waves_is_the_same_one_boat_or_many(task, fitted_db):
    """Actions of a fleet and of one boat: the same observations, rewards and ends, with all the loads of a sea."""
    options = {"case": "ss5-4m", "db": fitted_db, "period": 0.5, "duration": 3.0}
    single = gymnasium.make(f"ident/{task}-v0", **options)
    many = gymnasium.make_vec(f"ident/{task}-v0", num_envs=3, **options)
    assert np.array_equal(many.reset(seed=1)[0][1], single.reset(seed=1)[0])
    for k in range(6):
        action = np.array([0.1 * math.sin(k), -0.2])
        one, all_ = single.step(action), many.step(np.tile(action, (3, 1)))
        for mine, theirs in zip(one[:4], all_[:4], strict=True):
            assert np.array_equal(mine, theirs[2])
    assert one[3]


def test_a_drawn_sea_is_another_for_every_boat_and_the_same_for_a_seed(fitted_db):
    drawn = gymnasium.make_vec("ident/DepthKeeping-v0", num_envs=3, case="ss5-4m", db=fitted_db, sea="drawn")
    seen = []
    for seed in (4, 4, 5):
        drawn.reset(seed=seed)
        seen.append(drawn.step(np.zeros((3, 2)))[0])
        assert np.ptp(seen[-1][:, 2]) > 1e-4
    assert np.array_equal(seen[0], seen[1])
    assert not np.array_equal(seen[0], seen[2])


def test_line_of_sight_leads_onto_its_path_and_around_its_corner(coefficients):
    """Authority: the law's own circle, 2 U sin(eta) / L (Park, Deyst and How 2004); then the boat flies it in waves."""
    path = LineOfSight([(0.0, 0.0), (1000.0, 0.0)], ahead=200.0)
    state = np.zeros(12)
    state[[0, 6, 7]] = 5.0, 100.0, 60.0
    eta = -math.asin(60.0 / 200.0)
    assert path.yaw_rate(state) == pytest.approx(2.0 * 5.0 / 200.0 * math.sin(eta))
    state[7] = 0.0
    assert path.yaw_rate(state) == 0.0
    boat = Plant(load_case("turn20-ss5-23.69m")[0], coefficients)
    path = LineOfSight([(0.0, 0.0), (500.0, 0.0), (1200.0, 400.0)], ahead=150.0)
    offsets = []
    while boat.time < 260.0:
        depth, pitch = boat["z"] - boat.trim.state[8], boat["theta"] - boat.trim.state[10]
        boat.step(10, dH=40.0 * (path.yaw_rate(boat.state) - boat["r"]), dV=boat.trim.dV + 0.05 * depth - pitch)
        offsets.append(float(path.offset(boat.state)))
    assert boat["x"] > 900.0
    assert max(map(abs, offsets)) < 60.0
    assert abs(offsets[-1]) < 5.0


def test_wrong_numbers_of_a_task_are_named(fitted_db):
    with pytest.raises(InputError, match="chek"):
        gymnasium.make("ident/Zigzag-v0", case="hzz20", db=fitted_db, chek=0.2)
    with pytest.raises(InputError, match="a case with waves"):
        gymnasium.make("ident/Zigzag-v0", case="hzz20", db=fitted_db, sea="drawn")
    with pytest.raises(InputError, match="'wild'"):
        gymnasium.make("ident/Zigzag-v0", case="hzz20", db=fitted_db, sea="wild")
    with pytest.raises(InputError, match="multiple of the case's step"):
        gymnasium.make("ident/Zigzag-v0", case="hzz20", db=fitted_db, period=0.07)
