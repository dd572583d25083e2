"""The arm puts an assembly of boxes together from a plan: grasps from above, moves that OMPL plans, contact by physics.

Nothing is glued: a block is held by the friction of two fingers, and let go. Where the blocks are is known exactly, as
a perfect camera would tell; every grasp starts from where the block really lies, and puts it down by where it really
sits in the hand.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack

import numpy as np
from scipy.spatial.transform import Rotation

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.rigid_motions import posed
from neurosym.geometry.shapes import Box
from neurosym.geometry.staging import Staging
from neurosym.simulation.panda.arm import WIDEST, from_above
from neurosym.simulation.panda.cell import Cell, Load
from neurosym.simulation.panda.hand import APPROACH, CAREFUL, Failed, Hand, lifted
from neurosym.simulation.panda.report import BuildReport, BuildSettings, Placement
from neurosym.simulation.panda.watching import CellWindow
from neurosym.simulation.scene import part_colours
from neurosym.support.arrays import Array

#: How far below a block's top the fingertips' middle grasps, at most.
DEPTH = 0.025
#: A block is let go so far above what carries it.
DROP = 0.0015
#: The hand must open so much wider than a block.
PLAY = 0.008


def build_with_panda(
    staging: Staging,
    *,
    rng: np.random.Generator,
    settings: BuildSettings | None = None,
    starts: Mapping[str, Array] | None = None,
    window: bool = False,
    watch: Callable[[Cell], None] | None = None,
) -> BuildReport:
    """Let the arm build what a plan builds.

    Args:
        staging: the plan in space: each step brings one box, upright, narrow enough for the hand. The table is the
            assembly's.
        rng: where the blocks lie at first, unless told, and what OMPL draws.
        settings: sizes, forces and tolerances.
        starts: name -> float64 (4, 4), where blocks lie at first, in metres, the arm's base at the origin.
        window: show it in PyBullet's own window, in real time; whoever looks may close it.
        watch: called with the cell in which the arm acts, after each time step: `CellFilm` takes pictures of it.

    Raises:
        InputError: a plan of another kind, or blocks that the hand cannot hold.
        NeurosymError: no screen for the window.
    """
    chosen = settings or BuildSettings()
    names = [motion.parts[0] for motion in staging.motions]
    sizes, places = _blocks(staging, chosen)
    lying = dict(starts or {}) or starting_places(names, sizes, rng)
    first = {n: places[n] for n in staging.present} | {n: lying[n] for n in names}
    friction = staging.assembly.friction
    with ExitStack() as stack:
        world = stack.enter_context(Cell(sizes, first, friction=friction, colours=part_colours(staging)))
        thought = stack.enter_context(Cell(sizes, first, friction=friction))
        if window:
            world.watchers.append(stack.enter_context(CellWindow(world)).tick)
        if watch is not None:
            world.watchers.append(watch)
        hand = Hand(world, thought, rng, chosen.force)
        builder = _Builder(hand, places, chosen)
        placements: list[Placement] = []
        for name in names:
            placements.append(builder.bring(name))
            if not placements[-1].ok:
                break
        hand.go_home()
        standing = tuple(n for n in names if builder.off(n)[0] and any(p.block == n for p in placements))
        found = {n: _in_assembly(world.pose(n), staging.assembly, chosen) for n in sizes}
        units = {n: size / chosen.metres for n, size in sizes.items()}
        return BuildReport(tuple(placements), len(names), found, standing, hand.seconds, units)


def starting_places(names: Sequence[str], sizes: Mapping[str, Array], rng: np.random.Generator) -> dict[str, Array]:
    """Blocks in rows to the left and the right of the arm, a little askew: name -> float64 (4, 4), metres.

    Raises InputError: more blocks than there is room for.
    """
    spots = [(x, side * y) for y in (0.20, 0.33) for x in (0.36, 0.49, 0.62) for side in (1, -1)]
    if len(names) > len(spots):
        raise InputError(f"Expected at most {len(spots)} blocks, which have room beside the arm; got {len(names)}.")
    starts = {}
    for name, spot in zip(names, (spots[i] for i in rng.permutation(len(names)))):
        yaw, shift = rng.uniform(-0.35, 0.35), rng.uniform(-0.01, 0.01, 2)
        turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        starts[name] = posed(turn, (spot[0] + shift[0], spot[1] + shift[1], sizes[name][2] / 2))
    return starts


def _blocks(staging: Staging, settings: BuildSettings) -> tuple[dict[str, Array], dict[str, Array]]:
    """Sizes and places of all blocks, in metres, the arm's base at the origin."""
    sizes, places = {}, {}
    ground = staging.assembly.ground
    for action, motion in zip(staging.plan, staging.motions):
        if not motion.arrives or len(motion.parts) != 1:
            raise InputError(f"Expected a plan whose steps bring one block each; {action!r} does not.")
    for part in staging.assembly.parts:
        if len(part.bodies) != 1 or not isinstance(part.bodies[0].shape, Box):
            raise InputError(f"Expected blocks that are one box each; {part.name!r} is none.")
        X = np.array(part.X_WP @ part.bodies[0].X_PB)
        if not np.isclose(X[2, 2], 1.0):
            raise InputError(f"Expected blocks that stand upright; {part.name!r} does not.")
        X[:3, 3] = (X[:3, 3] - [0, 0, ground]) * settings.metres + [*settings.site, 0.0]
        sizes[part.name] = np.asarray(part.bodies[0].shape.size) * settings.metres
        places[part.name] = X
        if sizes[part.name][:2].min() > WIDEST - PLAY:
            raise InputError(
                f"Expected blocks at most {100 * (WIDEST - PLAY):.1f} cm across, for the hand; {part.name!r} has "
                f"{100 * sizes[part.name][:2].min():.1f} cm. Make the unit (metres) smaller."
            )
    return sizes, places


