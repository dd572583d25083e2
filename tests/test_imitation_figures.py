"""What a study leaves behind: figures, sentences that are computed, and the page that collects them."""

from __future__ import annotations

import re
from dataclasses import astuple, replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text
from PIL import Image

import neurosym as ns
from neurosym.cli import main
from neurosym.commands.exit_codes import BAD_INPUT
from neurosym.experiments.conclusions import conclusions
from neurosym.experiments.imitation import study, study_names
from neurosym.experiments.order_accuracy import Counts
from neurosym.experiments.reporting import RECORD
from neurosym.experiments.results_page import LARGEST, finished_runs, write_results_page
from neurosym.experiments.study_grid import Results
from neurosym.experiments.study_report import figures, report, write_results
from neurosym.plotting import COLUMN, kernel_density

LETTERS = "abcdefghijklmnopqrstuvwxyz"
COLOURS = ("red", "blue", "green", "cyan", "pink", "grey")


def counts(labels, rng, steps=6, lengths=(6,)) -> Counts:
    """Plausible counts of 50 pictures."""
    actions = tuple(f"{label}{i}" for label in labels for i in (1, 2))
    classes = tuple(k for k in range(len(labels)) for _ in (1, 2))
    wanted = np.full((50, steps), -1)
    for row in wanted:
        length = rng.choice(lengths)
        row[:length] = rng.permutation(len(actions))[:length]
    read = np.where((rng.random(wanted.shape) < 0.8) | (wanted < 0), wanted, rng.integers(len(actions)))
    truth = ns.Demonstrations(np.zeros((50, 1, 1, 1, 3), np.uint8), wanted, actions, classes=classes)
    return Counts.of(read, truth)


def made_up(name: str, means: dict | None = None, *, seeds: int = 2, **changes) -> Results:
    """Results of a study: `means` gives (method, metric) -> mean, or -> n -> mean; others are random."""
    given = replace(study(name), seeds=seeds, **changes)
    rng = np.random.default_rng(3)
    labels = {"scrabble": tuple(LETTERS), "unseen": COLOURS}.get(name, COLOURS[:3])
    lengths = {"scrabble": (3, 4, 5, 6), "variable": (2, 4, 6)}.get(name, (6,))
    metrics = ("whole_sequence", "whole_sequence_unseen", "per_step", "stop_accuracy", "re_use")
    records, counted = [], {}
    for trial in given.trials():
        for metric in (*metrics, *(() if trial.method in given.baselines else ("training_seconds",))):
            mean = (means or {}).get((trial.method, metric), rng.uniform(0.2, 0.8))
            value = mean[trial.n] if isinstance(mean, dict) else mean
            offset = 0.01 * (trial.seed - (seeds - 1) / 2)
            records.append((*astuple(trial), metric, float(value + offset)))
        if trial.method not in given.baselines:
            own = counts(labels, np.random.default_rng(trial.seed), lengths=lengths)
            counted.setdefault((trial.pictures, trial.method, trial.n), []).append(own)
    pooled = {cell: Counts.pooled(own) for cell, own in counted.items()}
    return Results(given, pd.DataFrame(records, columns=RECORD), pooled)


def texts(figure):
    return [t.get_text() for t in figure.findobj(Text) if t.get_text()]


@pytest.mark.parametrize("name", study_names())
def test_every_study_draws_its_figures_for_one_column_and_says_n(name):
    results = made_up(name)
    drawn = list(figures(results))
    assert {d.name for d in drawn if d.shown}
    assert len({d.name for d in drawn}) == len(drawn)
    for d in drawn:
        assert d.figure.get_figwidth() == COLUMN
        said = " | ".join(texts(d.figure))
        assert "50 test pictures" in said
        assert "2 seeds" in said
        assert min(t.get_fontsize() for t in d.figure.findobj(Text) if t.get_text()) >= 6


