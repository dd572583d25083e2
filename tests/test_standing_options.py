"""What standing means, where a user says so: springs or limit analysis, pull, tilt, margin; in files and commands."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from structures import assembly, between_walls, box, harmonic_stack, plug

import neurosym as ns
from neurosym.cli import main
from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.language.search_problem import Rejection, Step
from neurosym.pipeline import count_plans
from neurosym.plan_files.reading import read_plan
from neurosym.planning.inspection import inspect_problem
from neurosym.planning.sturdiness import sturdiest_plan

family = ns.load_domain("assembly")


def propped() -> ns.Assembly:
    """A block between two fixed walls, with a prop under it: without the prop friction might hold it, but does not."""
    walls = {"left": box((-1, 0, 0), (0, 1, 3)), "right": box((1, 0, 0), (2, 1, 3))}
    return assembly({"block": box((0, 0, 1), (1, 1, 2)), "prop": box((0, 0, 0), (1, 1, 1)), **walls}, tuple(walls))


def column() -> ns.Assembly:
    """A heavy slab on a slender column, and a fixed roof high over it: drawn out sideways, it topples the column."""
    slab = [(x, y, 4) for x in range(3) for y in range(3)]
    roof = [(x, y, 6) for x in range(3) for y in range(3)]
    return ns.Assembly.from_cells({"column": [(1, 1, z) for z in range(4)], "slab": slab, "roof": roof}).with_fixed(
        ["roof"]
    )


def call(capsys, *arguments) -> tuple[int, str]:
    with pytest.raises(SystemExit) as end:
        main([str(a) for a in arguments])
    return int(end.value.code or 0), capsys.readouterr().out


def test_friction_that_nothing_presses_holds_nothing():
    by_springs, by_limit = family.problem(propped()), family.problem(propped(), stability="limit")
    assert (count_plans(by_springs), count_plans(by_limit)) == (1, 2)
    assert ns.solve(by_springs).plan == ("block", "prop")
    assert not ns.validate(by_springs, ("prop", "block")).ok
    assert ns.validate(by_limit, ("prop", "block")).ok
    assert by_springs.details["stability"] == "springs"


def test_a_fall_that_only_springs_see_promises_nothing():
    search = family.problem(propped()).ground()
    refused = search.attempt(search.initial, search.actions.index("prop"))
    assert isinstance(refused, Rejection)
    assert refused.because == ("block",)
    assert refused.until == ()
    base = ns.Assembly.from_cells({"low": [(0, 0, 0)], "top": [(0, 0, 1)], "other": [(3, 0, 0)]})
    search = family.problem(base).ground()
    refused = search.attempt(search.initial, search.actions.index("low"))
    assert isinstance(refused, Rejection)
    assert [search.actions[a] for a in refused.until] == ["top"]


def test_why_not_says_what_falls_and_how_first():
    result = ns.solve(family.problem(between_walls(0.5)))
    assert result.status is ns.Status.UNSOLVABLE
    (fall,) = result.why_not.falls
    assert (fall.without, fall.parts) == ((), ("block",))
    sentence = "It does not stand as it is: block would fall. block drops along (0, 0, -1)."
    assert sentence in result.why_not.sentences


def test_what_is_drawn_out_drags_what_it_touches():
    assert ns.solve(family.problem(column())).plan == ("slab", "column")
    pulled = family.problem(column(), pull=True)
    result = ns.solve(pulled)
    assert result.status is ns.Status.UNSOLVABLE
    assert [f.without for f in result.why_not.falls if f.drawn] == [("slab",)]
    assert "would drag column along" in " ".join(result.why_not.sentences)
    assert not ns.validate(pulled, ("slab", "column")).ok
    held = family.problem(column(), pull=True, held=1)
    result = ns.solve(held)
    at = result.plan.index("slab")
    assert at or result.motions[0].held == ("column",)
    assert ns.validate(held, result.plan, result.motions).ok
    assert ns.validate(held, ("slab", "column")).ok
    assert not ns.validate(held, result.plan, [replace(m, held=()) for m in result.motions]).ok


def test_a_group_takes_along_what_it_would_drag():
    result = ns.solve(family.problem(column(), pull=True, groups=True))
    assert result.status is ns.Status.SOLVED
    assert set(result.motions[0].parts) == {"column", "slab"}
    assert ns.validate(family.problem(column(), pull=True, groups=True), result.plan, result.motions).ok


def test_a_tilt_must_be_borne_at_every_step():
    stack = harmonic_stack(0.5, blocks=4)
    assert ns.solve(family.problem(stack)).plan is not None
    refused = ns.solve(family.problem(stack, tilt=30.0))
    assert refused.plan is None
    assert refused.why_not.falls[0].without == ()


def see_saw() -> ns.Assembly:
    """A beam on a pivot between two weights: the weights are to leave in turn, the beam balanced as well as may be."""
    cells = {"pivot": [(4, 0, 0)], "beam": [(x, 0, 1) for x in range(9)]}
    cells |= {f"left {k}": [(3 - k, 0, 2)] for k in range(2)} | {f"right {k}": [(5 + k, 0, 2)] for k in range(2)}
    cells["pivot"] = [(x, 0, 0) for x in (3, 4, 5)]
    return ns.Assembly.from_cells(cells)


def test_the_sturdiest_plan_is_the_one_whose_weakest_moment_is_best():
    sturdy = sturdiest_plan(lambda tilt: family.problem(see_saw(), tilt=tilt), ns.solve)
    assert sturdy.proved
    assert sturdy.beyond - sturdy.bears <= 0.5
    # By brute force: the best over all orders of the least margin on the way.
    from neurosym.geometry.stability.spring_loads import margin

    geometry = AssemblyGeometry(see_saw())
    known: dict[int, float] = {}

    def best(there: int) -> float:
        if not there:
            return 90.0
        if there not in known:
            known[there] = min(
                margin(geometry.springs, there),
                max(
                    (
                        best(there & ~(1 << p))
                        for p in range(len(geometry))
                        if there >> p & 1 and geometry.blocking().free_directions(p, there)
                    ),
                    default=0.0,
                ),
            )
        return known[there]

    assert sturdy.bears - 0.5 <= best((1 << len(geometry)) - 1) <= sturdy.beyond + 0.5
    assert "bears a tilt of" in sturdy.sentence


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"stability": "hope"}, UnknownNameError),
        ({"stability": "limit", "pull": True}, InputError),
        ({"gravity": False, "pull": True}, InputError),
        ({"stability": "limit", "tilt": 3.0}, InputError),
        ({"tilt": 90.0}, InputError),
        ({"tilt": np.nan}, InputError),
        ({"pull": "yes"}, InputError),
    ],
)
def test_options_that_fit_nothing_are_refused(options, error):
    with pytest.raises(error):
        family.problem(propped(), **options)


def test_inspect_says_both_and_the_margin(tmp_path, capsys):
    plug(10, 0.5).save(tmp_path / "plug.json")
    looked = inspect_problem(family.problem(plug(10, 0.5)))
    assert (looked.stands, looked.balanced, looked.margin) == (False, True, None)
    _, out = call(capsys, "inspect", tmp_path / "plug.json")
    assert "It does not stand: plug would fall.\n  plug drops along (0, 0, -1).\nSome forces would balance it" in out
    code, out = call(capsys, "inspect", tmp_path / "plug.json", "--stability", "limit", "--margin", "--json")
    answer = json.loads(out)
    assert (code, answer["stands"], answer["balanced"], answer["margin"]) == (0, True, True, 0.0)
    propped().save(tmp_path / "propped.json")
    assert 0 < json.loads(call(capsys, "inspect", tmp_path / "propped.json", "--margin", "--json")[1])["margin"] <= 90
    drop = inspect_problem(family.problem(ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(5, 0, 2)]})))
    assert (drop.stands, drop.balanced) == (False, False)


def test_a_plan_file_keeps_what_standing_meant(tmp_path, capsys):
    propped().save(tmp_path / "propped.json")
    out = tmp_path / "plan.json"
    assert call(capsys, "plan", tmp_path / "propped.json", "--out", out)[0] == 0
    document = json.loads(out.read_text())
    assert document["options"]["stability"] == "springs"
    assert read_plan(out).problem.geometry.rule == "springs"
    del document["options"]["stability"]  # as 0.1 wrote it
    out.write_text(json.dumps(document))
    assert read_plan(out).problem.geometry.rule == "limit"
    assert call(capsys, "plan", tmp_path / "propped.json", "--sturdy", "--json", "--out", out)[0] == 0
    document = json.loads(out.read_text())
    assert document["options"]["tilt"] == document["sturdy"]["bears"] > 0
    assert read_plan(out).problem.geometry.tilt == document["sturdy"]["bears"]
    assert call(capsys, "plan", "soma", "--problem", 3, "--sturdy")[0] == 33


def test_pddl_says_that_springs_may_see_more():
    from neurosym.pddl.export import as_pddl

    assert as_pddl(family.problem(propped(), stability="limit")).sound
    task = as_pddl(family.problem(propped()))
    assert not task.sound
    assert "springs may see more" in " ".join(task.notes)


def test_every_step_that_springs_allow_is_one_that_forces_balance():
    rng = np.random.default_rng(4)
    for number in (2, 30, 77):
        world = ns.load_domain("soma").problem(number, collapse="rigid").world
        geometry = AssemblyGeometry(world)
        for subset in rng.integers(1, 128, 20).tolist():
            if geometry.springs.standing(subset).stands:
                assert geometry.springs.limit.standing(subset).stands
    search = family.problem(propped()).ground()
    assert isinstance(search.attempt(search.initial, search.actions.index("block")), Step)
