"""What else a camera sees: table and wall with textures, things that lie about, an arm, something in front, any light.

Things and arm are drawn by the same renderer; table and wall are put in where it drew nothing, by rays from the camera.
"""

import colorsys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from neurosym.simulation.looks import Camera, Clutter
from neurosym.simulation.scene import Scene
from neurosym.support.arrays import Array, Numbers, Pixels

#: Half edges of what lies about, and of the arm's links, in the cameras' frame. Always the same bodies: see `views`.
_LYING = ((0.17, 0.17, 0.17), (0.3, 0.12, 0.1), (0.12, 0.12, 0.35))
_ARM = ((0.2, 0.07, 0.1), (0.08, 0.08, 0.6), (0.1, 0.1, 0.9))
#: Where what is not in the picture is kept: under the table and far away.
_AWAY = np.array([0.0, 0.0, -500.0])
#: A cube of half edge one: corners, and triangles that face outward.
_CUBE = (
    np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)]),
    np.array(
        [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]
    ).reshape(-1, 3),
)
#: Colour of what is somewhere, RGB in 0..1: places (n, 2) -> (n, 3).
_Texture = Callable[[Array], Array]


@dataclass(frozen=True)
class Surroundings:
    """One drawing of a `Clutter`: what chance decides about the pictures of one assembly.

    `ground`, `edge`: height of the table and how far it reaches, in the cameras' frame. `bars`: for each camera what is
    in front, rows, columns and sides as shares of the picture, with its colour.
    """

    cameras: tuple[Camera, ...]
    scene: Scene
    ground: float
    edge: float
    table: _Texture
    wall: _Texture
    gain: float
    hue: float
    bars: tuple[tuple[Array, Array] | None, ...]

    def finished(self, picture: Pixels, owners: Numbers, i: int) -> Pixels:
        """Picture number `i`, uint8 (h, w, 3), with what is behind and in front, in its light; owners -1: nothing."""
        camera, size = self.cameras[i], picture.shape[:2]
        y, x = (np.indices(size) + 0.5) * 2 / np.array(size)[:, None, None] - 1
        slope = np.tan(np.radians(camera.field_of_view) / 2)
        V = np.array(camera.view_matrix()).reshape(4, 4).T
        rays = np.stack([(x - camera.shift[0]) * slope, (-y - camera.shift[1]) * slope, -np.ones(size)], axis=-1)
        rays = rays[owners < 0] @ V[:3, :3]
        eye = -V[:3, :3].T @ V[:3, 3]
        with np.errstate(divide="ignore"):
            places = eye[:2] + rays[:, :2] * ((self.ground - eye[2]) / np.minimum(rays[:, 2], -1e-9))[:, None]
        on_table = (rays[:, 2] < 0) & (np.linalg.norm(places, axis=1) < self.edge)
        turned = np.stack([np.arctan2(rays[:, 1], rays[:, 0]), rays[:, 2] / np.linalg.norm(rays, axis=1)], axis=1)
        behind = np.where(on_table[:, None], self.table(np.where(on_table[:, None], places, 0)), self.wall(8 * turned))
        whole = picture.astype(np.float64)
        whole[owners < 0] = 255 * behind
        if (bar := self.bars[i]) is not None:
            (row, column, high, wide), colour = bar
            whole[(np.abs(-y - row) < high) & (np.abs(x - column) < wide)] = 255 * colour
        lit = np.clip(np.rint(whole * self.gain), 0, 255).astype(np.uint8)
        return turned_hues(lit, self.hue)


def draw_surroundings(
    clutter: Clutter, scene: Scene, cameras: Sequence[Camera], rng: np.random.Generator
) -> Surroundings:
    """Draw what else is seen. Each camera sees the assembly at a size and a place of its own, all in one light."""
    moved = []
    for camera in cameras:
        extent = rng.uniform(*clutter.extent)
        V = np.array(camera.view_matrix()).reshape(4, 4).T
        seen = scene.position @ V[:3, :3].T + V[:3, 3]
        # A low tower looks low: at least the frame, from -1 to 1, is in the picture.
        slope = max(1 / camera.distance, np.abs(seen[:, :2] / seen[:, 2:]).max())
        wide = 2 * np.degrees(np.arctan(slope / extent))
        x, y = (1 - extent) * rng.uniform(-1, 1, 2)
        moved.append(replace(camera, field_of_view=float(wide), shift=(float(x), float(y))))
    ground, bars = float(scene.position[:, 2].min()), []
    whole = _with_things(scene, ground, clutter, rng)
    for _ in cameras:
        place, sides = rng.uniform(-0.9, 0.9, 2), rng.uniform(*clutter.front, 2)
        bars.append((np.concatenate([place, sides]), rng.random(3)) if rng.random() < clutter.chance else None)
    return Surroundings(
        cameras=tuple(moved),
        scene=whole,
        ground=ground,
        edge=rng.uniform(2.5, 8.0),
        table=_texture(rng),
        wall=_texture(rng),
        gain=float(np.exp(rng.uniform(*np.log(clutter.gain)))),
        hue=clutter.hue * rng.uniform(-1, 1),
        bars=tuple(bars),
    )


