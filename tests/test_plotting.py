"""Figures: returned, not shown; legible at column width; without matplotlib's global state. Exploded views."""

import itertools
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.experiments.benchmark import Comparison, Outcome, Run
from neurosym.experiments.order_accuracy import Counts
from neurosym.geometry.shapes import Body, Box, Part
from neurosym.planning.staging import Staging, building, stage
from neurosym.plotting import (
    COLOURS,
    COLUMN,
    Curves,
    classes_figure,
    curves_figure,
    exploded_figure,
    iterations_figure,
    repeats_figure,
    save,
)
from neurosym.plotting.exploded import _FIXED, MOST_NAMED, _colours
from neurosym.plotting.labels import PITCH, crosses, in_columns
from neurosym.plotting.painter import Piece, back_to_front
from neurosym.plotting.solids import pieces_of, seen_from
from neurosym.simulation.scene import part_colours
from neurosym.testing.burrs import burr


def outcome(priors=("none", "sinkhorn"), planners=("swap-repair", "best-first"), seeds=2, n=30) -> Outcome:
    comparison = Comparison("soma", tuple(range(n)), planners, priors, {"collapse": "cubes"}, seeds=seeds)
    rng = np.random.default_rng(0)
    runs = []
    for planner, prior, seed in comparison.cells:
        for number in comparison.numbers:
            count = int(rng.poisson(5 if prior == "none" else 0.2))
            runs.append(Run(planner, prior, seed, number, "SOLVED", count, 7, 7 + count, 0.001, count > 0))
    return Outcome(comparison, tuple(runs))


def texts(figure):
    return [t.get_text() for t in figure.findobj(lambda artist: hasattr(artist, "get_text"))]


def test_it_says_what_is_drawn_with_units_and_n():
    said = " | ".join(texts(iterations_figure(outcome())))
    for piece in ("iterations (refusals", "30 problems × 2 seeds", "no prior", "sinkhorn", "swap-repair", "best-first"):
        assert piece in said


def test_it_fits_a_column():
    assert iterations_figure(outcome()).get_figwidth() == COLUMN


def test_a_long_name_of_a_prior_leaves_room_for_the_bars():
    figure = iterations_figure(outcome(priors=("none", "runs/" + "a-long-name-" * 6 + "7.safetensors")))
    figure.draw_without_rendering()
    assert all(axis.get_window_extent().width > 0.5 * figure.bbox.width for axis in figure.axes)
    said = [t.get_text() for t in figure.axes[0].get_yticklabels()]
    assert said[0] == "no prior"
    assert (said[1][:6], said[1][-1]) == ("a-long", "7")


def test_bars_are_shares_of_all_runs():
    axis = iterations_figure(outcome(priors=("none",), planners=("swap-repair",))).axes[0]
    heights = sum(patch.get_height() for patch in axis.patches)
    assert heights == pytest.approx(0.82)


def test_the_published_mean_is_marked_where_there_is_one():
    def diamonds(given):
        return [line for axis in iterations_figure(given).axes for line in axis.lines if line.get_marker() == "D"]

    assert [line.get_xdata()[0] for line in diamonds(outcome())] == [5.35]
    assert diamonds(outcome(priors=("sinkhorn",), planners=("best-first",))) == []


def test_colours_are_different_and_enough():
    assert len(set(COLOURS)) == len(COLOURS) >= 5


def test_a_single_run_and_many_priors_can_be_drawn(tmp_path):
    assert save(iterations_figure(outcome(n=1, seeds=1)), tmp_path / "one.png").stat().st_size > 1000
    many = tuple(f"p{i}" for i in range(12))
    assert save(iterations_figure(outcome(priors=many, n=2)), tmp_path / "deep" / "many.pdf").exists()
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_pyplot_is_never_loaded():
    code = (
        "import sys; sys.path.insert(0, 'tests'); from test_plotting import *;"
        "iterations_figure(outcome(n=3)); assert 'matplotlib' in sys.modules;"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=str(__import__("pathlib").Path(__file__).parents[1]))


