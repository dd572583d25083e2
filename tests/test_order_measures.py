"""Counts that figures are drawn from, and what can be had without looking: against plain recounts and simulations."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurosym as ns
from neurosym.experiments.baselines import BASELINES, blind, memoriser
from neurosym.experiments.order_accuracy import Counts, averages, classes_of, compare_orders, seen_in

NONE = "none"

#: Three colours, of which one has three blocks.
ACTIONS = ("red-1", "red-2", "red-3", "blue-1", "blue-2", "green")
CLASSES = (7, 7, 7, 2, 2, 5)


def demonstrations(sequences, actions=ACTIONS, classes=CLASSES) -> ns.Demonstrations:
    sequences = np.array(sequences)
    pictures = np.zeros((len(sequences), 1, 1, 1, 3), np.uint8)
    return ns.Demonstrations(pictures, sequences, actions, classes=classes)


def random_orders(rng, count, *, steps=5, shortest=1):
    rows = []
    for _ in range(count):
        length = rng.integers(shortest, steps + 1)
        rows.append([*rng.permutation(len(ACTIONS))[:length], *[-1] * (steps - length)])
    return np.array(rows)


def colour(action):
    return NONE if action < 0 else ACTIONS[action].partition("-")[0]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_counts_are_those_of_a_plain_recount(seed):
    rng = np.random.default_rng(seed)
    wanted, read = random_orders(rng, 12), random_orders(rng, 12)
    truth = demonstrations(wanted)
    counts = Counts.of(read, truth)
    names = [*counts.labels, NONE]
    assert counts.labels == ("blue", "green", "red")
    assert counts.members == (2, 1, 3)
    pairs = [(colour(a), colour(b)) for w, r in zip(wanted, read) for a, b in zip(w, r)]
    for i, j in itertools.product(range(4), repeat=2):
        assert counts.confusion[i, j] == pairs.count((names[i], names[j]))
    right = [sum(a >= 0 and colour(a) == colour(b) for a, b in zip(w, r)) for w, r in zip(wanted, read)]
    lengths = [(w >= 0).sum() for w in wanted]
    for length, hits in itertools.product(range(6), repeat=2):
        assert counts.right[length, hits] == list(zip(lengths, right)).count((length, hits))
    repeated = [length - len({colour(a) for a in w if a >= 0}) for w, length in zip(wanted, lengths)]
    whole = compare_orders(read, truth, CLASSES)["whole_sequence"]
    for r in range(5):
        own = [k for k in range(12) if repeated[k] == r]
        steps, wrong = sum(lengths[k] for k in own), sum(lengths[k] - right[k] for k in own)
        assert list(counts.repeats[r]) == [steps, wrong, len(own), sum(1 - int(whole[k]) for k in own)]


def test_counts_survive_the_journal_and_add_up():
    rng = np.random.default_rng(0)
    both = [Counts.of(random_orders(rng, 5), demonstrations(random_orders(rng, 5))) for _ in range(2)]
    back = [Counts.from_json(json.loads(json.dumps(own.to_json()))) for own in both]
    pooled = Counts.pooled(back)
    for name in ("confusion", "right", "repeats"):
        np.testing.assert_array_equal(getattr(pooled, name), sum(getattr(own, name) for own in both))
    assert (pooled.labels, pooled.members) == (both[0].labels, both[0].members)
    other = Counts.of([[0, 1]], demonstrations([[0, 1]], ("a", "b"), ()))
    with pytest.raises(ns.InputError, match="same classes"):
        Counts.pooled([pooled, other])


@pytest.mark.parametrize(
    ("actions", "classes", "labels"),
    [
        (("a1", "a2", "b1"), (0, 0, 1), ("a", "b")),
        (("place-1", "place-2"), (0, 1), ("place-1", "place-2")),  # without their numbers they would be one
        (("red", "blue"), (), ("red", "blue")),
        (("7", "8"), (0, 1), ("7", "8")),
        (("nut", "bolt", "7"), (3, 3, 1), ("7", "nut")),  # two names in a class: its first
    ],
)
def test_classes_are_named_by_what_their_actions_share(actions, classes, labels):
    assert Counts.of([[0]], demonstrations([[0]], actions, classes)).labels == labels


def test_the_memoriser_is_what_a_simulation_of_it_finds():
    rng = np.random.default_rng(1)
    train, test = demonstrations(random_orders(rng, 5)), demonstrations(random_orders(rng, 12, shortest=2))
    expected, seen = memoriser(train, test), seen_in(train, test)
    trials = 4_000
    found = {"whole_sequence": np.zeros(12), "per_step": np.zeros(12)}
    for _ in range(trials):
        orders = np.array([rng.permutation(len(ACTIONS))[:5] for _ in range(12)])
        orders[test.sequences < 0] = -1  # it knows the length
        orders[seen] = test.sequences[seen]
        for metric, values in compare_orders(orders, test, CLASSES).items():
            if metric in found:
                found[metric] += values / trials
    for metric, values in found.items():
        np.testing.assert_allclose(values, expected[metric], atol=0.04)
    assert not expected["re_use"].any()


def test_the_memoriser_is_perfect_on_colours_it_has_seen_whatever_the_blocks():
    train, test = demonstrations([[0, 3, 5]]), demonstrations([[2, 4, 5], [3, 0, 5]])
    np.testing.assert_array_equal(seen_in(train, test), [True, False])
    found = memoriser(train, test)
    assert found["whole_sequence"][0] == found["per_step"][0] == 1
    assert found["whole_sequence"][1] == pytest.approx(2 / 6 * 3 / 5 * 1 / 4)
    assert found["per_step"][1] == pytest.approx((2 / 6 + 3 / 6 + 1 / 6) / 3)


@pytest.mark.parametrize(
    "orders",
    [
        random_orders(np.random.default_rng(2), 30, steps=3),
        # Most orders begin with blue; but a step of a short order is a larger share of it.
        [[0, -1, -1], [1, -1, -1], [3, 5, 0], [3, 0, 5], [4, 2, 1]],
    ],
)
def test_no_fixed_answer_does_better_in_training_than_the_blind_one(orders):
    train = demonstrations(orders)
    found = blind(train, train)
    best = dict.fromkeys(("whole_sequence", "per_step", "stop_accuracy"), 0.0)
    for length in (1, 2, 3):
        for order in itertools.permutations(range(len(ACTIONS)), length):
            fixed = np.tile([*order, *[-1] * (3 - length)], (len(train), 1))
            figures = compare_orders(fixed, train, CLASSES)
            best = {metric: max(value, figures[metric].mean()) for metric, value in best.items()}
    for metric, value in best.items():
        assert found[metric].mean() == pytest.approx(value), metric


def test_the_blind_answer_is_chosen_in_training_not_in_the_test():
    train, test = demonstrations([[0, 3], [1, 3], [5, -1]]), demonstrations([[5, -1], [5, -1], [2, 4]])
    found = blind(train, test)
    np.testing.assert_array_equal(found["whole_sequence"], [0, 0, 1])
    np.testing.assert_array_equal(found["stop_accuracy"], [0, 0, 1])
    np.testing.assert_array_equal(found["per_step"], [0, 0, 1])


def test_averages_tell_seen_from_unseen():
    figures = {"whole_sequence": np.array([1.0, 0.0, 0.0]), "per_step": np.array([1.0, 0.5, 0.0])}
    found = averages(figures, np.array([True, False, False]))
    assert found["whole_sequence"] == pytest.approx(1 / 3)
    assert (found["whole_sequence_seen"], found["whole_sequence_unseen"]) == (1.0, 0.0)
    assert (found["per_step_seen"], found["per_step_unseen"]) == (1.0, 0.25)
    assert (found["seen_share"], found["unseen_share"]) == (pytest.approx(1 / 3), pytest.approx(2 / 3))
    assert "per_step_unseen" not in averages(figures, np.array([True, True, True]))


def test_classes_are_numbered_from_zero():
    assert classes_of(demonstrations([[0]])) == (2, 2, 2, 0, 0, 1)
    assert classes_of(demonstrations([[0]], ("a", "b"), ())) == (0, 1)


def test_baselines_give_no_metric_that_networks_have_not():
    train = demonstrations([[0, 1], [2, 3]])
    metrics = set(compare_orders(train.sequences, train, CLASSES))
    for baseline in BASELINES.values():
        assert {"whole_sequence", "per_step"} <= set(baseline(train, train)) <= metrics
