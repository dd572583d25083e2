"""Both scales of every study can be run, and settings that a study changes reach the training and a trial's key."""

from __future__ import annotations

from dataclasses import replace

import pytest

import neurosym as ns
from learned_priors import NetworkPrior
from learned_priors.recipes import RECIPES
from neurosym.commands.common import taken_by
from neurosym.experiments.imitation import reproduce_study
from neurosym.experiments.journal import Journal
from neurosym.experiments.reproduce import soma_experiment
from neurosym.experiments.studies import SCALES, study, study_names


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", study_names())
def test_each_has_demonstrations_enough_and_settings_that_exist(name, scale):
    given = study(name, scale)
    family = ns.load_domain(given.domain)
    for method in (*given.methods, *given.controls):
        prior, settings = given.training(method)
        assert RECIPES[prior].train.changed({k: v for k, v in settings.items() if k not in ("head", "width")})
    assert set(given.train) <= set(given.methods)
    for n in given.sizes:
        for part, options in (("train", given.options(n)), (given.part, given.test(n))):
            own = taken_by(family.numbers, options)
            numbers = family.numbers(part, split=given.seeds - 1, **own)
            assert options.get("count", 1) <= len(numbers)
    if scale == "quick":
        assert len(given.trials()) <= len(study(name, "paper").trials())


def test_the_paper_scale_has_the_papers_sizes():
    assert study("tower", "paper").seeds == 20
    assert study("scrabble", "paper").sizes[:3] + study("scrabble", "paper").sizes[-2:] == (6, 11, 16, 96, 98)
    assert study("scrabble", "paper").test(98)["count"] == 5_000
    assert soma_experiment("paper").splits == 100
    published = soma_experiment(name="soma-published")
    assert (published.epochs, published.splits, published.domain, published.name) == (1500, 1, "soma", "soma-published")
    with pytest.raises(ns.UnknownNameError, match="Did you mean 'soma-published'"):
        soma_experiment(name="soma-publish")
    for scale in (lambda: study("tower", "papre"), lambda: soma_experiment("papre")):
        with pytest.raises(ns.UnknownNameError, match="Did you mean 'paper'"):
            scale()


def test_settings_that_a_study_changes_reach_the_training_and_the_key(tmp_path):
    given = replace(study("tower"), methods=("bc",), baselines=(), controls={}, figures=(), sizes=(6,), seeds=1)
    given = replace(given, test=lambda _: {"variant": "colours", "count": 5})
    short, long = (replace(given, train={"bc": {"epochs": n}}) for n in (1, 40))
    reproduce_study(short, tmp_path)
    reproduce_study(short, tmp_path)
    assert len(Journal(tmp_path / "trials.jsonl")) == 1
    reproduce_study(long, tmp_path)
    assert len(Journal(tmp_path / "trials.jsonl")) == 2, "another training is another trial"

    demonstrations = ns.load_domain("tower").demonstrations("train", recipe="paper", style="easy", count=6)
    header = NetworkPrior("bc").fit(demonstrations, settings={"epochs": 3, "rate": 1e-3}).header["training"]
    assert (header["epochs"], header["config"]["rate"]) == (3, 1e-3)
    with pytest.raises(ns.UnknownNameError, match="Did you mean 'rate'"):
        NetworkPrior("bc").fit(demonstrations, settings={"rte": 1e-3})