# -- exploded views -------------------------------------------------------------------------------------------


TURN = seen_from(-58, 24)


def box(name, size, X):
    return Part(name, (Body(Box(np.array(size, dtype=float)), np.eye(4)),), X)


def ring():
    """Three sticks of which each lies on the next and the last on the first: no order of whole parts is right."""
    parts = []
    for k, name in enumerate("abc"):
        X = np.eye(4)
        X[:3, :3] = Rotation.from_euler("ZY", [120 * k, -20], degrees=True).as_matrix()
        X[:3, 3] = Rotation.from_euler("z", 120 * k, degrees=True).apply([0, 0.8, 0])
        parts.append(box(name, (4, 0.3, 0.1), X))
    return ns.Assembly(tuple(parts))


def crossing(seed):
    """Parts that go through one another, as parts from CAD do a little."""
    rng = np.random.default_rng(seed)
    parts = []
    for k in range(5):
        X = np.eye(4)
        X[:3, :3] = Rotation.random(random_state=10 * seed + k).as_matrix()
        parts.append(box(f"p{k}", rng.uniform(0.3, 3, 3), X))
    return ns.Assembly(tuple(parts))


def turned(assembly, seed):
    """The same in any pose."""
    X = np.eye(4)
    X[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    return assembly.transformed(X)


def cells(name):
    return ns.Assembly.from_cells(burr(name).cells)


def nearest(assembly, view, points):
    """The part that a ray from the viewer hits first at each point of the picture, -1: none; box by box."""
    found, height = np.full(len(points), -1), np.full(len(points), -np.inf)
    for body, part in enumerate(assembly.owners):
        X = assembly.X_WB[body]
        axes, centre = view @ X[:3, :3], view @ X[:3, 3]
        half = assembly.box_sizes[body] / 2
        # In the box's frame the ray is start + t * way.
        start = (np.c_[points, np.zeros(len(points))] - centre) @ axes
        with np.errstate(divide="ignore"):
            ends = np.stack([(-half - start) / axes[2], (half - start) / axes[2]])
        enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        hit = (enter < leave - 1e-9) & (leave > height)
        found[hit], height[hit] = part, leave[hit]
    return found


def painted(pieces, points):
    """The part whose face is laid on last at each point, -1: none."""
    from matplotlib.path import Path

    found = np.full(len(points), -1)
    for piece in pieces:
        for face in piece.faces:
            found[Path(face[:, :2]).contains_points(points)] = piece.part
    return found


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("name", ["ring", "pairs", "bolts", "rings", "crossing"])
def test_what_is_in_front_is_laid_on_later(name, seed):
    made = {"ring": ring, "crossing": lambda: crossing(seed)}.get(name, lambda: turned(cells(name), seed))
    assembly = made()
    view = TURN if name != "ring" else seen_from(45 * seed, 90)
    pieces = back_to_front(pieces_of(assembly, dict.fromkeys(assembly.names, np.zeros(3)), view), view.T.copy())
    every = np.concatenate([piece.points[:, :2] for piece in pieces])
    points = np.random.default_rng(seed).uniform(every.min(axis=0), every.max(axis=0), (1500, 2))
    wanted, drawn = nearest(assembly, view, points), painted(pieces, points)
    assert (wanted >= 0).sum() > 200
    assert (wanted != drawn).mean() < 0.002  # what hits an edge to the last digit


@pytest.mark.parametrize("name", ["cylinder", "icosphere", "capsule", "box"])
def test_the_faces_of_a_convex_part_fill_its_outline_once(name):
    import trimesh
    from scipy.spatial import ConvexHull

    shape = {"radius": 1.0, "height": 3.0} if name in ("cylinder", "capsule") else {}
    assembly = turned(ns.Assembly.from_meshes({name: getattr(trimesh.creation, name)(**shape)}), 4)
    (piece,) = pieces_of(assembly, {name: np.zeros(3)}, TURN)

    def area(face):
        x, y = face[:, 0], face[:, 1]
        return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2

    assert sum(map(area, piece.faces)) == pytest.approx(ConvexHull(assembly.body_vertices(0) @ TURN.T[:, :2]).volume)


def test_a_line_in_a_part_is_laid_on_before_it():
    cube = ns.Assembly.from_cells({"cube": [(0, 0, 0)]})
    faces = pieces_of(cube, {"cube": np.zeros(3)}, TURN)
    inside = Piece(0, (), (), (np.array([[0.4, 0.5, 0.5], [0.6, 0.5, 0.5]]) @ TURN.T,), np.zeros((0, 4)))
    above = Piece(0, (), (), (np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 1.5]]) @ TURN.T,), np.zeros((0, 4)))
    for given in ([inside, above, *faces], [*faces, above, inside]):
        kinds = [len(piece.faces) for piece in back_to_front(given, TURN.T.copy())]
        assert kinds == [0, 0, 3, 0]  # the line that leaves the cube is cut in two