def turned_hues(pictures: Pixels, share: float) -> Pixels:
    """The same pictures, uint8 (..., 3), with all hues turned by a share of the colour circle."""
    from PIL import Image

    flat = pictures.reshape(-1, pictures.shape[-2], 3)
    hsv = np.array(Image.fromarray(flat).convert("HSV"))
    hsv[..., 0] += np.uint8(round(256 * share) % 256)  # wraps, as hues do
    return np.array(Image.fromarray(hsv, "HSV").convert("RGB")).reshape(pictures.shape)


def _with_things(scene: Scene, ground: float, clutter: Clutter, rng: np.random.Generator) -> Scene:
    """The scene with things on the table and an arm, some of them away; they stand beside the views, not in them."""
    half = np.array(_LYING + _ARM)
    places, turns = np.tile(_AWAY, (len(half), 1)), np.tile([0.0, 0, 0, 1], (len(half), 1))
    flat = np.abs(scene.position[:, :2]) + np.abs(scene.half[:, :2]).max() * 0.5
    reach = float(np.linalg.norm(flat, axis=1).max())
    for i in range(len(_LYING)):
        corner = np.radians(45 + 90 * rng.integers(4) + rng.uniform(-20, 20))
        away, turn, there = rng.uniform(1.2 * reach + 0.25, 1.2 * reach + 1.5), rng.uniform(0, np.pi), rng.random()
        if there < clutter.chance:
            places[i] = away * np.cos(corner), away * np.sin(corner), ground + half[i, 2]
            turns[i] = Rotation.from_euler("z", turn).as_quat()
    corner, height, lean = np.radians(45 + 90 * rng.integers(4)) + rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 1.2), 0.6
    out = np.array([np.cos(corner), np.sin(corner), 0.0])
    hand = out * (1.1 * reach + 0.25) + np.array([0, 0, height])
    lean += rng.uniform(-0.3, 0.3)
    if rng.random() < clutter.chance:
        along = np.cos(lean) * np.array([0.0, 0, 1]) + np.sin(lean) * out
        elbow, down = hand + 1.2 * along, 0.7 * out - 0.7 * np.array([0.0, 0, 1])
        links = ((hand, out), (hand + 0.6 * along, along), (elbow + 0.9 * down, down))
        for i, (place, axis) in enumerate(links, len(_LYING)):
            places[i], turns[i] = place, Rotation.align_vectors([axis], [[0.0, 0, 1]])[0].as_quat()
    n_items, n_parts = len(scene.position), len(scene.colours)
    colours = np.array([colorsys.hsv_to_rgb(*c) for c in rng.random((len(half), 3))])
    return Scene(
        np.concatenate([scene.position, places]),
        np.concatenate([scene.turn, turns]),
        np.concatenate([scene.half, half]),
        {**scene.meshes, **{n_items + i: _CUBE for i in range(len(half))}},
        np.concatenate([scene.owner, n_parts + np.arange(len(half))]),
        np.concatenate([scene.colours, colours]),
    )


def _texture(rng: np.random.Generator) -> _Texture:
    """Plain, checks, stripes or blots of two colours, dark or light."""
    kind, width, angle, phase = rng.integers(4), rng.uniform(0.3, 1.5), rng.uniform(0, np.pi), rng.uniform(0, 7, 4)
    hue, saturation = rng.random(2), 0.7 * rng.random(2) ** 2
    value = rng.random() + np.array([0.0, 0.3]) * rng.uniform(-1, 1)
    one, other = (np.array(colorsys.hsv_to_rgb(*c)) for c in zip(hue, saturation, np.clip(value, 0, 1), strict=True))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) / width

    def texture(places: Array) -> Array:
        x, y = (places @ turn.T).T
        if kind == 3:
            share = 0.5 + 0.25 * (
                np.sin(4 * x + phase[0]) * np.sin(3 * y + phase[1]) + np.sin(7 * x - 5 * y + phase[2])
            )
        else:
            share = ((np.floor(x) + (np.floor(y) if kind == 1 else 0)) % 2) * (kind > 0)
        mixed: Array = one + share[:, None] * (other - one)
        return mixed

    return texture
