"""Pictures of towers: one view from the side, raised a little, in an easy and in a hard setting.

``easy``  plumb towers in the middle of the picture, one light, one camera, the blocks' own colours, no noise.
``hard``  an untidy tower that is sure to stand: it stands off the middle (by up to 0.4 of a block's edge along
          either axis), leans (each level up to 0.05 farther out) and its blocks lie askew (each up to 0.12 off).
          The light comes from anywhere above and may be dim or harsh, a picture in four has cast shadows, each
          block's hue and brightness shift, the camera turns, rises and comes nearer, and there is pixel noise.
``cluttered``  as hard, with table and wall of any colour, other things about, an arm, something in front, light from
          x 0.4 to x 1.6 that turns all hues by up to 0.12; six levels are 20 to 50 pixels high, anywhere.

What stands where is geometry: the offsets drawn here are those that stability is asked about. ``clean`` and
``varied``, the names that other families use, stand for easy and hard.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from domains.tower_blocks import COLOURS, ReferenceTower
from neurosym.errors import UnknownNameError
from neurosym.language.problem_family import Progress
from neurosym.simulation.looks import Camera, Clutter, Style
from neurosym.simulation.scene import Scene, scene_of
from neurosym.support.arrays import Array, Pixels

#: Other families' names for the settings.
ALIASES = {"clean": "easy", "varied": "hard"}
#: Apart from the streams that pictures are drawn from.
_OFFSET_STREAM = 0x0F_F5_E7


@dataclass(frozen=True, slots=True)
class Untidiness:
    """How untidily towers are built, in shares of a block's edge: each is the most, drawn uniformly.

    `shift`: of the whole tower, along x and along y, either way. `lean`: of each level against the one below, in one
    direction, the same for the whole tower. `jitter`: of each block by itself, in any direction.
    """

    shift: float = 0.0
    lean: float = 0.0
    jitter: float = 0.0


#: The one camera: from the side (+x), raised a little.
CAMERAS = (Camera(0, 12, distance=6.6),)
_HARD = Style(
    light_azimuth=(-90.0, 90.0),
    light_elevation=(20.0, 80.0),
    ambient=(0.35, 0.65),
    diffuse=(0.25, 0.6),
    specular=(0.0, 0.3),
    shadow=0.25,
    azimuth=8.0,
    elevation=5.0,
    distance=0.08,
    hue=0.05,
    brightness=0.3,
    noise=(5.0, 25.0),
)
#: What chance may vary in a setting besides the tower itself.
LOOKS = {
    "easy": Style(),
    "hard": _HARD,
    # All colours turn together there, so those of single blocks turn less.
    "cluttered": replace(_HARD, distance=0.15, hue=0.02, brightness=0.15, noise=(0.0, 10.0), clutter=Clutter()),
}
#: The upper levels' centre of mass lies at most 3 leans and 2 jitters off the lowest block's middle: 0.39 of its edge.
_UNTIDY = Untidiness(shift=0.4, lean=0.05, jitter=0.12)
SETTINGS = {"easy": Untidiness(), "hard": _UNTIDY, "cluttered": _UNTIDY}


def setting_named(name: str) -> str:
    """The setting that a name or an alias stands for. Raises UnknownNameError: no such setting."""
    setting = ALIASES.get(name, name)
    if setting not in SETTINGS:
        raise UnknownNameError("style of pictures", name, (*SETTINGS, *ALIASES))
    return setting


def picture_seed(seed: int, variant: str, number: int) -> int:
    """The seed of one picture, and of the offsets behind it."""
    return int(np.random.SeedSequence([seed, *variant.encode(), number]).generate_state(1)[0])


def draw_offsets(setting: str, n_levels: int, seed: int) -> Array:
    """Where a tower of cubes of edge one has its levels: float64 (n_levels, 2), off the plumb line along x and y."""
    most = SETTINGS[setting_named(setting)]
    rng = np.random.default_rng([_OFFSET_STREAM, seed])
    shift, lean = rng.uniform(-most.shift, most.shift, 2), most.lean * _in_disc(rng, 1)
    offsets: Array = shift + lean * np.arange(n_levels)[:, None] + most.jitter * _in_disc(rng, n_levels)
    return offsets


def _in_disc(rng: np.random.Generator, n: int) -> Array:
    """Points drawn uniformly from the unit disc, float64 (n, 2)."""
    radius, angle = np.sqrt(rng.random(n)), rng.uniform(0, 2 * np.pi, n)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def take_pictures(
    towers: Sequence[ReferenceTower],
    seeds: Sequence[int],
    *,
    style: str,
    workers: int = 1,
    progress: Progress | None = None,
) -> Pixels:
    """One picture a tower, uint8 (n, 1, 64, 64, 3), from disk where it was taken before."""
    from neurosym.simulation.render import cached_pictures

    jobs = [(_scene(tower), seed) for tower, seed in zip(towers, seeds, strict=True)]
    return cached_pictures(jobs, style=LOOKS[setting_named(style)], workers=workers, progress=progress, cameras=CAMERAS)


def take_picture(tower: ReferenceTower, style: str, rng: np.random.Generator) -> Pixels:
    """The picture of one tower, uint8 (1, 64, 64, 3)."""
    from neurosym.simulation.render import PictureStudio  # loads PyBullet

    with PictureStudio() as studio:
        return studio.views(_scene(tower), style=LOOKS[setting_named(style)], rng=rng, cameras=CAMERAS)


def _scene(tower: ReferenceTower) -> Scene:
    colours = {name: COLOURS[colour] for name, colour in zip(tower.assembly.names, tower.colours)}
    height = tower.frame or float(tower.assembly.bounds[1, 2])
    # The camera stays where it is: a low tower looks low.
    half = height / 2
    return scene_of(tower.assembly, colours, frame=np.array([[-half, -half, 0.0], [half, half, height]]))