def test_a_part_of_cubes_has_no_lines_between_them_and_a_mesh_none_between_its_triangles():
    def lines(assembly):
        pieces = pieces_of(assembly, dict.fromkeys(assembly.names, np.zeros(3)), TURN)
        return {tuple(np.round(np.sort(line, axis=0), 6).ravel()) for piece in pieces for line in piece.lines}

    bar = ns.Assembly.from_cells({"bar": [(0, 0, 0), (1, 0, 0)]})
    assert len(lines(ns.Assembly.from_cells({"cube": [(0, 0, 0)]}))) == 9  # twelve edges, three behind
    assert len(lines(bar)) == 9 + 3  # the long ones are in two pieces
    import trimesh

    ball = ns.Assembly.from_meshes({"ball": trimesh.creation.icosphere(subdivisions=3)})
    outline = np.array(sorted(lines(ball)))
    assert len(outline) < 200  # of 1,920 edges: where the ball turns away


def plan_of(domain, number, **options):
    problem = ns.load_domain(domain).problem(number, **options)
    result = ns.solve(problem, planner="best-first", rng=0)
    return problem, result, stage(problem, result.plan, result.how)


def names_in(figure):
    return [t for t in figure.axes[0].texts if t.get_fontsize() == 6.5]


def test_every_part_is_named_once_with_its_number_in_the_plan():
    problem, result, staging = plan_of("soma", 17)
    figure = exploded_figure(staging, title="Soma 17")
    wanted = sorted(f"{result.plan.index(name) + 1}: {name}" for name in problem.world.names)
    assert sorted(t.get_text() for t in names_in(figure)) == wanted
    said = " | ".join(texts(figure))
    for piece in ("Soma 17", "n = 7 parts", "order of removal", "1 cube", "dashed"):
        assert piece in said


def test_what_the_numbers_are_follows_the_plan():
    stool = ns.Assembly.from_cells({"leg": [(0, 0, 0)], "seat": [(0, 0, 1)]})
    assert "no plan" in " ".join(texts(exploded_figure(stool)))
    brought = exploded_figure(building(stool, ["leg"], ["seat"]))
    assert "order of assembly" in " ".join(texts(brought))
    assert {t.get_text() for t in names_in(brought)} == {"leg", "1: seat"}


