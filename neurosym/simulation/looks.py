"""How pictures look: cameras, light, and what chance may vary."""

import colorsys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from neurosym.errors import UnknownNameError
from neurosym.support.arrays import Array


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera that looks at the middle of the assembly.

    Attributes:
        azimuth: degrees about the vertical; 0 looks from +x, 90 from +y.
        elevation: degrees above the horizontal; 90 looks straight down (with azimuth -90, +y is up in the picture).
        distance: from the middle, in halves of the assembly's largest extent.
        field_of_view: degrees, top to bottom.
        shift: of the picture, to the right and up, in halves of its side; what is seen keeps its perspective.
    """

    azimuth: float
    elevation: float
    distance: float = 8.0
    field_of_view: float = 21.0
    shift: tuple[float, float] = (0.0, 0.0)

    def view_matrix(self) -> list[float]:
        """World to camera, 16 numbers by columns (OpenGL's order)."""
        a, e = np.radians([self.azimuth, self.elevation])
        back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        up = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
        V = np.eye(4)
        V[:3, :3] = np.stack([np.cross(up, back), up, back])
        V[2, 3] = -self.distance
        return [float(x) for x in V.T.ravel()]

    def projection_matrix(self) -> list[float]:
        """Camera to clip space for square pictures, 16 numbers by columns."""
        near, far = 0.5, 2 * self.distance
        f = 1 / np.tan(np.radians(self.field_of_view) / 2)
        depth, shift = (far + near) / (near - far), 2 * far * near / (near - far)
        right, up = self.shift
        P = np.array([[f, 0, -right, 0], [0, f, -up, 0], [0, 0, depth, shift], [0, 0, -1, 0]])
        return [float(x) for x in P.T.ravel()]


#: Free space around what a film shows, as a share of the picture.
MARGIN = 0.06
#: The four views of the paper: from the top (+y up in the picture), then three sides, from +x, +y and -x, raised a
#: little. Together they see all but the bottom and the side towards -y.
VIEWS: tuple[Camera, ...] = (Camera(-90, 90), Camera(0, 15), Camera(90, 15), Camera(180, 15))


@dataclass(frozen=True, slots=True)
class Clutter:
    """What else a camera sees, and how carelessly it was set up; see `neurosym.simulation.clutter`. Drawn uniformly.

    Attributes:
        extent: share of the picture's side that the assembly takes, anywhere in the picture.
        chance: of each thing that lies about, of an arm, and of something in front.
        front: half sides of what is in front, in halves of the picture.
        gain: how bright the light is (drawn on a scale of logarithms).
        hue: share of the colour circle by which the light may turn all colours, either way.
    """

    extent: tuple[float, float] = (20 / 64, 50 / 64)
    chance: float = 0.5
    front: tuple[float, float] = (0.03, 0.1)
    gain: tuple[float, float] = (0.4, 1.6)
    hue: float = 0.12


@dataclass(frozen=True, slots=True)
class Style:
    """How pictures look, and how much chance varies that. Ranges are (least, most), drawn uniformly.

    Attributes:
        light_azimuth, light_elevation: degrees, where the light stands.
        ambient, diffuse, specular: coefficients of the renderer's (Phong) light model.
        shadow: chance that a picture has cast shadows (they take four times as long).
        azimuth, elevation: degrees that each camera may turn or rise, either way.
        distance: share that each camera may come nearer or go farther.
        hue: share of the colour circle that each part's colour may shift, either way.
        brightness: share that each part's colour may become darker or brighter.
        noise: standard deviation of pixel noise, in grey levels of 255.
        clutter: what else is seen; None: nothing, on white.
    """

    light_azimuth: tuple[float, float] = (40.0, 40.0)
    light_elevation: tuple[float, float] = (55.0, 55.0)
    ambient: tuple[float, float] = (0.65, 0.65)
    diffuse: tuple[float, float] = (0.35, 0.35)
    specular: tuple[float, float] = (0.0, 0.0)
    shadow: float = 0.0
    azimuth: float = 0.0
    elevation: float = 0.0
    distance: float = 0.0
    hue: float = 0.0
    brightness: float = 0.0
    noise: tuple[float, float] = (0.0, 0.0)
    clutter: Clutter | None = None

    @property
    def is_random(self) -> bool:
        """Whether two pictures of one assembly may differ."""
        return self != Style(
            (self.light_azimuth[0],) * 2,
            (self.light_elevation[0],) * 2,
            (self.ambient[0],) * 2,
            (self.diffuse[0],) * 2,
            (self.specular[0],) * 2,
            round(self.shadow),
        )


_VARIED = Style(
    light_azimuth=(0.0, 360.0),
    light_elevation=(25.0, 75.0),
    ambient=(0.45, 0.65),
    diffuse=(0.3, 0.55),
    specular=(0.0, 0.2),
    shadow=0.25,
    azimuth=5.0,
    elevation=4.0,
    distance=0.05,
    hue=0.025,
    brightness=0.15,
    noise=(0.0, 8.0),
)
STYLES: Mapping[str, Style] = {
    "clean": Style(),
    "varied": _VARIED,
    "cluttered": replace(_VARIED, distance=0.15, clutter=Clutter()),
}


def style_named(style: str | Style) -> Style:
    """A style by its name, or as it is. Raises UnknownNameError: no style of that name."""
    if isinstance(style, Style):
        return style
    if style not in STYLES:
        raise UnknownNameError("style of pictures", style, STYLES)
    return STYLES[style]


@dataclass(frozen=True, slots=True)
class Look:
    """One drawing of a style: everything that chance decides about one picture, but its noise."""

    cameras: tuple[Camera, ...]
    light: tuple[float, float, float]
    ambient: float
    diffuse: float
    specular: float
    shadow: bool
    colours: Array
    noise: float


def draw_look(style: Style, cameras: Sequence[Camera], colours: Array, rng: np.random.Generator) -> Look:
    """Draw a look; how many numbers are drawn depends on the counts of cameras and colours, (n_parts, 3), only."""
    azimuth, elevation = np.radians([rng.uniform(*style.light_azimuth), rng.uniform(*style.light_elevation)])
    direction = (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation))
    turned = tuple(
        replace(
            camera,
            azimuth=camera.azimuth + style.azimuth * rng.uniform(-1, 1),
            elevation=camera.elevation + style.elevation * rng.uniform(-1, 1),
            distance=camera.distance * (1 + style.distance * rng.uniform(-1, 1)),
        )
        for camera in cameras
    )
    ambient, diffuse, specular = (rng.uniform(*r) for r in (style.ambient, style.diffuse, style.specular))
    shadow, noise = bool(rng.random() < style.shadow), float(rng.uniform(*style.noise))
    shifted = []
    for rgb, hue, value in zip(colours, rng.uniform(-1, 1, len(colours)), rng.uniform(-1, 1, len(colours))):
        h, s, v = colorsys.rgb_to_hsv(*(float(x) for x in rgb))
        bright = min(1.0, v * (1 + style.brightness * value))
        shifted.append(colorsys.hsv_to_rgb((h + style.hue * hue) % 1.0, s, bright))
    x, y, z = (float(10 * x) for x in direction)
    return Look(turned, (x, y, z), ambient, diffuse, specular, shadow, np.array(shifted), noise)


