"""The 3D view: a timeline's parts as nodes of a viser scene, moved by time."""

import itertools
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np
import viser

from neurosym.geometry.stability.spring_verdicts import ContactForces
from neurosym.simulation.scene import part_colours
from neurosym.support.arrays import Array
from neurosym.viewer.solids import Solid, solids
from neurosym.viewer.steps import HELD
from neurosym.viewer.timeline import Timeline, floor_of

RGB = tuple[int, int, int]
#: The largest extent of the work in the scene: cameras, lines and light need no thought of millimetres or metres.
SIZE = 2.0
#: More parts than this bear no names at first: they would hide the work.
MOST_NAMES = 12
#: How opaque parts are while another one is selected.
FAINT = 0.22
#: How many times as thick as others the outline of a part is that is held.
HELD_BY = 3.0
#: Turns a picture, which faces along -z with its top at -y, so that it lies face up with its top at +y.
_UPWARD = (0.0, 1.0, 0.0, 0.0)
#: The camera's field of view (radians, top to bottom), where it looks from (the front, a little from the right, from
#: above), and how much more than all that is ever seen it takes in.
FIELD_OF_VIEW, FROM, MARGIN = 0.7, np.array([0.35, -0.75, 0.56]), 1.05
#: Light: colours (0..255) of the sky and of what the ground throws back, with their strength; strength of the sun, and
#: where it stands. The viewer's film curve makes bright colours pale, so that no face may get more than about 4 in all.
SKY, SUN, SUN_FROM = ((255, 255, 255), (165, 165, 170), 2.2), 2.0, np.array([-0.35, -0.6, 1.0])

_EDGE, _PICKED = (45, 45, 45), (213, 94, 0)

#: Forces at contacts: how long the largest is, and the colours of one without friction and of one that slips.
_LONGEST, _FIRM, _SLIPS = 0.35 * SIZE, np.array([0, 158, 115]), np.array([213, 94, 0])


def named_at_first(timeline: Timeline | None) -> bool:
    """Whether parts bear their names before anybody asks: where they are few, and no picture says what they are."""
    return timeline is not None and len(timeline.names) <= MOST_NAMES and not timeline.staging.tops


