"""What is said of an experiment with planners: computed from its records, beside the paper's figures."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from neurosym.experiments.planning_report import conclusions, methods_figure, report
from neurosym.experiments.reporting import RECORD, Drawn
from neurosym.experiments.reproduce import Experiment
from neurosym.plotting.style import Figure

SOMA = Experiment("soma", splits=2, styles=("clean",), methods=("sinkhorn", "sinkhorn-paper", "tcn-paper"))
FAILURES = {"sinkhorn": 0.05, "sinkhorn-paper": 0.3, "tcn-paper": 0.4, "random": 0.9, "blind": 0.7}
ITERATIONS = {"sinkhorn": 0.1, "sinkhorn-paper": 1.0, "tcn-paper": 1.2, "random": 5.0}


def records(failures=FAILURES, iterations=ITERATIONS) -> pd.DataFrame:
    found = []
    for split in range(SOMA.splits):
        shift = 0.01 * (2 * split - 1)
        found += [("soma", "clean", m, 120, split, "initial_failures", v + shift) for m, v in failures.items()]
        for planner in SOMA.planners:
            metric = f"iterations {planner}"
            found += [("soma", "clean", m, 120, split, metric, v + shift) for m, v in iterations.items()]
    return pd.DataFrame(found, columns=RECORD)


def test_the_papers_order_is_looked_for_in_both_figures():
    said = conclusions(SOMA, records(), "clean")
    assert "The initial failures (%) come out in the paper's order: tcn-paper 40.00 > sinkhorn-paper 30.00 " in said[0]
    order = next(s for s in said if s.startswith("The iterations"))
    assert "come out in the paper's order: random 5.00 > tcn-paper 1.20 > sinkhorn-paper 1.00" in order
    turned = conclusions(SOMA, records(failures={**FAILURES, "sinkhorn-paper": 0.5}), "clean")
    assert "do **not** come out in the paper's order: sinkhorn-paper 50.00" in turned[0]
    level = conclusions(SOMA, records(failures={**FAILURES, "sinkhorn-paper": 0.4}), "clean")
    assert "do **not** come out" in level[0]


@pytest.mark.parametrize(("ours", "verb"), [(0.05, "is ahead of"), (0.3, "is **not** ahead of")])
def test_ours_is_set_against_the_best_of_the_papers(ours, verb):
    said = conclusions(SOMA, records(failures={**FAILURES, "sinkhorn": ours}), "clean")
    percent = f"{100 * ours:.2f}"
    wanted = f"`sinkhorn` {verb} each of the paper's in initial failures (%): {percent}; the best of those is "
    assert wanted + "`sinkhorn-paper`, 30.00." in said


def test_the_blind_order_is_named_with_those_that_do_no_better():
    said = conclusions(SOMA, records(failures={**FAILURES, "tcn-paper": 0.7}), "clean")
    assert "The best fixed order fails on 70.0%; less do `sinkhorn`, `sinkhorn-paper`, not less do `tcn-paper`." in said


def test_the_figure_has_every_planner_and_the_papers_means():
    figure = methods_figure(SOMA, records(), "clean")
    titles = [axis.get_title() for axis in figure.axes]
    assert titles == ["initial\nfailures (%)", *(f"iterations:\n{p}" for p in SOMA.planners)]

    def diamonds(axis):
        return sorted(float(line.get_xdata()[0]) for line in axis.lines if line.get_marker() == "D")

    assert [diamonds(axis) for axis in figure.axes] == [[51.55, 54.95], [1.75, 1.9, 5.35], [], []]
    filled = [line for line in figure.axes[0].lines if line.get_marker() == "o" and line.get_markersize() == 5]
    means = sorted(float(np.asarray(line.get_xdata())[0]) for line in filled)
    np.testing.assert_allclose(means, [100 * v for v in sorted(FAILURES.values())])


def test_the_page_names_what_to_know():
    page = report(SOMA, records(), [Drawn("methods-clean", "Each split, clean pictures", Figure())])
    for piece in ("51.55 ± 6.19", "counts of 120", "2 splits", "![Each split, clean pictures](methods-clean.png)"):
        assert piece in page
    assert "| blind | 70.0 ± 1.0 |" in page
