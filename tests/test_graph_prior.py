"""The prior that reads an assembly's graph: names and order of parts do not count, and what it learns it learns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurosym as ns
from domains.structures import KINDS
from learned_priors.assembly_graph import CONTACT, DIRECTION, PART, read_graph
from learned_priors.graph_network import GraphConfig
from learned_priors.graph_prior import BUNDLED, GraphSinkhorn, load_graph_network
from neurosym.cli import main
from neurosym.errors import CheckpointError, InputError
from neurosym.testing import check_prior
from neurosym.testing.burrs import RINGS

family = ns.load_domain("assembly")
SMALL = GraphConfig(width=16, layers=2)
HELD = [family.numbers("test", kind=kind)[1] for kind in KINDS]


@pytest.fixture(scope="module")
def labelled():
    return family.labelled_problems("test", count=1, workers=1)


@pytest.fixture(scope="module")
def trained(labelled):
    return GraphSinkhorn().fit(labelled, epochs=4, config=SMALL)


@given(number=st.sampled_from(HELD), seed=st.integers(0, 99))
@settings(max_examples=8, deadline=None)
def test_renaming_and_reordering_parts_permutes_the_scores(number, seed):
    rng, problem, prior = np.random.default_rng(seed), family.problem(number), GraphSinkhorn()
    names = dict(zip(problem.world.names, [f"part {k}" for k in rng.permutation(len(problem.world))]))
    parts = [replace(part, name=names[part.name]) for part in problem.world.parts]
    rng.shuffle(parts)
    fixed = [names[name] for name in problem.world.fixed]
    world = replace(problem.world, parts=tuple(parts), fixed=tuple(fixed))
    other = family.problem(world, held=problem.details["held"], directions=rng.permutation(world.axes))
    before, after = prior.scores([problem, other])
    column = [other.actions.index(names[action]) for action in problem.actions]
    np.testing.assert_allclose(np.exp(after.log_prob)[:, column], np.exp(before.log_prob), atol=5e-3)
    np.testing.assert_allclose(np.exp(after.log_prob).sum(axis=0), 1.0, atol=5e-3)


@pytest.mark.parametrize("number", HELD)
def test_a_graph_is_finite_and_of_the_shapes_it_says(number):
    problem = family.problem(number)
    graph, n, m = read_graph(problem), len(problem.actions), len(problem.world)
    assert graph.parts.shape == (m, PART)
    assert graph.blocks.shape == (len(graph.directions), m, m)
    assert graph.directions.shape[1] == DIRECTION
    assert graph.contact.shape == (len(graph.contacts), CONTACT)
    assert graph.moved.shape == graph.place.shape == (n,)
    assert all(np.isfinite(a).all() for a in (graph.parts, graph.contact, graph.place))
    blocking = problem.geometry.blocking(problem.details["directions"])
    for d in range(len(graph.directions)):
        hit = [[bool(blocking.by_part[d][i] >> j & 1) for j in range(m)] for i in range(m)]
        np.testing.assert_array_equal(graph.blocks[d], hit)


def test_without_gravity_or_contacts_there_is_a_graph_too():
    apart = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(3, 0, 0)], "c": [(0, 3, 0)]})
    for gravity in (True, False):
        (scores,) = GraphSinkhorn().scores([family.problem(apart, gravity=gravity)])
        assert sorted(scores.order()) == [0, 1, 2]
    (alone,) = GraphSinkhorn().scores([family.problem(ns.Assembly.from_cells({"a": [(0, 0, 0)]}))])
    assert alone.order() == (0,)


def test_an_untrained_answer_is_refused_where_there_is_no_assembly():
    tower = ns.load_domain("scrabble").problem(0)
    with pytest.raises(InputError, match="graph-sinkhorn"):
        GraphSinkhorn().scores([tower])


def test_training_lowers_the_loss_is_repeatable_and_goes_on_where_it_was(labelled, tmp_path):
    losses, kept = [], tmp_path / "run.checkpoint"

    class Killed(Exception):
        pass

    def stop(now):
        losses.append(now.train_loss)
        if now.epoch == 2:
            raise Killed

    with pytest.raises(Killed):
        GraphSinkhorn().fit(labelled, epochs=4, config=SMALL, progress=stop, checkpoint=tmp_path / "none")
    whole = GraphSinkhorn().fit(labelled, epochs=4, config=SMALL, progress=lambda now: losses.append(now.train_loss))
    assert losses[-1] < losses[0]
    again = GraphSinkhorn().fit(labelled, epochs=4, config=SMALL, checkpoint=kept)
    resumed = GraphSinkhorn().fit(labelled, epochs=4, config=SMALL, checkpoint=kept)
    problem = labelled.problems[0]
    for other in (again, resumed):
        np.testing.assert_array_equal(other.scores([problem])[0].log_prob, whole.scores([problem])[0].log_prob)
    with pytest.raises(CheckpointError, match="of this run"):
        GraphSinkhorn().fit(labelled, epochs=4, seed=1, config=SMALL, checkpoint=kept)


def test_weights_are_saved_loaded_and_checked(trained, labelled, tmp_path):
    path = trained.save(tmp_path / "own.safetensors", notes={"kinds": "all"})
    loaded = ns.load_prior(path)
    assert isinstance(loaded, GraphSinkhorn)
    assert loaded.header["demonstrations"] == {"kinds": "all"}
    for a, b in zip(trained.scores(labelled.problems[:3]), loaded.scores(labelled.problems[:3])):
        np.testing.assert_array_equal(a.log_prob, b.log_prob)
    check_prior(loaded, labelled.problems[:4])
    with pytest.raises(CheckpointError, match="graph-sinkhorn"):
        load_graph_network(BUNDLED.with_name("soma-sinkhorn.safetensors"))
    with pytest.raises(CheckpointError, match="safetensors"):
        trained.save(tmp_path / "own.pt")


def test_the_bundled_weights_are_small_and_need_fewer_attempts_than_outermost_first():
    assert BUNDLED.stat().st_size < 2**20
    numbers = [n for kind in ("arch", "nested") for n in family.numbers("test", kind=kind)[:4]]
    refused = {
        prior: sum(ns.solve(family.problem(n), prior=prior, side="full").iterations for n in numbers)
        for prior in ("outermost-first", "graph-sinkhorn")
    }
    assert 2 * refused["graph-sinkhorn"] <= refused["outermost-first"]


@pytest.mark.parametrize("planner", ["backtracking", "best-first", "exhaustive"])
def test_a_complete_planner_stays_complete_under_it(planner):
    held_up = family.problem(3)
    for prior in ("graph-sinkhorn", "random"):
        assert ns.solve(held_up, planner=planner, prior=prior).plan
    rings = ns.Assembly.from_cells(RINGS.cells)
    assert ns.solve(family.problem(rings), planner=planner, prior="graph-sinkhorn").status is ns.Status.UNSOLVABLE


def test_it_is_trained_from_the_command_line_on_a_folder_of_ones_own(tmp_path, capsys):
    for number in (0, 1, 3):
        family.problem(number).world.save(tmp_path / "own" / f"{number}.json")
    demos, weights = tmp_path / "own.npz", tmp_path / "own.safetensors"
    run("demos", "assembly", "--out", demos, "--option", f"folder={tmp_path / 'own'}", "--option", "workers=1")
    assert "3 assemblies of 3 to 5 actions" in capsys.readouterr().out
    run("train", "assembly", "--prior", "graph-sinkhorn", "--epochs", "1", "--demos", demos, "--out", weights)
    assert ns.load_prior(weights).header["demonstrations"] == {"file": "own.npz"}


def run(*arguments):
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    assert not end.value.code
