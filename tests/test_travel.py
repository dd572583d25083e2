"""Problems and results go to other processes and come back."""

import pickle
from multiprocessing import get_context

import numpy as np
import pytest

import neurosym as ns

part = ns.Type("part")
present = ns.Fluent("present", part)
p = part("p")


@ns.derived(part)
def light(world, state, name) -> ns.Verdict:
    """At most two parts are taken while "heavy" is there: asks a fluent of this module."""
    return ns.Verdict(name != "heavy" or len(state.objects(present)) == 1, ("heavy",), "heavy goes last.")


def own_problem(*predicates):
    remove = ns.Action("remove", p, pre=[present(p), *(each(p) for each in predicates)], eff=[~present(p)])
    names = ("a", "heavy", "b")
    cells = {name: [(2 * i, 0, 0)] for i, name in enumerate(names)}
    return ns.Domain("own", fluents=[present], actions=[remove]).problem(
        world=ns.Assembly.from_cells(cells),
        objects={part: names},
        init=[present(n) for n in names],
        goal=[~present(n) for n in names],
    )


@pytest.fixture(scope="module")
def problems():
    arch = {"left": [(0, 0, 0), (0, 0, 1)], "right": [(2, 0, 0), (2, 0, 1)], "beam": [(0, 0, 2), (1, 0, 2), (2, 0, 2)]}
    assembly = ns.load_domain("assembly")
    return [
        ns.load_domain("soma").problem(17),
        ns.load_domain("soma").problem(3, collapse="rigid"),
        ns.load_domain("tower").problem(1),
        ns.load_domain("scrabble").problem(1),
        assembly.problem(ns.Assembly.from_cells(arch)),
        assembly.problem(ns.Assembly.from_cells(arch), pull=True),
        assembly.problem(ns.Assembly.from_cells(arch), groups=True, paths="any"),
        own_problem(light, ns.predicates.free(present), ns.predicates.stable_without(present)),
    ]


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_a_pool_solves_what_one_process_solves(problems, start):
    given = problems if start == "fork" else [q for q in problems if q.domain.name != "own"]
    with get_context(start).Pool(1) as pool:
        there = pool.map(ns.solve, given)
    here = [ns.solve(problem) for problem in given]
    assert [r.plan for r in there] == [r.plan for r in here]
    assert [r.blame for r in there] == [r.blame for r in here]
    assert all(r.solved for r in there)


def test_what_was_asked_stays_behind(problems):
    problem = problems[4]
    before = len(pickle.dumps(problem))
    ns.solve(problem)
    assert len(pickle.dumps(problem)) == before
    assert "symbols" not in pickle.loads(pickle.dumps(problem)).__dict__


def test_a_copy_keeps_its_fluents_and_predicates_apart_no_more(problems):
    copy = pickle.loads(pickle.dumps(problems[-1]))
    assert copy.domain.fluents[0] == present
    assert copy.domain.actions[0].pre[1].atom.predicate is light
    assert ns.Fluent("present", part) == present != ns.Fluent("present", ns.Type("other"))


def test_a_predicate_that_cannot_travel_is_named():
    weight = ns.derived(part)(lambda world, state, name: ns.Verdict(True))
    weight.name = "heavier_than_air"
    problem = own_problem(weight)
    assert ns.solve(problem).solved
    with pytest.raises(ns.DefinitionError, match="'heavier_than_air' at the top of a module"):
        pickle.dumps(problem)


def test_results_with_paths_come_back_whole(problems):
    result = ns.solve(problems[6])
    copy = pickle.loads(pickle.dumps(result))
    assert copy.plan.motions == copy.motions
    assert str(copy) == str(result)
    for one, other in zip(copy.motions, result.motions):
        assert [t.parts for t in one.tracks] == [t.parts for t in other.tracks]
        assert all(np.array_equal(a.poses, b.poses) for a, b in zip(one.tracks, other.tracks))
