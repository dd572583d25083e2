"""STEP: names, units, instances and facets as the file has them, whatever its unit."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from broken_inputs import write
from step_files import Step, step_bolted, step_boxes

import neurosym as ns

AS1 = Path(__file__).parent.parent.parent / "shared" / "data" / "as1" / "as1_pe_203.stp"
needs_cascadio = pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="cascadio is not installed")
needs_as1 = pytest.mark.skipif(
    not AS1.is_file(), reason="the shared data is not here: as1, the STEP model of 18 solids"
)


def faces(assembly: ns.Assembly) -> list[int]:
    return [len(body.shape.faces) for body in assembly.bodies]


@needs_cascadio
@pytest.mark.parametrize("unit", ["mm", "cm", "m", "in"])
def test_a_part_for_each_solid_named_and_measured_as_in_the_file(unit: str, tmp_path: Path):
    boxes = {"low": ((0, 0, 0), (10, 20, 30)), "high": ((0, 0, 30), (10, 20, 45))}
    path = write(tmp_path / "a.step", step_boxes(boxes, unit))
    assembly = ns.Assembly.load(path)
    assert (assembly.names, assembly.units) == (("low", "high"), unit)
    np.testing.assert_allclose(assembly.bounds, [[0, 0, 0], [10, 20, 45]], atol=1e-5)
    metres = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}[unit]
    found = ns.Assembly.load(path, units="m").bounds
    np.testing.assert_allclose(found, assembly.bounds * metres, rtol=1e-9, atol=1e-12)


@needs_cascadio
def test_a_file_without_a_unit_is_in_what_the_caller_says(tmp_path: Path):
    path = write(tmp_path / "a.step", step_boxes({"a": ((0, 0, 0), (1, 2, 3))}, "none"))
    for units in (None, "in"):
        assembly = ns.Assembly.load(path, units=units)
        np.testing.assert_allclose(assembly.bounds, [[0, 0, 0], [1, 2, 3]], atol=1e-6)
        assert (assembly.units, [n.kind for n in assembly.notes]) == (units, ["units"] if units is None else [])


@needs_cascadio
def test_sub_assemblies_that_are_used_twice_are_parts_where_they_are(tmp_path: Path):
    found = {}
    for unit, size in (("mm", 1.0), ("in", 1.0), ("m", 1.0), ("m", 1e-3)):
        assembly = ns.Assembly.load(write(tmp_path / "a.step", step_bolted(unit, size)), units=unit)
        assert assembly.names == ("PLATE", "BOLT", "NUT", "BOLT (2)", "NUT (2)")
        low = {name: b[0] / size for name, b in zip(assembly.names, assembly.bodies.part_bounds)}
        np.testing.assert_allclose(low["BOLT"], [16, 16, 10], atol=0.02)
        np.testing.assert_allclose(low["BOLT (2)"], [76, 16, 10], atol=0.02)
        np.testing.assert_allclose(low["NUT (2)"], [74, 14, 30], atol=1e-4)
        found[unit, size] = faces(assembly)
    # The same facets from millimetres, inches and metres, of large and small.
    assert len({tuple(counts) for counts in found.values()}) == 1
    assert 100 < max(found["mm", 1.0]) < 400


@needs_cascadio
def test_solids_of_one_product_are_parts_even_where_they_touch(tmp_path: Path):
    step = Step()
    step.part("PAIR", [step.box((0, 0, 0), (2, 2, 1)), step.box((0, 0, 1), (2, 2, 3))])
    step.part("LONE", [step.cylinder((9, 0, 0), 1, 1)])
    step.assembly("ALL; it's", [("PAIR", (0, 0, 0)), ("LONE", (0, 0, 0))])
    text = step.text().replace("ALL; it's", "ALL; it''s")
    assembly = ns.Assembly.load(write(tmp_path / "a.step", text))
    assert assembly.names == ("PAIR-1", "PAIR-2", "LONE")
    np.testing.assert_allclose(assembly.bodies.part_bounds[1], [[0, 0, 1], [2, 2, 3]], atol=1e-6)
    assert "'PAIR' is 2 solids" in str(assembly.notes[0])


def test_without_cascadio_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ns.MissingDependencyError, match=r"neurosym-assembly\[cad\]"):
        ns.Assembly.load(write(tmp_path / "a.step", step_boxes({})))


@needs_as1
@needs_cascadio
def test_the_model_that_translators_are_tested_with(tmp_path: Path):
    names = {"PLATE": 1, "L-BRACKET": 2, "ROD": 1, "BOLT": 6, "NUT": 8}
    found = []
    inch = rb"\(CONVERSION_BASED_UNIT\('INCH',#\d+\)LENGTH_UNIT\(\)NAMED_UNIT\(#\d+\)\)"
    for unit, si in (("in", b""), ("mm", b".MILLI."), ("m", b"$")):
        metric = b"(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(%s,.METRE.))" % si
        text = AS1.read_bytes() if not si else re.sub(inch, metric, AS1.read_bytes())
        assembly = ns.Assembly.load(write(tmp_path / "as1.stp", text))
        assert {n: sum(p.split(" (")[0] == n for p in assembly.names) for n in names} == names
        assert (len(assembly), assembly.units) == (18, unit)
        np.testing.assert_allclose(assembly.bounds, [[-150, -27, -75], [50, 60, 75]], atol=1e-4)
        found.append(faces(assembly))
    assert found[0] == found[1] == found[2]
