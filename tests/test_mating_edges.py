"""What overlaps a little at rest is a mate or a fault, never a proof: no overlap lies between the two rules."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from trimesh.creation import extrude_polygon, revolve

import neurosym as ns
from neurosym.geometry.tolerances import Tolerances

THICK = 10.0
#: From the best verdict to the worst.
VERDICTS = ("SOLVED", "UNSOLVABLE", "fault")


def ngon(corners: int, radius: float) -> shapely.Polygon:
    turn = 2 * np.pi * np.arange(corners) / corners
    return shapely.Polygon(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))


def mate(kind: str, corners: int, slant: float, overlap: float, thick: float = THICK) -> dict:
    """A plate and what sits in it, drawn too large by an overlap at each of its faces."""
    over = overlap / np.cos(np.pi / corners)
    around = shapely.box(-20, -20, 20, 20)
    if kind == "pin":
        hole, pin = ngon(corners, 8), ngon(corners, 8 + over)
        return {"plate": extrude_polygon(around - hole, thick), "pin": extrude_polygon(pin, 3 * thick)}
    if kind == "tongue":
        slot, tongue = shapely.box(-8, -30, 8, 4), shapely.box(-8 - overlap, -30, 8 + overlap, 4 + overlap)
        return {"plate": extrude_polygon(around - slot, thick), "pin": extrude_polygon(tongue, thick)}
    over *= np.sqrt(1 + slant**2)
    top = thick * slant
    plate = revolve([(8, 0), (30, 0), (30, thick), (8 + top, thick), (8, 0)], sections=corners)
    pin = [(0, 0), (8 + over, 0), (8 + top + over, thick), (0, thick)]
    return {"plate": plate, "pin": revolve(pin, sections=corners)}


def verdict(parts: dict) -> str:
    try:
        assembly = ns.Assembly.from_meshes(parts, units="mm")
    except ns.NeurosymError:
        return "fault"
    problem = ns.load_domain("assembly").problem(assembly, gravity=False, fixed=["plate"], directions="+z,-y")
    return ns.solve(problem).status.name


@pytest.mark.parametrize("thick", [10, 2])
@pytest.mark.parametrize("share", [0.9, 0.995, 0.999, 1, 1.001, 1.002, 1.0035, 1.005, 1.1])
def test_a_pin_as_much_too_large_as_touch_leaves(thick, share):
    assert verdict(mate("pin", 32, 0, share * 1e-3 * thick, thick)) == "SOLVED"


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(("pin", "tongue", "cone")), st.integers(3, 24), st.floats(0.05, 1.5),
    st.lists(st.floats(-5, -1), min_size=2, max_size=3).map(sorted),
)  # fmt: skip
def test_verdicts_are_monotone_in_overlap(kind, corners, slant, exponents):
    verdicts = [verdict(mate(kind, corners, slant, THICK * 10**e)) for e in exponents]
    assert verdicts == sorted(verdicts, key=VERDICTS.index)
    assert "UNSOLVABLE" not in verdicts  # a plan, or a fault of the drawing


def test_a_stated_touch_below_the_overlap_is_told():
    parts = mate("pin", 32, 0, 0.015)
    told = ns.Assembly.from_meshes(parts, tolerances=Tolerances(touch=1e-3)).notes
    assert any("more than the stated touch of 0.01" in str(note) and "touch" in note.remedy for note in told)
