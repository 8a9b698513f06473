"""Authority: ANSI/AIAA S-119-2011. A reader written from the standard alone passes the check cases of the file."""

from __future__ import annotations

import bisect
import itertools
import math
from xml.etree import ElementTree

import pytest

from ident.exports.daveml import export_daveml
from ident.validation.boats import Fleet
from sim.files.errors import InputError

DAVE = "{http://daveml.org/2010/DAVEML}"


def _numbers(text):
    return [float(word) for word in text.replace("\n", " ").split(",")]


class Reader:
    """Gridded functions of a DAVE-ML file: the first breakpoint varies slowest, in between linear, by rule beyond."""

    def __init__(self, path):
        self.root = ElementTree.parse(path).getroot()
        find = self.root.iter
        self.points = {b.get("bpID"): _numbers(b.find(f"{DAVE}bpVals").text) for b in find(f"{DAVE}breakpointDef")}
        self.tables = {}
        for table in find(f"{DAVE}griddedTableDef"):
            axes = [self.points[r.get("bpID")] for r in table.iter(f"{DAVE}bpRef")]
            values = _numbers(table.find(f"{DAVE}dataTable").text)
            assert len(values) == math.prod(map(len, axes))
            self.tables[table.get("gtID")] = axes, values
        self.functions = {f.find(f"{DAVE}dependentVarRef").get("varID"): f for f in find(f"{DAVE}function")}

    def value(self, name, given):
        function = self.functions[name]
        axes, values = self.tables[function.find(f".//{DAVE}griddedTableRef").get("gtID")]
        parts = []
        for ref, points in zip(function.iter(f"{DAVE}independentVarRef"), axes, strict=True):
            x = given[ref.get("varID")]
            if ref.get("extrapolate") == "neither":
                x = min(max(x, float(ref.get("min"))), float(ref.get("max")))
            if len(points) == 1:
                parts.append(((0, 1.0),))
                continue
            i = min(max(bisect.bisect_right(points, x) - 1, 0), len(points) - 2)
            t = (x - points[i]) / (points[i + 1] - points[i])
            parts.append(((i, 1.0 - t), (i + 1, t)))
        total = 0.0
        for corner in itertools.product(*parts):
            place = 0
            for points, (i, _) in zip(axes, corner, strict=True):
                place = place * len(points) + i
            total += values[place] * math.prod(w for _, w in corner)
        return total


@pytest.fixture(scope="module")
def written(coefficients, fitted_db, tmp_path_factory):
    path = tmp_path_factory.mktemp("daveml") / "bb2.dml"
    return path, export_daveml(Fleet(fitted_db).boat(coefficients.vehicle), "coeff_db", path)


def test_every_check_case_passes_in_a_reader_of_its_own(written, coefficients):
    path, done = written
    reader, checked, largest = Reader(path), 0, 0.0
    for shot in reader.root.iter(f"{DAVE}staticShot"):
        given, wanted = (
            {s.find(f"{DAVE}varID").text: s for s in shot.find(f"{DAVE}{kind}")}
            for kind in ("checkInputs", "checkOutputs")
        )
        inputs = {name: float(s.find(f"{DAVE}signalValue").text) for name, s in given.items()}
        for name, signal in wanted.items():
            value, tolerance = (float(signal.find(f"{DAVE}{k}").text) for k in ("signalValue", "tol"))
            assert reader.value(name, inputs) == pytest.approx(value, abs=tolerance)
            largest = max(largest, abs(value))
            checked += 1
    assert checked == done["checks"] == 3 * done["functions"]
    assert done["functions"] == sum(bool(c.term.axes) for c in coefficients) > 50
    assert largest > 0.01


def test_what_it_describes_is_declared_once_and_the_same_each_time(written, coefficients, fitted_db, tmp_path):
    path, done = written
    root = ElementTree.parse(path).getroot()
    names = [v.get("varID") for v in root.iter(f"{DAVE}variableDef")]
    assert len(names) == len(set(names))
    used = {r.get("varID") for r in root.iter() if r.tag.endswith("VarRef")}
    assert used <= set(names)
    assert done["database"]["digest"] in root.find(f"{DAVE}fileHeader/{DAVE}description").text
    again = tmp_path / "again.dml"
    export_daveml(Fleet(fitted_db).boat(coefficients.vehicle), "coeff_db", again)
    assert again.read_bytes() == path.read_bytes()
    with pytest.raises(InputError, match=r"\.dml"):
        export_daveml(Fleet(fitted_db).boat(coefficients.vehicle), "coeff_db", tmp_path / "bb2.txt")
