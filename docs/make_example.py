"""Write the data of docs/your-own-boat.md: ``python docs/make_example.py``.

Captive loads come from known coefficients through the term table, with 2 % noise; some runs are
written as the balance records them, with a start-up transient and correlated noise; the trial
is the same boat flown with them, with noise. Nothing of the program under test is fitted here.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sim.boat.catalogue import ACCELERATIONS, OUTPUTS
from sim.boat.coefficients import Coefficients
from sim.boat.database import axis_columns
from sim.boat.forces import boat_features, body_velocity, multiplier, plane_features
from sim.boat.parts import vehicle_terms
from sim.boat.vehicle import load_vehicle
from sim.flight.case import Case, load_case
from sim.flight.simulate import simulate

HERE = Path(__file__).resolve().parents[1] / "ident" / "starter" / "files"
RATIO, TANK, NOISE = 12.0, 1000.0, 0.02

# The truth. Prime form, program frame.
TRUTH = {
    **{"X_uu": -0.0011, "X_vv": 0.004, "X_ww": 0.004, "X_udot": -0.0006, "X_vr": 0.012, "X_wq": -0.012},
    **{"Y_v": -0.030, "Y_v|v|": -0.070, "Y_ur": 0.0060, "Y_vdot": -0.0145, "Y_rdot": 0.0004},
    **{"N_v": -0.0100, "N_v|v|": 0.010, "N_ur": -0.0060, "N_r|r|": -0.0030, "N_rdot": -0.0008, "N_vdot": 0.0003},
    **{"Z_w": -0.022, "Z_w|w|": -0.060, "Z_uq": -0.0080, "Z_wdot": -0.0135, "Z_qdot": -0.0003},
    **{"M_w": 0.0085, "M_w|w|": -0.008, "M_uq": -0.0050, "M_q|q|": -0.0020, "M_qdot": -0.0007, "M_wdot": -0.0002},
    **{"K_up": -0.00002, "K_p|p|": -0.000001, "K_pdot": -0.000005},
    **{"Z_deltas": -0.0060, "M_deltas": -0.0027, "X_deltasdeltas": -0.0025},
    **{"Y_deltar": 0.0065, "N_deltar": -0.0029, "X_deltardeltar": -0.0025},
}
KT = {0.0: 0.45, 0.2: 0.38, 0.4: 0.30, 0.6: 0.21, 0.8: 0.12, 1.0: 0.02}
KQ = {0.0: 0.060, 0.2: 0.052, 0.4: 0.043, 0.6: 0.033, 0.8: 0.022, 1.0: 0.010}
DEDUCTION, WAKE = 0.18, 0.22
# Of the pure sway run, as campaign.toml says them: [m], [Hz].
SWAY = {"amplitude": 0.2, "frequency_hz": 0.15}


def truth() -> Coefficients:
    """The known coefficients as a database would hold them."""
    vehicle = load_vehicle(HERE / "my-boat.toml")
    blank = dict.fromkeys(axis_columns(), math.nan)
    parts = {t.name: t.part for t in vehicle_terms(vehicle)}
    rows = [blank | {"coefficient": k, "part": parts[k], "value": x} for k, x in TRUTH.items()]
    for name, curve in (("KT", KT), ("KQ", KQ)):
        rows += [blank | {"coefficient": name, "part": "propeller", "value": x, "J": j} for j, x in curve.items()]
    rows.append(
        blank | {"coefficient": "t", "part": "propeller", "value": DEDUCTION, "speed_mps": 5.0, "depth_m": 40.0}
    )
    rows.append(blank | {"coefficient": "w_T", "part": "propeller", "value": WAKE})
    return Coefficients(vehicle, pd.DataFrame(rows))


class Tank:
    """Loads on one part of the model in a captive state, with noise."""

    def __init__(self) -> None:
        self.coefficients = truth()
        self.vehicle = self.coefficients.vehicle
        self.noise = np.random.default_rng(7)

    def exact(self, part: str, state: dict[str, float]) -> dict[str, float]:
        """The loads X..N [N, N m] at model scale, without noise."""
        velocity = body_velocity(*(state.get(k, 0.0) for k in ("U", "alpha", "beta")))
        rates = [state.get(k, 0.0) for k in "pqr"]
        features = boat_features(velocity, rates, 40.0 / RATIO)
        for plane in self.vehicle.planes:
            if plane.name == part:
                features |= plane_features(plane, velocity, rates, state.get("plane", 0.0))
        features |= {a: state.get(a, 0.0) for a in ACCELERATIONS}
        length = self.vehicle.particulars.length.value / RATIO
        total = dict.fromkeys(OUTPUTS, 0.0)
        for k in self.coefficients:
            if k.part == part and k.term.norm == "rho/2 L":
                total[k.term.output] += k.term.scale(TANK, length, 1.0) * k.at([]) * multiplier(k.term, features)
        return total

    def loads(self, part: str, state: dict[str, float]) -> dict[str, str]:
        """The loads that do not vanish [N, N m], with noise, in four digits."""
        unit = {o: "N" if o in "XYZ" else "Nm" for o in OUTPUTS}
        noisy = {o: x * (1.0 + NOISE * float(self.noise.normal())) for o, x in self.exact(part, state).items()}
        return {f"{o}_{unit[o]}": f"{x:.4g}" for o, x in noisy.items() if x != 0.0}

    def write(self, name: str, test: str, part: str, states: list[dict[str, float]], columns: dict[str, Any]) -> None:
        """One run file; ``columns`` are header -> quantity and factor."""
        table = []
        for i, state in enumerate(states):
            run = {"run_id": f"{name}-{i + 1:02d}", "test": test, "part": part}
            run |= {h: f"{state.get(q, 0.0) / f:.4g}" for h, (q, f) in columns.items()}
            table.append(run | self.loads(part, state) | {"rel_sigma": "0.02", "quality": "good", "source": "computed"})
        header = list(dict.fromkeys(k for run in table for k in run))
        save(HERE / "captive" / f"{name}.csv", header, table)


def save(path: Path, header: list[str], table: list[dict[str, Any]]) -> None:
    """Write a CSV file."""
    path.parent.mkdir(exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, header, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)


def captive() -> None:
    """The run files of the campaign."""
    tank, degree = Tank(), math.radians(1.0)
    speed, depth = {"U_mps": ("U", 1.0)}, {"D0_m": ("D0", 1.0)}
    base = {"U": 1.5, "D0": 40.0 / RATIO}
    angles = {"alpha_deg": ("alpha", degree), "beta_deg": ("beta", degree)}
    tank.write("towing", "towing", "hull", [base | {"U": u} for u in (0.5, 1.0, 1.5, 2.0)], speed | depth)
    for axis, name in (("beta", "drift_horizontal"), ("alpha", "drift_vertical")):
        flow = [base | {axis: a * degree} for a in (-12, -8, -4, -2, 2, 4, 8, 12)]
        tank.write(name, name, "hull", flow, speed | angles | depth)
    for part in ("rudders", "stern_planes"):
        bent = [base | {"plane": d * degree} for d in (-20, -10, -5, 5, 10, 20)]
        tank.write(part, "plane_deflection", part, bent, speed | {"plane_deg": ("plane", degree)} | depth)
    for rate in "qrp":
        still = [base | {"U": 0.0, rate: x} for x in (-0.3, -0.15, 0.15, 0.3)]
        column = {f"{rate}_radps": (rate, 1.0)}
        tank.write(f"rotation_{rate}", "pure_rotation", "hull", still, speed | column | depth)
        arm = [base | {rate: x} for x in (-0.12, -0.06, 0.06, 0.12)]
        if rate in "qr":
            axis = "beta" if rate == "r" else "alpha"
            arm += [base | {rate: s * 0.1, axis: 6.0 * degree} for s in (-1, 1)]
        tank.write(f"arm_{rate}", "rotating_arm", "hull", arm, speed | angles | column | depth)
    for axis in ACCELERATIONS:
        if axis == "pdot":
            continue
        unit = "mps2" if axis[0] in "uvw" else "radps2"
        pushed = [base | {"U": 0.0, axis: x} for x in (-0.1, 0.1)]
        tank.write(
            f"acceleration_{axis}", "acceleration", "hull", pushed, speed | {f"{axis}_{unit}": (axis, 1.0)} | depth
        )
    pushed = [base | {"U": 0.0, "pdot": x} for x in (-0.5, 0.5)]
    tank.write("acceleration_pdot", "acceleration", "hull", pushed, speed | {"pdot_radps2": ("pdot", 1.0)} | depth)


def record(tank: Tank, name: str, states: list[dict[str, float]], time: np.ndarray) -> None:
    """A history of X, Y, N on the hull: start-up transient (half the load, 3 s), noise of 5 % correlated over 0.5 s."""
    loads = np.array([[tank.exact("hull", state)[o] for o in "XYN"] for state in states])
    scatter, step = 0.05 * np.abs(loads).max(axis=0), float(time[1] - time[0])
    memory = math.exp(-step / 0.5)
    noise = np.zeros_like(loads)
    noise[0] = scatter * tank.noise.normal(size=3)
    for i in range(1, len(time)):
        noise[i] = memory * noise[i - 1] + math.sqrt(1.0 - memory**2) * scatter * tank.noise.normal(size=3)
    loads = loads * (1.0 - 0.5 * np.exp(-time / 3.0))[:, None] + noise
    header = ["time_s", "X_N", "Y_N", "N_Nm"]
    table = [dict(zip(header, [f"{t:.1f}", *(f"{x:.4g}" for x in row)])) for t, row in zip(time, loads)]
    save(HERE / "captive" / "histories" / f"{name}.csv", header, table)


def histories() -> None:
    """Two steady drift runs and one pure sway run (displacement A sin wt) as the balance records them, at 10 Hz."""
    tank, time = Tank(), np.arange(0.0, 40.0, 0.1)
    for beta in (-10, 6):
        steady = {"U": 1.5, "beta": math.radians(beta), "D0": 40.0 / RATIO}
        record(tank, f"drift_{beta}", [steady] * time.size, time)
    omega = 2.0 * math.pi * SWAY["frequency_hz"]
    states = []
    for t in time:
        v, vdot = (SWAY["amplitude"] * x for x in (omega * math.cos(omega * t), -(omega**2) * math.sin(omega * t)))
        states.append({"U": math.hypot(1.5, v), "beta": math.atan2(v, 1.5), "vdot": vdot, "D0": 40.0 / RATIO})
    record(tank, "sway", states, time)


def propeller() -> None:
    """Open-water curve, and the propulsion point that holds the resistance."""
    last = {"rel_sigma": "0.01", "quality": "good", "source": "computed"}
    table = [
        {"run_id": f"OW-{j}", "test": "open_water", "part": "propeller", "J": j, "KT": KT[j], "KQ": KQ[j]} for j in KT
    ]
    save(HERE / "captive" / "open_water.csv", [*table[0], *last], [row | last for row in table])
    coefficients = truth()
    vehicle, speed = coefficients.vehicle, 1.5
    length, diameter = (x.value / RATIO for x in (vehicle.particulars.length, vehicle.propeller.diameter))
    thrust = -TRUTH["X_uu"] * 0.5 * TANK * length**2 * speed**2 / (1.0 - DEDUCTION)
    grid = np.linspace(0.2, 1.0, 8001)
    revolutions = (1.0 - WAKE) * speed / (grid * diameter)
    curve = np.interp(grid, list(KT), list(KT.values())) * TANK * revolutions**2 * diameter**4
    n = float(np.interp(-thrust, -curve, revolutions))
    point = {
        "run_id": "SP-1",
        "test": "self_propulsion",
        "part": "propeller",
        "U_mps": speed,
        "D0_m": f"{40.0 / RATIO:.4g}",
    }
    point |= {"n_rps": f"{n:.4g}", "t": DEDUCTION} | last
    save(HERE / "captive" / "self_propulsion.csv", list(point), [point])


def trial() -> None:
    """The zigzag of the known boat, as a trial would record it: 1 s apart, with noise."""
    case: Case = load_case(HERE / "zigzag.toml")[0]
    flown, noise = simulate(case, truth()), np.random.default_rng(11)
    time = np.arange(0.0, case.run.duration_s, 2.0)
    table = []
    for channel, unit, factor, sigma in (
        ("psi", "deg", 180 / math.pi, 0.2),
        ("r", "deg/s", 180 / math.pi, 0.02),
        ("u", "m/s", 1, 0.01),
    ):
        values = np.interp(time, flown["t"], flown[channel]) * factor + sigma * noise.normal(size=time.size)
        table += [
            {"source": "TRIAL", "channel": channel, "t": f"{t:g}", "value": f"{x:.3f}", "unit": unit}
            for t, x in zip(time, values, strict=True)
        ]
    save(HERE / "zigzag_trial.csv", list(table[0]), table)


if __name__ == "__main__":
    captive()
    histories()
    propeller()
    trial()