class PlanScene:
    """Parts in a viser scene; `on_pick` is called with a part's name when it is clicked.

    Nodes are named by the parts' numbers, since names may hold anything.
    """

    def __init__(self, server: viser.ViserServer, on_pick: Callable[[str], None] | None = None) -> None:
        self.server = server
        self._on_pick = on_pick
        self._clear(None)
        server.scene.set_up_direction("+z")
        light(server.scene)

    def _clear(self, timeline: Timeline | None) -> None:
        """Nothing of a timeline is in the scene yet."""
        self.timeline = timeline
        self._usual: Mapping[str, RGB | None] | None = None
        self.parts: list[viser.MeshHandle] = []
        self._names: list[viser.LabelHandle] = []
        self._outlines: dict[str, viser.LineSegmentsHandle] = {}
        self._path: viser.LineSegmentsHandle | None = None
        self._path_step: int | None = None
        self._arrows: viser.ArrowsHandle | None = None
        self._standing_out: Mapping[str, RGB | None] | None = None
        self._held: frozenset[str] = frozenset()

    def put(self, timeline: Timeline | None, standing_out: Collection[str] | None = None) -> None:
        """Show another timeline from its beginning, or nothing.

        Args:
            standing_out: names of the parts that are not faint while nothing else stands out; None: all.
        """
        with self.server.atomic():
            self.server.scene.remove_by_name("/parts")
            self._clear(timeline)
            if timeline is not None:
                self._add(timeline)
                self.show(0.0)
                self._usual = None if standing_out is None else dict.fromkeys(standing_out)
                self.stand_out(None)

    def _add(self, timeline: Timeline) -> None:
        assembly = timeline.staging.assembly
        low, high = assembly.bounds
        self._sent = np.full((len(assembly), 8), np.nan)
        self.scale = SIZE / float((high - low).max())
        self.origin = np.array([*(low[:2] + high[:2]) / 2, floor_of(assembly)])
        colours = part_colours(timeline.staging).values()
        self._colours = [(round(255 * r), round(255 * g), round(255 * b)) for r, g, b in colours]
        self._thick = 0.0035 * SIZE * min(1.0, 6.0 / len(assembly) ** 0.5)
        for i, solid in enumerate(solids(assembly)):
            self._add_part(timeline, i, solid)
        low, high = self._to_scene(timeline.bounds())
        self._ground(timeline, low, high)
        boxes = self._to_scene(timeline.boxes())
        corners = [boxes[:, list(c), range(3)] for c in itertools.product((0, 1), repeat=3)]
        self._look(np.concatenate(corners))

    def _add_part(self, timeline: Timeline, i: int, solid: Solid) -> None:
        """A part's mesh, and under it in the tree its outline, its picture and its name."""
        assembly, scene = timeline.staging.assembly, self.server.scene
        name, middle = assembly.names[i], timeline.centres[i]
        vertices, outline = (solid.vertices - middle) * self.scale, (solid.outline - middle) * self.scale
        node = scene.add_mesh_simple(f"/parts/{i}", vertices, solid.faces, color=self._colours[i], flat_shading=True)
        if len(outline):
            self._outlines[name] = scene.add_line_segments(f"/parts/{i}/edges", outline, _EDGE, thickness=self._thick)
        if name in timeline.staging.tops:
            x, y, z = np.ptp(timeline.bounds_at_rest[i], axis=0) * self.scale
            top = timeline.staging.tops[name]
            at = (0.0, 0.0, 0.51 * z)
            scene.add_image(f"/parts/{i}/top", top, 0.98 * x, 0.98 * y, format="png", wxyz=_UPWARD, position=at)
        named = named_at_first(timeline)
        # On top of the part, and hidden by what is before it.
        over: dict[str, Any] = {"position": (0.0, 0.0, vertices[:, 2].max() + 0.01 * SIZE), "depth_test": True}
        look: dict[str, Any] = {"font_screen_scale": 0.9, "anchor": "bottom-center", "visible": named}
        tag = scene.add_label(f"/parts/{i}/name", name, **over, **look)
        self.parts.append(node)
        self._names.append(tag)
        on_pick = self._on_pick
        if on_pick is not None:
            node.on_click(lambda _: on_pick(name))

    def _ground(self, timeline: Timeline, low: Array, high: Array) -> None:
        middle, size = (low + high) / 2, (high - low)[:2] + 0.4 * SIZE
        self.server.scene.add_grid(
            "/parts/ground",
            width=float(size[0]),
            height=float(size[1]),
            cell_size=0.1 * SIZE,
            section_size=0.5 * SIZE,
            cell_color=(222, 222, 218),
            section_color=(200, 200, 196),
            position=(float(middle[0]), float(middle[1]), -0.002 * SIZE),
            plane_color=(240, 240, 237),
            plane_opacity=1.0 if timeline.staging.assembly.has_table else 0.0,
        )

    def _look(self, points: Array) -> None:
        """Place the cameras as near as they can be and still see all of the film in a square window."""
        eye, middle = camera_for(points)
        camera = self.server.initial_camera
        camera.position, camera.look_at, camera.up = tuple(eye), tuple(middle), (0.0, 0.0, 1.0)
        camera.fov = FIELD_OF_VIEW
        for client in self.server.get_clients().values():
            client.camera.position, client.camera.look_at = eye, middle

    def _to_scene(self, points: Array) -> Array:
        return np.asarray((points - self.origin) * self.scale)

    def show(self, t: float) -> None:
        """Move all parts to where they are at time t; only what changed is sent."""
        timeline = self.timeline
        if timeline is None:
            return
        positions, turns = timeline.frames(t)
        seen = timeline.visible(t)
        now = np.concatenate([self._to_scene(positions), turns, seen[:, None]], axis=1)
        # A step moves a few parts of hundreds, and turns fewer.
        new = now != self._sent
        with self.server.atomic():
            for i in np.flatnonzero(new[:, :3].any(axis=1)):
                self.parts[i].position = now[i, :3]
            for i in np.flatnonzero(new[:, 3:7].any(axis=1)):
                self.parts[i].wxyz = now[i, 3:7]
            for i in np.flatnonzero(new[:, 7]):
                self.parts[i].visible = bool(seen[i])
            self._show_path(timeline, t)
        self._sent = now

    def _show_path(self, timeline: Timeline, t: float) -> None:
        """The path of the step under way as a line, which the parts' middle follows; and what is held meanwhile."""
        step = timeline.step_at(t)
        if step == self._path_step:
            return
        self._path_step = step
        self._hold(() if step is None else timeline.staging.motions[step].held)
        if self._path is not None:
            self._path.remove()
            self._path = None
        if step is not None:
            path = timeline.path_of(step)
            if not len(path):
                return  # it moves nothing
            path = self._to_scene(path)
            pieces = np.stack([path[:-1], path[1:]], axis=1)
            self._path = self.server.scene.add_line_segments("/parts/way", pieces, _PICKED, thickness=0.008 * SIZE)

    def _hold(self, names: Collection[str]) -> None:
        """Outline what is held, boldly and in its colour; what was held before is as it was."""
        for name in self._held.symmetric_difference(names).intersection(self._outlines):
            outline, held = self._outlines[name], name in names
            outline.colors = np.full_like(outline.colors, HELD if held else _EDGE)
            outline.thickness = HELD_BY * self._thick if held else self._thick
        self._held = frozenset(names)

    def stand_out(self, colours: Mapping[str, RGB | None] | None) -> None:
        """Let parts stand out, each in a colour (0..255) or, with None, its own, the others faint; None ends it."""
        timeline, colours = self.timeline, self._usual if colours is None else colours
        if timeline is None or colours == self._standing_out:
            return
        self._standing_out = colours
        with self.server.atomic():
            for name, node, own in zip(timeline.names, self.parts, self._colours):
                chosen = colours is None or name in colours
                node.opacity = None if chosen else FAINT
                node.color = (colours or {}).get(name) or own
                # Of few parts the outlines say what is where; of many they would hide those that stand out.
                if name in self._outlines:
                    self._outlines[name].visible = chosen or len(self.parts) <= MOST_NAMES

    def show_forces(self, forces: ContactForces | None) -> None:
        """Arrows of the forces at contacts, on whichever part each lifts, redder the nearer they are to slipping."""
        if self._arrows is not None:
            self._arrows.remove()
            self._arrows = None
        if forces is None or not len(forces.forces):
            return
        lift = np.where(forces.forces[:, 2] < 0, -1.0, 1.0)[:, None] * forces.forces
        start = self._to_scene(forces.points)
        ends = start + lift * (_LONGEST / np.linalg.norm(lift, axis=1).max())
        colours = _FIRM + forces.slipping[:, None] * (_SLIPS - _FIRM)
        self._arrows = self.server.scene.add_arrows(
            "/parts/forces",
            np.stack([start, ends], axis=1),
            colours.astype(np.uint8),
            shaft_radius=0.004 * SIZE,
            head_radius=0.012 * SIZE,
            head_length=0.03 * SIZE,
        )

    def name_parts(self, visible: bool) -> None:
        """Show or hide the parts' names."""
        with self.server.atomic():
            for tag in self._names:
                tag.visible = visible


