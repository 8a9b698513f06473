"""Authority: the number that an author printed with an error, a footnote mark or a multiple in its header.

The rows of ``made_campaigns`` are written as printed tables have them, and have to be read the same.
"""

from __future__ import annotations

import numpy as np
import pytest
from made_campaigns import BETA, VALUES, assert_values, read, tidy

from ident.captive.campaign import read_campaign
from ident.captive.headers import column
from ident.checks.check import check_campaign
from sim.files.errors import InputError

HEADER = "beta_deg;X [N];Y [N];N [N m]\n"


def table(form) -> str:
    rows = zip(BETA, VALUES.tolist(), strict=True)
    return HEADER + "".join(f"{b};" + ";".join(form(v) for v in row) + "\n" for b, row in rows)


def found(folder, name: str = "notes"):
    campaign = read_campaign(folder)
    return [f for f in check_campaign(campaign, folder) if f.check == name]


@pytest.mark.parametrize("sign", [" \u00b1 ", "\u00b1", " +- ", " +/- ", "+\u2212"])
def test_an_error_behind_a_load_is_its_standard_error_and_is_named(tmp_path, sign):
    runs = read(tmp_path, table(lambda v: f"{v}{sign}12.5"), tidy())
    assert_values(runs)
    assert runs[["s_X", "s_Y", "s_N"]].to_numpy() == pytest.approx(np.full((3, 3), 12.5))
    (finding,) = found(tmp_path)
    assert "9 errors behind numbers" in finding.what


def test_stated_limits_of_95_percent_are_divided_and_nothing_is_left_to_say(tmp_path):
    runs = read(tmp_path, table(lambda v: f"{v} \u00b1 19.6"), tidy("plus_minus = 1.96"))
    assert_values(runs)
    assert runs["s_Y"].to_numpy() == pytest.approx(np.full(3, 10.0))
    assert not found(tmp_path)


@pytest.mark.parametrize("mark", ["*", "**", "\u2020", "\u00b9", " *", "#"])
def test_a_footnote_mark_is_no_part_of_the_number_and_is_named(tmp_path, mark):
    runs = read(tmp_path, table(lambda v: f"{v}{mark}"), tidy())
    assert_values(runs)
    (finding,) = found(tmp_path)
    assert f"footnote marks {mark.strip()} behind 9 numbers" in finding.what
    assert finding.columns == ("X", "Y", "N")
    assert finding.rows == (2, 3, 4)


def test_a_stated_mark_gives_its_run_the_quality_word(tmp_path):
    text = table(repr).replace(";5600.5;", ";5600.5a;")
    quality = "ok = { factor = 1.0, meaning = 'm' }\npoor = { factor = 3.0, meaning = 'air' }"
    runs = read(tmp_path, text, tidy('marks = { a = "poor" }'), quality=quality)
    assert_values(runs)
    assert runs["quality"].tolist() == ["ok", "poor", "ok"]
    assert runs["s_Y"][1] == pytest.approx(3.0 * 0.05 * 5600.5)
    with pytest.raises(InputError, match="5600"):
        read(tmp_path / "b", text, tidy(), quality=quality)
    with pytest.raises(InputError, match="no number has it behind"):
        read(tmp_path / "c", table(repr), tidy('marks = { a = "poor" }'), quality=quality)


@pytest.mark.parametrize("cell", ["2.0 \u00b1 0.1", "2.0 \u00b1 x", "\u00b1 3", "2.0 \u00b1 1 \u00b1 2"])
def test_an_error_that_has_no_place_is_refused(tmp_path, cell):
    with pytest.raises(InputError, match="beta_deg"):
        read(tmp_path, table(repr).replace("\n2.0;", f"\n{cell};"), tidy())


def test_an_error_beside_a_column_of_errors_is_refused(tmp_path):
    text = (
        table(lambda v: f"{v} \u00b1 3")
        .replace("N [N m]\n", "N [N m];sigma_X_N\n")
        .replace("\u00b1 3\n", "\u00b1 3;7\n")
    )
    with pytest.raises(InputError, match="errors behind the numbers too"):
        read(tmp_path, text, tidy())


@pytest.mark.parametrize(
    ("header", "quantity", "factor"),
    [("10KQ", "KQ", 0.1), ("10 Kq [-]", "KQ", 0.1), ("KQ x 10", "KQ", 0.1), ("KT*100", "KT", 0.01),
     ("X' x1000", "X", 1e-3), ("N' (x10\u00b3)", "N", 1e-3), ("10^5 Y'", "Y", 1e-5), ("Y' [-] \u00d7 1e3", "Y", 1e-3)],
)  # fmt: skip
def test_a_dimensionless_header_holds_the_multiple_it_names(header, quantity, factor):
    kind = column(header, None, "")
    assert (kind.quantity, kind.factor) == (quantity, pytest.approx(factor, rel=1e-15))


@pytest.mark.parametrize(
    ("header", "declared"),
    [
        *((h, "KQ") for h in ("KQ/10", "0.1 KQ", "10-KQ", "10_KQ", "KQ 10^2", "KQ [%]", "KQ (1e-1)", "KQ [1/10]")),
        *(
            (h, "Y [-]")
            for h in ("Y' 10^3", "Y' (10-3)", "Y' [1e-3]", "Y'/1000", "Y' in 1/1000", "Y' [\u2030]", "Y'e3")
        ),
        *((h, "rel_sigma") for h in ("rel_sigma [%]", "rel_sigma_pct", "error (per cent)", "sigma in \u2030")),
        *((h, "value") for h in ("1000 value", "value 10^5", "value in thousandths")),
        *((h, "t") for h in ("t [%]", "t (per mille)")),
    ],
)
def test_a_declared_header_that_holds_a_power_of_ten_or_a_share_asks_for_the_factor(header, declared):
    """Its declaration says what it is and not how much: the power would be lost as a part of the name."""
    with pytest.raises(InputError, match=r"names a multiple|one unit"):
        column(header, declared, "f")
    if "[" not in header:
        assert column(header, declared, "f", [header]).factor == 1.0


@pytest.mark.parametrize("header", ["Ch 10", "Gauge 100", "1. Fx", "ch1/ch10", "Speed (100 %)", "X (10^-3 kN)"])
def test_numbers_of_channels_are_no_multiples(header):
    assert column(header, "U [m/s]" if "Speed" in header else "X [N]", "f").factor == 1.0


@pytest.mark.parametrize("header", ["Y x1000", "X x1000 [N]", "Y' x10^-3", "Fx x1000"])
def test_a_header_that_can_be_meant_two_ways_asks_for_the_factor(header):
    with pytest.raises(InputError, match="factor"):
        column(header, None, "")
