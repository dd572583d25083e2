"""A plan as moving pictures, drawn by PyBullet's renderer, without a window. `film_files` writes them."""

from collections.abc import Callable, Iterator

import numpy as np

from neurosym.geometry.staging import Staging
from neurosym.simulation.captions import captioned
from neurosym.simulation.film_files import RATE
from neurosym.simulation.filming import FilmSet
from neurosym.simulation.looks import Camera
from neurosym.simulation.scene import part_colours
from neurosym.simulation.storyboard import best_camera, company, describe, first_part, room_for
from neurosym.support.arrays import Pixels

#: Called with (done, total) pictures.
Progress = Callable[[int, int], None]
#: Seconds that a step's motion takes, and that the result is held before the next, in a film of few steps.
STEP_SECONDS, HOLD_SECONDS = 1.0, 0.2
#: Steps go faster where all of them would take longer than so many seconds, but none takes less than so many.
LONGEST, SHORTEST_STEP = 30.0, 0.5
#: Seconds that the first and the last picture stand.
END_SECONDS = 0.8
#: How much shows of what is not there yet, or no more, in a picture that would be empty (0..1).
_PALE = 0.12


def frames(
    staging: Staging,
    *,
    title: str = "",
    size: tuple[int, int] = (640, 480),
    camera: Camera | None = None,
    progress: Progress | None = None,
) -> Iterator[Pixels]:
    """Pictures of a plan, one after another, `RATE` a second: uint8 (height and a line of words, width, 3).

    What leaves moves along its path and then is gone; what arrives comes in along it. What made way goes back. Parts
    that are held are set off by a thick line. A group that left together is taken apart by itself.

    `title`: stands below the first and the last picture. `size`: width and height in pixels, without the words below.
    `camera`: from which side; None takes `best_camera`. `progress`: called with (done, total).
    """
    colours, count = part_colours(staging), len(staging.motions)
    moving, held, ends = pace(count)
    total, done = 2 * ends + count * (moving + held), 0

    def report(shots: int) -> None:
        nonlocal done
        done += shots
        if progress is not None:
            progress(done, total)

    with FilmSet(
        staging.assembly,
        colours,
        room_for(staging),
        size=size,
        camera=camera or best_camera(staging),
        tops=staging.tops,
    ) as film:
        first = captioned(_whole(film, staging, 0), title, note=f"{count} steps", progress=0.0)
        yield from [first] * ends
        report(ends)
        for i, motion in enumerate(staging.motions):
            around, words, note = company(staging, i), describe(staging, i), f"{i + 1}/{count}"
            part = first_part(staging, i)
            colour = None if part is None else colours[part]
            for k in range(1, moving + 1):
                shot = film.picture({*around, *motion.parts}, motion.at(_eased(k / moving)), marked=motion.held)
                yield captioned(shot, words, note=note, colour=colour, progress=(i + k / moving) / count)
                report(1)
            after = set(around) | set(motion.parts) if motion.arrives else set(around) - set(motion.parts)
            for k in range(1, held + 1):
                if k == 1 or motion.making_way:
                    # What made way for a part that leaves goes back the way it came; for one that arrives it is back.
                    where = {} if motion.arrives else motion.out(1 - _eased(k / held))
                    shot = film.picture(after, {name: X for name, X in where.items() if name in motion.making_way})
                    shot = captioned(shot, words, note=note, colour=colour, progress=(i + 1) / count)
                yield shot
                report(1)
        end = "complete" if staging.motions and staging.motions[-1].arrives else "taken apart"
        words = f"{title}, {end}" if title else end
        last = captioned(_whole(film, staging, count), words, note=f"{count} steps", progress=1.0)
        yield from [last] * ends
        report(ends)


def pace(count: int) -> tuple[int, int, int]:
    """How many pictures the motion of each of `count` steps has, the rest after it, and each end of the film."""
    step = STEP_SECONDS + HOLD_SECONDS
    share = max(min(1.0, LONGEST / (step * max(1, count))), SHORTEST_STEP / step)
    moving, held, ends = (round(RATE * s) for s in (share * STEP_SECONDS, share * HOLD_SECONDS, END_SECONDS))
    return moving, max(1, held), ends


def _whole(film: FilmSet, staging: Staging, step: int) -> Pixels:
    """What is there before a step; where nothing is, all that ever is, pale."""
    there = staging.there(step)
    if there:
        return film.picture(there)
    pale = 255 - (255 - film.picture(staging.assembly.names).astype(np.float64)) * _PALE
    return np.asarray(np.rint(pale), dtype=np.uint8)


def _eased(share: float) -> float:
    """Slow at both ends."""
    return share * share * (3 - 2 * share)