def light(scene: viser.SceneApi) -> None:
    """Light a scene so that a part's colour is that of the pictures, and its faces are told apart."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    sky, ground, strength = SKY
    scene.add_light_hemisphere(
        "/lights/sky", sky_color=sky, ground_color=ground, intensity=strength, position=(0.0, 0.0, 5.0)
    )
    x, y, z = (5.0 * SUN_FROM / np.linalg.norm(SUN_FROM)).tolist()
    scene.add_light_directional("/lights/sun", intensity=SUN, cast_shadow=True, position=(x, y, z))


def camera_for(points: Array) -> tuple[Array, Array]:
    """Where a camera stands and what it looks at, float64 (3,) each: as near as it can be and still see all points.

    The points, float64 (n, 3), are in the scene, and all seen in a square window.
    """
    back = FROM / np.linalg.norm(FROM)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back], axis=1)
    seen, slope = points @ axes, np.tan(FIELD_OF_VIEW / 2) / MARGIN
    # From (x, y, z) a point is in sight where |x - px| and |y - py| are at most (z - pz) * slope.
    most = (seen[:, :2] + seen[:, 2:] * slope).max(axis=0)
    least = (seen[:, :2] - seen[:, 2:] * slope).min(axis=0)
    away = float((most - least).max()) / (2 * slope)
    middle = np.array([*(most + least) / 2, seen[:, 2].mean()])
    return axes @ np.array([*middle[:2], away]), axes @ middle
