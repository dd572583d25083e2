"""What prints, and what a notebook shows."""

from html.parser import HTMLParser

import numpy as np
import pytest

import neurosym as ns
from neurosym.cli import main
from neurosym.plotting import blocking_figure, scores_figure, search_figure
from neurosym.support.html import SHOWN, table

ARCH = {"left": [(0, 0, 0), (0, 0, 1)], "right": [(2, 0, 0), (2, 0, 1)], "beam": [(0, 0, 2), (1, 0, 2), (2, 0, 2)]}


class Text(HTMLParser):
    """The text of a page, and whether its tags close."""

    def __init__(self, page):
        super().__init__()
        self.open, self.text = [], []
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        if tag != "br":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def problem():
    return ns.load_domain("assembly").problem(ns.Assembly.from_cells(ARCH), name="arch")


@pytest.mark.parametrize("options", [{}, {"directions": "-z"}, {"target": ["left"]}])
def test_a_result_prints_what_the_command_prints(options, tmp_path, capsys):
    path = tmp_path / "arch.json"
    ns.Assembly.from_cells(ARCH).save(path)
    result = ns.solve(ns.load_domain("assembly").problem(path, name="arch.json", **options), prior="outermost-first")
    words = [w for k, v in options.items() for w in (f"--{k}", v if isinstance(v, str) else v[0])]
    with pytest.raises(SystemExit) as left:
        main(["plan", str(path), *words])
    assert left.value.code == result.status.exit_code
    head, *printed = capsys.readouterr().out.splitlines()
    assert head.startswith("arch.json: ")
    *expected, _ = str(result).splitlines()  # the last has the time
    assert printed[: len(expected)] == expected


def test_reprs_are_short(problem):
    assembly, result = problem.world, ns.solve(problem)
    assert repr(assembly) == "Assembly(3 parts: left, right and beam)"
    assert repr(assembly.parts[0]) == "Part('left', 2 bodies)"
    assert repr(result).startswith("PlanResult(SOLVED, beam, ")
    scores = ns.OrderScores.from_order((2, 0, 1), problem.actions)
    assert repr(scores) == "OrderScores(3 steps, 3 actions: beam, left and right)"
    many = ns.Assembly.from_cells({f"p{i}": [(2 * i, 0, 0)] for i in range(500)})
    for thing in (problem, assembly, many, result, scores, problem.geometry, many.parts[7].bodies[0], *result.motions):
        assert len(repr(thing)) < 200
        assert "\n" not in repr(thing)


def test_notebooks_are_shown_tables(problem):
    scores = ns.OrderScores.from_order((2, 0, 1), problem.actions, confidence=0.9)
    result = ns.solve(problem)
    for thing, says in (
        (problem, "Goal: not present(left)"),
        (problem.world, "1 x 1 x 2"),
        (scores, "The likeliest order: beam, left and right."),
        (result, "A plan was found."),
    ):
        assert any(says in text for text in Text(thing._repr_html_()).text), says
    assert [t for t in Text(scores._repr_html_()).text if t in ("90", "5")].count("90") == 3


def test_names_are_text_in_a_table_and_long_tables_are_cut():
    assert Text(table(("<b>",), [("<script>",)])).text == ["<b>", "<script>"]
    text = Text(table(("n",), [(i,) for i in range(SHOWN + 5)])).text
    assert "5 more rows are not shown." in text
    assert str(SHOWN) not in text


def test_figures_show_themselves(problem):
    scores = ns.OrderScores.uniform(3, problem.actions)
    for figure in (blocking_figure(problem.geometry), scores_figure(scores), search_figure(ns.solve(problem))):
        assert figure._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    assert np.isfinite(figure.get_size_inches()).all()
