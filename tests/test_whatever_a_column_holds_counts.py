"""Every column of a run table: changing it changes the result, or is refused.

The columns are taken from the list of quantities, so a new one without a case here fails.
"""

from __future__ import annotations

from typing import Any

import pytest
from declared_campaigns import DRIFT, HEAD, ROWS, differs, outcome

import ident
from ident.captive.quantities import table
from ident.captive.run_table import TEXT
from sim.files.errors import InputError

OPEN = "run_id,J,KT,KQ,rel_sigma\na,0,0.47,0.06,0.02\nb,0.5,0.28,0.04,0.02\nc,0.9,0.1,0.02,0.02\n"
PROPELLER = {
    "files": "drift.csv",
    "constants": {"test": "open_water", "part": "propeller", "quality": "ok", "source": "s"},
}
PUBLISHED = "run_id,coefficient,value,rel_sigma\na,Y_v,-0.02,0.05\n"
PRINTED = {
    "files": "drift.csv",
    "constants": {"test": "published_derivative", "part": "hull", "quality": "ok", "source": "s"},
}
SELF = "run_id,U_mps,D0_m,n_rps,t,rel_sigma\na,5,25,0.8,0.15,0.01\n"
POINT = {"files": "drift.csv", "constants": {**PROPELLER["constants"], "test": "self_propulsion"}}
# Quantity -> the campaign and file that may hold it, and the header vehicle.
COLUMN_CASES: dict[str, tuple[dict[str, Any], str, dict[str, Any]]] = {
    **dict.fromkeys(("J", "KT", "KQ"), (PROPELLER, OPEN, {})),
    "value": (PRINTED, PUBLISHED, {"vehicle": "suboff", "scale": {"ratio": 1.0, "length_m": 4.2609}}),
    **dict.fromkeys(("t",), (POINT, SELF, {})),
}


def changed(text: str, header: str, value: str) -> str:
    """The second data row with another value in a column, which is added where there is none."""
    lines = [line.split(",") for line in text.strip().splitlines()]
    if header not in lines[0]:
        lines = [[*lines[0], header]] + [[*line, "0" if i else value] for i, line in enumerate(lines[1:])]
        return "\n".join(",".join(line) for line in lines) + "\n"
    lines[min(2, len(lines) - 1)][lines[0].index(header)] = value
    return "\n".join(",".join(line) for line in lines) + "\n"


@pytest.mark.parametrize("quantity", list(dict.fromkeys(table()["quantity"])))
def test_every_quantity_a_column_may_hold_counts(tmp_path, quantity):
    own, text, head = COLUMN_CASES.get(quantity, (DRIFT, ROWS, {}))
    unit = str(table().loc[table()["quantity"] == quantity, "unit"].iloc[0])
    header = f"{quantity}_{unit}" if unit else quantity
    value = {"U": "6", "rel_sigma": "0.2", "t": "0.3", "n": "3", "J": "0.6"}.get(quantity, "0.5")
    other = changed(text, header, value)
    assert other != text
    differs(tmp_path, {**HEAD, **head, "source": [own]}, {**HEAD, **head, "source": [own]}, {"drift.csv": text},
            {"drift.csv": other})  # fmt: skip


@pytest.mark.parametrize("angle", ["alpha_deg", "beta_deg"])
def test_an_angle_of_flow_at_rest_is_refused(tmp_path, angle):
    """It changed nothing: every load of incidence or drift goes with the speed."""
    ident.write_starter(tmp_path / "boat")
    path = tmp_path / "boat" / "captive" / "acceleration_vdot.csv"
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([f"{head},{angle}", *(f"{row},8" for row in rows)]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=rf"acceleration_vdot.csv, row 2, column {angle[:-4]}: .* no angle of flow"):
        ident.read_campaign(tmp_path / "boat" / "captive")


TEXTS = {
    "run_id": "other",
    "test": "towing",
    "part": "propeller",
    "quality": "poor",
    "source": "book",
    "copy_of": "a",
    "exclude": "Y",
    "reason": "spoiled",
    "decoupled": "True",
    "coefficient": "Y_v",
    "unit": "kg/m",
}


@pytest.mark.parametrize("column", TEXT)
def test_every_text_column_counts(tmp_path, column):
    lines = [line.split(",") for line in ROWS.strip().splitlines()]
    constants = {k: v for k, v in DRIFT["constants"].items() if k != column}
    usual = DRIFT["constants"].get(column, "")

    def rows(value: str) -> str:
        at = lines[0].index(column) if column in lines[0] else -1
        out = []
        for i, line in enumerate(lines):
            cell = column if i == 0 else value if i == 2 else usual
            out.append(
                [*line[:at], cell, *line[at + 1 :]] if at == 0 and i in (0, 2) else line if at == 0 else [*line, cell]
            )
        return "\n".join(",".join(line) for line in out) + "\n"

    more: dict[str, Any] = {}
    if column == "reason":
        constants["exclude"] = "Y"
    if column == "decoupled":
        constants |= {"test": "rotating_arm"}
    own = {**HEAD, "source": [{**DRIFT, "constants": constants, **more}]}
    before = {"drift.csv": rows("b" if column == "run_id" else usual)}
    after = {"drift.csv": rows(TEXTS[column])}
    if column == "decoupled":
        extra = {"files": "arm.csv", "constants": DRIFT["constants"]}
        own = {**HEAD, "source": [own["source"][0], extra]}
        arm = {"arm.csv": ROWS.replace("\na,", "\nd,").replace("\nb,", "\ne,").replace("\nc,", "\nf,")}
        turn = {
            k: v.replace("rel_sigma,X", "r_radps,rel_sigma,X").replace(",25,0.05", ",25,0.01,0.05")
            for k, v in before.items()
        }
        turned = {
            k: v.replace("rel_sigma,X", "r_radps,rel_sigma,X").replace(",25,0.05", ",25,0.01,0.05")
            for k, v in after.items()
        }
        before, after = {**arm, **turn}, {**arm, **turned}
    differs(tmp_path, own, own, before, after, words=column == "source")


SUBOFF = {"vehicle": "suboff", "scale": {"ratio": 1.0, "length_m": 4.2609}}


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("coefficient,value,rel_sigma,U_mps\nY_v,-0.025,0.05,3\nN_v,-0.011,0.05,3\n", "column U: 3"),
        # A table for one speed: values without a speed in their unit are in it too.
        ("coefficient,value,unit,rel_sigma,U_mps\nY_v,-681,kg/s,0.05,3\nY_vdot,-583,kg,0.05,3\n", ""),
        ("coefficient,value,rel_sigma,sigma_value\nY_v,-0.025,0.05,0.001\n", "column rel_sigma: 0.05"),
        ("coefficient,value,rel_sigma,sigma_value\nY_v,-0.025,0.05,0.001\nN_v,-0.011,0.05,\n", ""),
    ],
)
def test_a_speed_or_error_that_no_published_value_uses_is_refused(tmp_path, text, refused):
    result = outcome(tmp_path, {**HEAD, **SUBOFF, "source": [PRINTED]}, {"drift.csv": text}, estimated=False)
    assert refused in result["refused"] if refused else "refused" not in result