def names_of_ticks_beyond(figure):
    """Those that matplotlib keeps, but does not draw."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [t for t in axis.get_major_ticks() if not low <= t.get_loc() <= high]
            yield from (t.label1 for t in ticks)


def test_no_text_of_a_figure_is_cut_off_or_lies_on_other_text():
    results = made_up("tower", pictures=("hard",))
    for d in (*figures(results), *(d for name in ("unseen", "variable", "scrabble") for d in figures(made_up(name)))):
        d.figure.draw_without_rendering()
        width, height = d.figure.get_size_inches() * d.figure.dpi
        beyond = set(names_of_ticks_beyond(d.figure))
        written = [t for t in d.figure.findobj(Text) if t.get_text().strip() and t.get_visible() and t not in beyond]
        # The box of a slanted text is larger than the text.
        boxes = [(t.get_text(), t.get_window_extent()) for t in written if t.get_rotation() in (0, 90)]
        assert len(boxes) > 10
        for said, box in boxes:
            inside = box.x0 >= -1 and box.y0 >= -1 and box.x1 <= width + 1 and box.y1 <= height + 1
            assert inside, f"{d.name}: {said!r} is cut off"
        for k, (said, box) in enumerate(boxes):
            for other, second in boxes[k + 1 :]:
                across = min(box.x1, second.x1) - max(box.x0, second.x0)
                along = min(box.y1, second.y1) - max(box.y0, second.y0)
                assert across < 2 or along < 2, f"{d.name}: {said!r} lies on {other!r}"


def test_the_papers_figures_stand_beside_ours():
    results = made_up("tower", pictures=("hard",))
    for name in ("shares-hard", "density-hard"):
        figure = next(d.figure for d in figures(results) if d.name == name)
        diamonds = {float(line.get_xdata()[0]) for line in figure.axes[0].lines if line.get_marker() == "D"}
        assert diamonds == {0.46, 0.53, 0.63, 0.68, 0.72}


def test_curves_show_means_and_the_memorisers_line():
    heights = {50: 0.3, 100: 0.4, 200: 0.6, 400: 0.8}
    results = made_up("unseen", {("memoriser", "per_step"): heights}, sizes=(50, 100, 200, 400))
    figure = next(d.figure for d in figures(results) if d.name == "curves-hard")
    line = next(line for line in figure.axes[0].lines if line.get_label() == "memoriser")
    np.testing.assert_array_equal(line.get_xdata(), [50, 100, 200, 400])
    np.testing.assert_allclose(line.get_ydata(), [0.3, 0.4, 0.6, 0.8])
    assert line.get_linestyle() == "--"


def test_where_to_stop_is_drawn_only_where_lengths_vary():
    for name, there in (("variable", True), ("unseen", False)):
        results = made_up(name)
        figure = next(d.figure for d in figures(results) if d.name == "curves-hard")
        assert ("length right" in texts(figure)) is there
        assert ("stop accuracy" in report(results)) is there


def test_confusion_matrices_are_shares_of_what_was_demonstrated():
    results = made_up("tower", pictures=("hard",))
    figure = next(d.figure for d in figures(results) if d.name == "confusion-hard")
    assert [axis.get_title().replace("\n", "") for axis in figure.axes] == list(results.study.methods)
    for axis, method in zip(figure.axes, results.study.methods):
        own = results.counts["hard", method, 200].confusion
        assert not own[-1].any()  # no tower here is lower than another, so "none" has no row
        shown = np.asarray(axis.images[0].get_array())
        np.testing.assert_allclose(shown, own[:3, :3] / own[:3].sum(axis=1, keepdims=True))
    scrabble = [d for d in figures(made_up("scrabble")) if d.name.startswith("confusion")]
    assert [d.shown for d in scrabble] == [d.name.endswith("-sinkhorn") for d in scrabble]
    assert np.asarray(scrabble[0].figure.axes[0].images[0].get_array()).shape == (27, 27)


def test_kernel_density_has_an_area_of_one():
    grid = np.linspace(-1, 2, 3001)
    for values in ([0.5], [0.7, 0.7, 0.7], [0.1, 0.5, 0.6, 0.62]):
        assert np.trapezoid(kernel_density(values, grid), grid) == pytest.approx(1, abs=1e-3)
    assert grid[kernel_density([0.3], grid).argmax()] == pytest.approx(0.3)


ORDER = {"bc": 0.4, "bc+hungarian": 0.5, "tcn-paper": 0.6, "tcn-paper+hungarian": 0.7, "sinkhorn-paper": 0.8}


def whole(**changes: float) -> Results:
    means = {(m, "whole_sequence"): v for m, v in {**ORDER, "sinkhorn": 0.9, "memoriser": 0.85, **changes}.items()}
    means |= {("sinkhorn", "re_use"): 0.01}
    return made_up("tower", means, methods=(*ORDER, "sinkhorn"), controls={}, families={})


def test_the_order_is_said_as_it_comes_out():
    assert conclusions(whole(), "hard")[0].startswith("Whole sequences come out in the paper's order: bc 0.400")
    said = conclusions(whole(**{"sinkhorn-paper": 0.55}), "hard")[0]
    assert "**not**" in said
    assert "8 of its 10 pairs do" in said
    assert "`sinkhorn-paper` (0.550) is behind `tcn-paper` (0.600)" in said
    assert "`sinkhorn-paper` (0.550) is behind `tcn-paper+hungarian` (0.700)" in said
    level = conclusions(whole(bc=0.5), "hard")[0]
    assert "9 of its 10 pairs do" in level
    assert "`bc+hungarian` (0.500) is level with `bc` (0.500)" in level


def test_each_family_of_methods_is_set_against_the_papers_order_and_controls_have_their_table():
    families = study("tower").families
    means = {(m, "whole_sequence"): v for own in families.values() for m, v in zip(own, ORDER.values())}
    apart, loss = "blocks of one colour numbered apart", "cross-entropy through Sinkhorn"
    means |= {(apart, "whole_sequence"): 0.1, (loss, "whole_sequence"): 0.72, ("bc+hungarian", "whole_sequence"): 0.71}
    page = report(made_up("tower", means))
    assert "* With the losses as published: whole sequences come out in the paper's order: bc-published 0.400" in page
    assert "All 10 pairs do; the narrowest: `bc-published+hungarian` is ahead of `bc-published` by 0.100, in 2" in page
    assert "* With those of the paper's text: whole sequences do **not** come out" in page
    assert "* Why: With blocks of one colour numbered apart" in page
    assert f"| 200 | sinkhorn-published | {apart} | 0.100 ± 0.005 |" in page
    assert f"| 200 | {apart} |" not in page


def test_whether_ours_is_ahead_is_said_as_it_comes_out():
    ahead = [s for s in conclusions(whole(), "hard") if "each of the paper's in whole sequences (" in s]
    assert ahead == [
        "`sinkhorn` is ahead of each of the paper's in whole sequences (0.900; next is `sinkhorn-paper`, 0.800, behind "
        "in 2 of 2 seeds)."
    ]
    behind = [s for s in conclusions(whole(sinkhorn=0.65), "hard") if "each of the paper's in whole sequences (" in s]
    assert behind == [
        "`sinkhorn` is **not** ahead of each of the paper's in whole sequences (0.650 against `tcn-paper+hungarian`, "
        "0.700, `sinkhorn-paper`, 0.800)."
    ]


def test_baselines_are_named_even_where_networks_are_below_them():
    said = next(s for s in conclusions(whole(), "hard") if s.startswith("Above the memoriser in whole"))
    assert said.startswith("Above the memoriser in whole sequences (0.850): not above: `bc`")
    assert said.endswith("above: `sinkhorn`.")


def test_what_is_asked_of_ours_is_answered_by_the_numbers():
    asked = [s for s in conclusions(whole(), "hard") if s.startswith("Asked of `sinkhorn`")]
    assert "Asked of `sinkhorn`: At least .85 whole on hard pictures. Here it **holds**: 0.900 at n = 200." in asked
    assert "Asked of `sinkhorn`: No block twice. Here it **does not hold**: 0.010 at n = 200." in asked
    below = conclusions(whole(sinkhorn=0.8), "hard")
    assert any("At least .85 whole on hard pictures. Here it **does not hold**: 0.800" in s for s in below)


def test_claims_look_at_every_n_and_only_where_they_bear():
    sizes = (100, 200)
    first, second = ("sinkhorn-paper", "per_step"), ("tcn-paper+hungarian", "per_step")
    above = {first: {100: 0.5, 200: 0.6}, second: {100: 0.4, 200: 0.5}}
    crossing = {**above, second: {100: 0.4, 200: 0.7}}
    for means, verdict in ((above, "holds"), (crossing, "does not hold")):
        said = conclusions(made_up("variable", means, sizes=sizes), "hard")
        claim = next(s for s in said if "BC+Sinkhorn is ahead of BC+TCN+Hungarian" in s)
        assert f"**{verdict}**" in claim
        assert not any("from 400 demonstrations on" in s for s in said)  # no such n was run


def test_fewer_methods_leave_sentences_out_and_nothing_breaks(tmp_path):
    results = made_up("tower", methods=("bc",), baselines=("blind",))
    assert not any("sinkhorn" in s for s in conclusions(results, "hard"))
    write_results(results, tmp_path)
    assert "| 200 | bc |" in (tmp_path / "report.md").read_text()


def test_a_report_shows_the_figures_that_lie_beside_it(tmp_path):
    results = made_up("tower")
    write_results(results, tmp_path)
    page = (tmp_path / "report.md").read_text()
    for link in re.findall(r"\]\(([^)]+)\)", page):
        assert (tmp_path / link).exists()
    drawn = {p.stem for p in tmp_path.glob("*.png")}
    assert drawn == {p.stem for p in tmp_path.glob("*.svg")}
    assert len(drawn) == 3
    assert "0.46 ± 0.08" in page
    assert "| 200 | memoriser |" in page
    assert ns.__version__ in page
    assert not re.search(r"20\d\d-\d\d", page + next(tmp_path.glob("*.svg")).read_text()[:3000])  # no date


def test_the_same_results_give_the_same_files(tmp_path):
    results = made_up("variable", sizes=(100,), methods=("sinkhorn",))
    for folder in ("one", "two"):
        write_results(results, tmp_path / folder)
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name


def test_reports_come_together_on_one_page_with_small_figures(tmp_path):
    runs = tmp_path / "out"
    for name in ("variable", "tower"):
        write_results(made_up(name), runs / f"reproduce-{name}")
    (runs / "reproduce-unfinished").mkdir()
    folders = finished_runs(runs)
    assert [f.name for f in folders] == ["reproduce-tower", "reproduce-variable"]  # as in the paper
    page = write_results_page(folders, tmp_path / "docs" / "results.md")
    text = page.read_text()
    assert re.findall(r"^##? .*$", text, re.MULTILINE) == ["# Results", "## tower", "## variable"]
    assert "### tower: hard pictures" in text
    links = re.findall(r"\]\(([^)#]+)\)", text)
    assert len(links) == 3 + 2
    for link in links:
        figure = page.parent / link
        assert figure.stat().st_size <= LARGEST
        with Image.open(figure) as small, Image.open(
            runs / f"reproduce-{link.split('/')[1].partition('-')[0]}" / link.partition("-")[2]
        ) as large:
            assert small.size == large.size
            difference = np.abs(np.asarray(small.convert("RGB"), int) - np.asarray(large.convert("RGB"), int))
            assert difference.mean() < 1
    for title, anchor in re.findall(r"^\* \[(.*)\]\(#(.*)\)$", text, re.MULTILINE):
        assert anchor == title.lower().replace(" ", "-")


def test_a_page_of_nothing_is_refused(tmp_path):
    with pytest.raises(ns.InputError, match="at least one folder"):
        write_results_page([], tmp_path / "results.md")
    with pytest.raises(ns.InputError, match="neurosym reproduce"):
        write_results_page([tmp_path], tmp_path / "results.md")
    (tmp_path / "report.md").write_text("# x\n\n![gone](gone.png)\n")
    with pytest.raises(ns.InputError, match=r"gone\.png"):
        write_results_page([tmp_path], tmp_path / "docs" / "results.md")
    with pytest.raises(ns.InputError, match="different names"):
        write_results_page([tmp_path, tmp_path], tmp_path / "results.md")


def test_the_command_collects_finished_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as left:
        main(["results"])
    assert left.value.code == BAD_INPUT
    write_results(made_up("unseen", sizes=(50,), methods=("sinkhorn",)), tmp_path / "out" / "reproduce-unseen")
    with pytest.raises(SystemExit) as left:
        main(["results", "--to", "page.md"])
    assert left.value.code == 0
    assert "1 experiment" in capsys.readouterr().err
    assert "## unseen" in (tmp_path / "page.md").read_text()
    assert sorted(p.name for p in (tmp_path / "figures").iterdir()) == [
        "unseen-confusion-hard.png",
        "unseen-curves-hard.png",
    ]