def test_the_scale_has_the_units_and_length_of_the_assembly():
    import trimesh

    def arms(assembly):
        figure = exploded_figure(assembly, view=(0, 0))  # y to the right, z up, one inch as long as another
        said = next(t.get_text() for t in figure.axes[0].texts if "each arm" in t.get_text())
        lengths = [np.hypot(*np.ptp(line.get_xydata(), axis=0)) for line in figure.axes[0].lines[-3:]]
        drawn = np.concatenate([path.vertices for path in figure.axes[0].collections[0].get_paths()])
        return said, lengths, np.ptp(drawn, axis=0)

    plate = trimesh.creation.cylinder(radius=40, height=20)
    assembly = ns.Assembly.from_meshes({"plate": plate})
    said, lengths, drawn = arms(ns.Assembly(assembly.parts, units="mm"))
    assert "each arm:\n10 mm" in said
    assert lengths[1:] == pytest.approx([drawn[0] / 8, drawn[0] / 8], rel=1e-3)  # the plate is 80 mm wide
    assert drawn[1] == pytest.approx(drawn[0] / 4, rel=1e-3)
    said, lengths, drawn = arms(ns.Assembly.from_cells({"bar": [(0, y, 0) for y in range(40)]}, size=3.0))
    cubes = int(said.split()[2])
    assert lengths[1] == pytest.approx(cubes * drawn[0] / 40)


ASSEMBLIES = {
    "soma": lambda: plan_of("soma", 17)[2],
    "tower": lambda: plan_of("tower", 1)[2],
    "burr": lambda: cells("bolts"),
    "turned": lambda: turned(cells("pairs"), 3),
    "one": lambda: ns.Assembly.from_cells({"alone, with a name that is long": [(0, 0, 0)]}),
    "column": lambda: ns.Assembly.from_cells({f"block number {z}": [(0, 0, z)] for z in range(30)}),
    "row": lambda: ns.Assembly.from_cells({f"{x}": [(x, 0, 0)] for x in range(MOST_NAMED)}),
    "many": lambda: ns.Assembly.from_cells({f"{x}": [(x, 0, 0)] for x in range(MOST_NAMED + 1)}),
}


@pytest.mark.parametrize("name", ASSEMBLIES)
def test_nothing_is_clipped_or_small_and_no_text_lies_on_another(name):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.transforms import Bbox

    figure = exploded_figure(ASSEMBLIES[name](), title=name)
    assert figure.get_figwidth() == COLUMN
    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = {t: t.get_window_extent(renderer) for t in figure.axes[0].texts if t.get_text()}
    drawn = np.concatenate([path.vertices for path in figure.axes[0].collections[0].get_paths()])
    boxes["the parts"] = Bbox(figure.axes[0].transData.transform([drawn.min(axis=0), drawn.max(axis=0)]))
    for artist, box in boxes.items():
        assert box.x0 >= 0 <= box.y0, artist
        assert box.x1 <= figure.bbox.x1, artist
        assert box.y1 <= figure.bbox.y1, artist
    assert min(t.get_fontsize() for t in figure.axes[0].texts) >= 6
    for (a, box), (b, other) in itertools.combinations(boxes.items(), 2):
        assert not box.overlaps(other), (a, b)
    assert ("names are left out" in " ".join(texts(figure))) == (name == "many")


def test_lines_of_labels_do_not_cross_and_names_keep_their_distance():
    rng = np.random.default_rng(1)
    for count in (1, 7, 28, 52):
        points = {f"p{k}": tuple(rng.uniform((1, 1), (2.4, 2))) for k in range(count)}
        labels = in_columns({name: name for name in points}, points, 0.8, 2.6, (0.5, 0.5 + PITCH * 25))
        assert {label.key: label.point for label in labels} == points
        assert not any(crosses(a.place, a.point, b.place, b.point) for a, b in itertools.combinations(labels, 2))
        for right in (False, True):
            heights = sorted(label.place[1] for label in labels if label.right == right)
            assert all(high - low > PITCH - 1e-9 for low, high in itertools.pairwise(heights))
            assert not heights or (heights[0] > 0.5 - 1e-9 and heights[-1] < 0.5 + PITCH * 25 + 1e-9)


def test_names_are_not_levelled_where_lines_would_cross(monkeypatch):
    points = {"a": (1.0, 1.2), "b": (1.0, 1.8)}

    def exchanged(given, span):
        return [replace(label, place=other.place) for label, other in zip(given, reversed(given))]

    monkeypatch.setattr("neurosym.plotting.labels._levelled", exchanged)
    a, b = in_columns({"a": "a", "b": "b"}, points, 0.8, 2.6, (0.5, 2.5))
    assert a.place[1] < b.place[1]


