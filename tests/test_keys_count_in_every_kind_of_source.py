"""A key or constant that counts in one kind of source counts in every other, or is refused there by its name.

The cases of tests/cases_of_source_keys.py show each key in the kind of file that it is made for. Here the same keys
stand in tables of runs, tables of harmonics, records and published values. What changes nothing because it states
what is so already (``axes = "body"``, a word for nothing that does not occur) is not asked of.
"""

from __future__ import annotations

import math
from typing import Any

import pytest
from cases_of_source_keys import STEADY, SWAY
from declared_campaigns import DRIFT, HEAD, ROWS, outcome, sway

SPEED = 0.3 * 2.0 * math.pi * 0.25
HARMONICS = "run_id,frequency_Hz,vdot_mps2,rel_sigma,X_mean [N],Y_in [N],Y_out [N],N_in [N m],N_out [N m]\n" + "".join(
    f"{name},0.25,{-k * SPEED * math.pi / 2},0.05,-40000,{9e5 * k},{-3e5 * k},{1e5 * k},{-2e6 * k}\n"
    for name, k in (("s", 1.0), ("t", 0.5))
)
OSCILLATORY = {"kind": "oscillatory", "motion": "sway"}
PUBLISHED = {"test": "published_derivative", "part": "hull", "quality": "ok", "source": "s"}
# Kind -> source, file, header.
KINDS: dict[str, tuple[dict[str, Any], str, dict[str, Any]]] = {
    "runs": (DRIFT, ROWS, {}),
    "harmonics": ({"constants": SWAY["constants"], "reduction": OSCILLATORY}, HARMONICS, {}),
    "oscillation": (SWAY, sway(), {}),
    "measured": ({**SWAY, "reduction": {**OSCILLATORY, "frequency_hz": 0.25}}, sway(extra="displacement"), {}),
    "steady": (STEADY, sway(), {}),
    "published": (
        {"constants": PUBLISHED},
        "run_id,coefficient,value,rel_sigma\na,Y_v,-0.02,0.05\nb,N_v,-0.01,0.05\n",
        {"vehicle": "suboff", "scale": {"ratio": 1.0, "length_m": 4.2609}},
    ),
}
KEYS: dict[str, dict[str, Any]] = {
    "moments_about": {"moments_about": "fixed"},
    "axes": {"axes": "flow"},
    "normalisation": {"normalisation": "half_rho_A", "reference": {"area_m2": 3.0, "length_m": 2.0, "source": "s"}},
    "factor": {"factor": {"Y": 2.0}},
    "within": {"within": {"U_mps": [0.0, 1.0]}},
    "plus_minus": {"plus_minus": 2.0},
    "marks": {"marks": {"*": "poor"}},
    "words": {"words": {"zzz": "towing"}},
    "ignore": {"ignore": ["zzz"]},
    "patterns": {"patterns": {"zzz": "X"}},
    "table": {"table": "zzz"},
    "rho_inf": {"rho_inf": 2.0},
    "cofr": {"cofr": [1.0, 0.0, 0.0]},
    "grids": {"grids": {"finest": "fine", "coarser": ["m", "l"], "refinement": 1.4}},
    "deduction": {"deduction": {"towed": "x", "thrust_n": 3.0, "source": "s"}},
    **{
        f"reduction.{key}": {"reduction": {key: value}}
        for key, value in {
            "start_s": 1.0,
            "rate_hz": 30.0,
            "frequency_hz": 0.3,
            "amplitude": 0.5,
            "phase_deg": 30.0,
            "delay_s": {"Y": 0.1},
            "path": "straight",
        }.items()
    },
    **{
        f"constants.{key}": {"constants": {key: value}}
        for key, value in {
            "sigma_Y": "5 N",
            "displacement": "0.3 m",
            "frequency": "0.3 Hz",
            "Y_mean": "5 N",
            "R0": "100 m",
            "plane": "3 deg",
            "p": "0.1 rad/s",
            "vdot": "0.1 m/s^2",
            "KT": 0.2,
            "J": 0.5,
            "x": "1 m",
            "exclude": "Y",
            "decoupled": "True",
            "coefficient": "Y_v",
            "unit": "kg",
            "quality": "poor",
        }.items()
    },
}
BEFORE: dict[str, dict[str, Any]] = {}


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_key_counts_in_a_kind_of_source_or_is_refused(tmp_path, kind, key):
    own, text, head = KINDS[kind]
    source, files = {**own, "files": "it.csv"}, {"it.csv": text}
    if kind not in BEFORE:
        BEFORE[kind] = outcome(tmp_path / "before", {**HEAD, **head, "source": [source]}, files, estimated=False)
    before = BEFORE[kind]
    assert "refused" not in before, before
    changed = dict(source)
    for name, value in KEYS[key].items():
        changed[name] = {**source.get(name, {}), **value} if isinstance(value, dict) else value
    after = outcome(tmp_path / "after", {**HEAD, **head, "source": [changed]}, files, estimated=False)
    if "refused" not in after:
        parts = ("rows", "noted", "findings")
        assert any(before[part] != after[part] for part in parts), "declared, and nothing changed"
        return
    # The file, or the reason why no load is left.
    named = ("campaign.toml", "it.csv", "left out: U_mps beyond", "left out: a plane at 3 deg")
    assert any(place in after["refused"] for place in named), after