def _in_assembly(X: Array, assembly: Assembly, settings: BuildSettings) -> Array:
    found = X.copy()
    found[:3, 3] = (X[:3, 3] - [*settings.site, 0.0]) / settings.metres + [0, 0, assembly.ground]
    return found


class _Builder:
    """Brings one block after another, by what the hand can do."""

    def __init__(self, hand: Hand, places: Mapping[str, Array], settings: BuildSettings) -> None:
        self.hand, self.world, self.places, self.settings = hand, hand.world, places, settings

    def bring(self, name: str) -> Placement:
        """Grasp a block, carry it, put it down; again, should the grasp fail."""
        reason = ""
        for attempt in range(1, self.settings.attempts + 1):
            try:
                self._bring(name)
            except Failed as failed:
                reason = str(failed)
                self.hand.open()
                self.hand.retreat()
                continue
            ok, error, tilt = self.off(name)
            reason = (
                "It stands in its place." if ok else f"It lies {1000 * error:.0f} mm and {tilt:.0f}° off its place."
            )
            return Placement(name, ok, reason, attempt, error, tilt)
        return Placement(name, False, reason, self.settings.attempts)

    def off(self, name: str) -> tuple[bool, float, float]:
        """Whether a block stands in its place; how far off it is (metres), and how far from upright (degrees)."""
        X, place = self.world.pose(name), self.places[name]
        error = float(np.linalg.norm(X[:3, 3] - place[:3, 3]))
        tilt = float(np.degrees(np.arccos(np.clip(X[2, 2], -1, 1))))
        return error <= self.settings.position_tolerance and tilt <= self.settings.tilt_tolerance, error, tilt

    def _bring(self, name: str) -> None:
        self.hand.see()
        X_WB, size = self.world.pose(name), self.world.sizes[name]
        if X_WB[2, 2] < np.cos(np.radians(self.settings.tilt_tolerance)):
            raise Failed(f"{name} does not lie upright on the table, so it cannot be grasped from above.")
        X_WT, down = self._grasp(name, X_WB, size)
        self.hand.open()
        self.hand.transit(down[0], None, f"over {name}")
        self.hand.follow(np.array(down), CAREFUL)
        self.hand.close(name, self._width_across(name, X_WT))
        up = self.hand.straight(self.world.arm.joints, X_WT, lifted(X_WT, APPROACH))
        if up is None:
            raise Failed(f"The arm cannot lift {name} straight up.")
        self.hand.follow(np.array(up), CAREFUL)
        if not self.world.pinched(name):
            raise Failed(f"{name} slipped out of the fingers when it was lifted.")
        load = Load(name, np.linalg.inv(self.world.arm.X_WT) @ self.world.pose(name))
        self.hand.see()
        over = self._place(name, load)
        self.hand.transit(over[0], load, f"with {name} over its place")
        if not self.world.pinched(name):
            raise Failed(f"{name} slipped out of the fingers on the way.")
        self.hand.follow(np.array(over), CAREFUL)
        self.hand.open()
        self.hand.retreat()
        self.hand.wait(60)

    def _width_across(self, name: str, X_WT: Array) -> float:
        """How wide a block is between the fingers of a hand at a pose."""
        R = self.world.pose(name)[:3, :3]
        return float(np.abs(R.T @ X_WT[:3, 1]) @ self.world.sizes[name])

    def _grasp(self, name: str, X_WB: Array, size: Array) -> tuple[Array, list[Array]]:
        """A tool pose, and joints on the straight way down to it, both sides of the block that are narrow enough."""
        height = X_WB[2, 3] + size[2] / 2 - min(DEPTH, size[2] / 2)
        yaw = float(np.arctan2(X_WB[1, 0], X_WB[0, 0]))
        # The fingers open along the tool's y: across the block's y, or turned by a quarter across its x.
        turns = [yaw + k * np.pi / 2 for k in (0, 2, 1, 3) if size[1 if k % 2 == 0 else 0] <= WIDEST - PLAY]
        turns.sort(key=lambda t: abs((t + np.pi / 2) % np.pi - np.pi / 2))
        poses = [from_above(np.array([X_WB[0, 3], X_WB[1, 3], height]), turn) for turn in turns]
        found = self.hand.way_down(poses, None, ignored=(name,))
        if found is None:
            raise Failed(f"There is no grasp of {name} from above that the arm reaches without touching something.")
        return found

    def _place(self, name: str, load: Load) -> list[Array]:
        """Joints on the straight way down to where the block is let go."""
        place = self.places[name].copy()
        place[2, 3] += DROP
        # A block may as well stand turned by a half, or by a quarter where that leaves its shape the same.
        size, poses = self.world.sizes[name], []
        for k in (0, 2, 1, 3) if np.isclose(size[0], size[1]) else (0, 2):
            turned = place.copy()
            turned[:3, :3] = place[:3, :3] @ Rotation.from_euler("z", k * np.pi / 2).as_matrix()
            poses.append(turned @ np.linalg.inv(load.X_TB))
        # On the last centimetres the block nears what carries it, and is to.
        found = self.hand.way_down(poses, load, unasked=3)
        if found is None:
            raise Failed(f"The arm does not reach the place of {name} from above without touching something.")
        return found[1]