def test_a_dot_is_on_its_part_and_open_where_nothing_is_seen():
    box = ns.Assembly.from_cells(
        {"core": [(1, 1, 1)], "shell": [c for c in itertools.product(range(3), repeat=3) if c != (1, 1, 1)]}
    )
    dots = [line for line in exploded_figure(box, spread=0).axes[0].lines if line.get_marker() == "o"]
    assert [line.get_markerfacecolor() for line in dots] == ["white", "0.15"]


def test_fixed_parts_are_grey_and_wrong_requests_are_refused():
    stool = ns.Assembly.from_cells({"leg": [(0, 0, 0)], "seat": [(0, 0, 1)]}).with_fixed(["leg"])
    assert "grey: fixed" in " ".join(texts(exploded_figure(stool)))
    with pytest.raises(ns.InputError, match="azimuth and elevation"):
        exploded_figure(stool, view=(0, float("nan")))
    with pytest.raises(ns.InputError, match="spread of 0 or more"):
        exploded_figure(Staging(stool, stool.names, ()), spread=-1)


def test_each_part_of_an_exploded_view_has_a_colour_of_its_own():
    row = ns.Assembly.from_cells({f"p{i}": [(i, 0, 0)] for i in range(12)}).with_fixed(["p3"])
    staging = Staging(row, row.names, (), {"p5": (0.1, 0.2, 0.3)})
    colours = _colours(staging)
    assert len(set(colours)) == 12
    assert colours[5] == (0.1, 0.2, 0.3)
    assert colours[3] == _FIXED
    films = part_colours(staging)
    assert all(colours[i] == films[name] for i, name in enumerate(row.names) if i != 3)


def test_an_exploded_view_loads_no_simulator():
    code = (
        "import sys, neurosym as ns; from neurosym.plotting import exploded_figure;"
        "exploded_figure(ns.Assembly.from_cells({'a': [(0, 0, 0)], 'b': [(0, 0, 1)]}));"
        "assert not {'pybullet', 'matplotlib.pyplot', 'torch'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


# -- what methods do not hide from one another ----------------------------------------------------------------


def counts_of(wrong):
    """Two classes of two actions; `wrong` of four steps are read as the other class."""
    wanted = np.array([[0, 1, 2, 3]] * 5)
    read = wanted.copy()
    read[0, :wrong] = (read[0, :wrong] + 2) % 4
    pictures = np.zeros((5, 1, 1, 1, 3), np.uint8)
    return Counts.of(read, ns.Demonstrations(pictures, wanted, ("a1", "a2", "b1", "b2"), classes=(0, 0, 1, 1)))


def test_equal_shares_of_methods_stand_side_by_side():
    same = counts_of(1)
    axis = classes_figure("letters", {"tcn": same, "sinkhorn": same}).axes[0]
    places = [tuple(x) for line in axis.lines for x in line.get_xydata().round(6)]
    assert len(set(places)) == len(places) == 4
    assert all(abs(x - round(x)) < 0.4 for x, _ in places)  # still at their own class


def test_markers_at_both_ends_are_whole():
    for axis in repeats_figure("letters", {"tcn": counts_of(1)}).axes:
        low, high = axis.get_ylim()
        values = np.concatenate([line.get_ydata() for line in axis.lines])
        assert low < min(0, values.min())
        assert high > 1.04 * values.max()


def test_bands_are_explained_where_there_are_some():
    def said(seeds):
        panel = Curves("steps right", {"tcn": {10: [0.5] * seeds, 20: [0.7] * seeds}})
        return " ".join(texts(curves_figure("tower", "demonstrations", [panel])))

    assert "bands: least to greatest" in said(2)
    assert "bands" not in said(1)
