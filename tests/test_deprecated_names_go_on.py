"""What may change: a name, keyword or place that goes still works, and says since when and what to use."""

from __future__ import annotations

import pytest

import ident


def test_former_keywords_of_the_public_functions_go_on_and_say_what_to_use():
    from ident.deprecation import gathered
    from ident.options import Conditions, OwnReference

    @gathered("0.2", {"at": Conditions, "record": OwnReference}, speed=("at", "speed_mps", None), frame="record")
    def fly(at=Conditions(), record=None):  # noqa: B008
        return at, record

    with pytest.warns(
        DeprecationWarning, match=r"fly\(speed=...\) .* 0.2: use at=Conditions\(speed_mps=...\)"
    ) as caught:
        assert fly(speed=2.0) == (Conditions(speed_mps=2.0), None)
    assert caught[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="use record=OwnReference"):
        assert fly(record="a.csv", frame="program")[1] == OwnReference("a.csv", frame="program")
    with pytest.warns(DeprecationWarning, match="work=Work"), pytest.raises(ident.InputError, match="not a folder"):
        ident.fit("nowhere", wait=1.0)
    with pytest.raises(TypeError, match="wheight"):
        fly(wheight=2.0)


def test_what_followed_by_its_place_goes_on_and_says_to_be_named():
    from ident.deprecation import gathered
    from ident.options import Work

    @gathered("0.2", {"work": Work}, ("wait", "without"), wait="work")
    def fit(folder, force="", *, without=(), work=Work()):  # noqa: B008
        return folder, force, without, work

    with pytest.warns(DeprecationWarning, match=r"fit\(..., wait, without\) by place .* 0.2: give names") as caught:
        assert fit("a", "b", 1.0, ["c"]) == ("a", "b", ["c"], Work(wait=1.0))
    assert caught[0].filename == __file__
    with pytest.raises(TypeError, match="positional"):
        fit("a", "b", 1.0, ["c"], 2)
    with pytest.raises(TypeError, match="wait"):
        fit("a", "b", 1.0, wait=2.0)
    # The order that the parameters had, when they could be given by their place.
    with pytest.warns(DeprecationWarning) as caught, pytest.raises(ident.InputError, match="not a folder"):  # noqa: PT030
        ident.fit("nowhere", "db", "", "", 1.0, lambda what, done, of: None, True, (), None)
    assert "fit(..., wait, tell, measured_only, without, dask) by place" in str(caught[0].message)
    with pytest.warns(DeprecationWarning) as caught, pytest.raises(ident.InputError, match="nowhere"):  # noqa: PT030
        ident.calibrate("nowhere.toml", "db", None, "", True, 1, lambda text: None, 1.0, 100, 0, 3)
    assert "(..., workers, each, wait, posterior, sensitivity, seed) by place" in str(caught[0].message)
    # The former value of a seed that nothing asked for is no option that changes nothing.
    with pytest.warns(DeprecationWarning, match="use diagnostics"), pytest.raises(ident.InputError, match="nowhere"):
        ident.calibrate("nowhere.toml", "db", seed=0)
    with pytest.raises(ident.InputError, match=r"diagnostics\.seed"):
        ident.calibrate("nowhere.toml", "db", diagnostics=ident.Diagnostics(seed=0))


def test_what_is_deprecated_says_since_when_and_what_instead():
    from ident.deprecation import deprecated

    @deprecated("0.3", "new()")
    def old(x, *, y=1):
        """Of old."""
        return x + y

    with pytest.warns(DeprecationWarning, match=r"old is deprecated since ident 0.3: use new\(\)") as caught:
        assert old(1, y=2) == 3
    assert caught[0].filename == __file__
    assert (old.__name__, old.__doc__) == ("old", "Of old.")