def aimed(points: Array, camera: Camera, size: tuple[int, int]) -> tuple[Array, Array, tuple[float, float]]:
    """View and projection matrices, float64 (4, 4), and the near and far planes, so that all points show.

    `points`: float64 (n, 3), in the scene. `camera`: from which side, and how wide it sees; how far away it stands
    follows. `size`: width and height in pixels.
    """
    turn = np.array(camera.view_matrix()).reshape(4, 4).T[:3, :3]
    seen = points @ turn.T
    tall = np.tan(np.radians(camera.field_of_view) / 2) * (1 - 2 * MARGIN)
    wide = tall * size[0] / size[1]
    # Along each axis both sides are to fit: |x - shift| <= wide * (distance - depth), so the nearest pair decides.
    shift, distance = np.zeros(2), 0.0
    for axis, slope in ((0, wide), (1, tall)):
        right, left = (seen[:, axis] + slope * seen[:, 2]).max(), (-seen[:, axis] + slope * seen[:, 2]).max()
        shift[axis], distance = (right - left) / 2, max(distance, float(right + left) / (2 * slope))
    V = np.eye(4)
    V[:3, :3] = turn
    V[:3, 3] = -shift[0], -shift[1], -distance
    near, far = 0.05 * distance, 60.0
    f = 1 / np.tan(np.radians(camera.field_of_view) / 2)
    a, b = (far + near) / (near - far), 2 * far * near / (near - far)
    P = np.array([[f * size[1] / size[0], 0, 0, 0], [0, f, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])
    return V, P, (near, far)
