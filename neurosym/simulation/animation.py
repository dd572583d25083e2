"""A plan as moving pictures: GIF, MP4, or a folder of frames, from PyBullet's renderer, without a window."""

from __future__ import annotations

import importlib
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError, MissingDependencyError
from neurosym.files import replacing
from neurosym.motions import Motion, Staging
from neurosym.simulation.captions import captioned
from neurosym.simulation.filming import DEFAULT_CAMERA, FilmSet
from neurosym.simulation.looks import Camera
from neurosym.simulation.scene import part_colours

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
#: Called with (done, total) pictures.
Progress = Callable[[int, int], None]

#: Pictures a second, in every kind of film.
RATE = 15
#: Seconds that a step's motion takes, and that the result is held before the next.
STEP_SECONDS, HOLD_SECONDS = 1.0, 0.2
#: Seconds that the first and the last picture stand.
END_SECONDS = 0.8
#: Endings of films.
ENDINGS = (".gif", ".mp4")


def frames(
    staging: Staging,
    *,
    title: str = "",
    size: tuple[int, int] = (640, 480),
    camera: Camera = DEFAULT_CAMERA,
    progress: Progress | None = None,
) -> Iterator[Picture]:
    """Pictures of a plan, one after another, `RATE` a second.

    What leaves moves along its path and then is gone; what arrives comes in along it.

    Args:
        staging: the plan in space.
        title: stands below the first and the last picture.
        size: width and height in pixels, without the words below.
        camera: from which side.
        progress: called with (done, total).

    Yields:
        uint8 (height and a line of words, width, 3).
    """
    colours, count = part_colours(staging), len(staging.motions)
    moving, held, ends = (round(RATE * s) for s in (STEP_SECONDS, HOLD_SECONDS, END_SECONDS))
    total, done = 2 * ends + count * (moving + held), 0

    def report(shots: int) -> None:
        nonlocal done
        done += shots
        if progress is not None:
            progress(done, total)

    with FilmSet(staging.assembly, colours, room_for(staging), size=size, camera=camera) as film:
        first = captioned(film.picture(staging.there(0)), title, note=f"{count} steps", progress=0.0)
        yield from [first] * ends
        report(ends)
        for i, motion in enumerate(staging.motions):
            there = staging.there(i)
            words, note = describe(motion), f"{i + 1}/{count}"
            for k in range(1, moving + 1):
                where = motion.where(_eased(k / moving))
                shot = film.picture({*there, *motion.parts}, where)
                share = (i + k / moving) / count
                yield captioned(shot, words, note=note, colour=colours[motion.parts[0]], progress=share)
                report(1)
            rest = film.picture(staging.there(i + 1))
            shot = captioned(rest, words, note=note, colour=colours[motion.parts[0]], progress=(i + 1) / count)
            yield from [shot] * held
            report(held)
        end = "complete" if staging.motions and staging.motions[-1].arrives else "taken apart"
        last = captioned(film.picture(staging.there(count)), f"{title}, {end}", note=f"{count} steps", progress=1.0)
        yield from [last] * ends
        report(ends)


def write_film(pictures: Iterator[Picture], out: str | Path) -> Path:
    """Write pictures as a film, whole or not at all.

    Args:
        pictures: uint8 (height, width, 3) each, all of one size, heights and widths even.
        out: ends in .gif or .mp4; anything else is a folder, which is to be new, empty or made by this function, for
            frame-0000.png, frame-0001.png and so on.

    Raises:
        InputError: a folder with other things in it, a file where a folder is to be, an ending of another kind.
        MissingDependencyError: .mp4 without the extra `video`.
    """
    path = Path(out)
    if path.suffix.lower() == ".gif":
        return _write_gif(pictures, path)
    if path.suffix.lower() == ".mp4":
        return _write_mp4(pictures, path)
    return _write_folder(pictures, path)


def check_film(out: str | Path) -> None:
    """What `write_film` would refuse, refused before the first picture is drawn."""
    path = Path(out)
    if path.suffix.lower() == ".mp4":
        _ffmpeg()
    elif path.suffix.lower() != ".gif":
        _check_folder(path)
    if path.suffix.lower() in ENDINGS and path.is_dir():
        raise InputError(f"Expected a file to write; {path} is a folder.")


def describe(motion: Motion) -> str:
    """'remove L, along +z'."""
    from neurosym.geometry.directions import in_words

    verb = "place" if motion.arrives else "remove"
    others = f" with {', '.join(motion.parts[1:])}" if len(motion.parts) > 1 else ""
    name = motion.action if motion.action == motion.parts[0] else f"{motion.action}: {motion.parts[0]}"
    if len(motion.path) > 2:
        way = "along a path"
    else:
        shift = motion.path[1, :3, 3] * (-1 if motion.arrives else 1)
        way = f"along {in_words((shift / np.linalg.norm(shift)).tolist())}" if shift.any() else "turning"
    held = f", {', '.join(motion.held)} held" if motion.held else ""
    return f"{verb} {name}{others}, {way}{held}"


def room_for(staging: Staging) -> Array:
    """float64 (n, 3), in the world: bounds of all parts, resting and at places along their paths."""
    assembly, found = staging.assembly, []
    corners = {}
    for number, name in enumerate(assembly.names):
        bounds = assembly.body_bounds[assembly.owners == number]
        low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
        corners[name] = np.array(np.meshgrid(*zip(low, high))).reshape(3, -1).T
        found.append(corners[name])
    for motion in staging.motions:
        for share in np.linspace(0, 1, 2 * len(motion.path) + 1):
            found += [corners[name] @ X[:3, :3].T + X[:3, 3] for name, X in motion.where(float(share)).items()]
    return np.concatenate(found)


def _eased(share: float) -> float:
    """Slow at both ends."""
    return share * share * (3 - 2 * share)


def _write_gif(pictures: Iterator[Picture], path: Path) -> Path:
    from PIL import Image

    runs: list[Any] = []
    times: list[int] = []
    last: Picture | None = None
    for picture in pictures:
        if last is not None and np.array_equal(picture, last):
            times[-1] += 1
            continue
        last = picture
        # One palette a picture; without dithering plain surfaces stay plain, and files small.
        runs.append(Image.fromarray(picture).quantize(128, dither=Image.Dither.NONE))
        times.append(1)
    if not runs:
        raise InputError("Expected at least one picture for a film; got none.")
    # GIF counts hundredths of a second.
    durations = [10 * max(2, round(100 * n / RATE)) for n in times]
    with replacing(path) as temporary:
        runs[0].save(temporary, format="GIF", save_all=True, append_images=runs[1:], duration=durations, loop=0)
    return path


def _write_mp4(pictures: Iterator[Picture], path: Path) -> Path:
    ffmpeg = _ffmpeg()
    writer: Any = None
    with replacing(path) as temporary:
        try:
            for picture in pictures:
                if writer is None:
                    height, width = picture.shape[:2]
                    # yuv420p is what every player reads; sizes are even, so nothing needs to be scaled.
                    options = {"fps": RATE, "quality": 7, "macro_block_size": 2, "ffmpeg_log_level": "error"}
                    writer = ffmpeg.write_frames(str(temporary), (width, height), **options)
                    writer.send(None)
                writer.send(np.ascontiguousarray(picture))
        finally:
            if writer is not None:
                writer.close()
        if writer is None:
            raise InputError("Expected at least one picture for a film; got none.")
    return path


def _ffmpeg() -> Any:
    try:
        module = importlib.import_module("imageio_ffmpeg")
        module.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise MissingDependencyError(
            "Expected ffmpeg for an .mp4; it is not there. Install the extra (pip install 'neurosym-assembly[video]'), "
            "or write a .gif or a folder of frames."
        ) from error
    return module


def _check_folder(path: Path) -> None:
    if (path.suffix or path.exists()) and not path.is_dir():
        raise InputError(f"Expected a film's name to end in {' or '.join(ENDINGS)}, or a folder; got {str(path)!r}.")
    strange = [p.name for p in path.iterdir() if not _is_frame(p.name)] if path.is_dir() else []
    if strange:
        raise InputError(f"Expected {path} to be new, or to hold frames only; it has {strange[0]!r}. Name another.")


def _is_frame(name: str) -> bool:
    return name.startswith("frame-") and name.endswith(".png")


def _write_folder(pictures: Iterator[Picture], path: Path) -> Path:
    from PIL import Image

    _check_folder(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}-{secrets.token_hex(4)}")
    temporary.mkdir()
    try:
        for i, picture in enumerate(pictures):
            Image.fromarray(picture).save(temporary / f"frame-{i:04d}.png")
        if path.exists():
            shutil.rmtree(path)
        os.replace(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return path


def still(picture: Picture, out: str | Path) -> Path:
    """Write one picture as PNG, whole or not at all.

    Raises:
        InputError: a name that does not end in .png.
    """
    from PIL import Image

    path = Path(out)
    if path.suffix.lower() != ".png":
        raise InputError(f"Expected a picture's name to end in .png; got {str(out)!r}.")
    with replacing(path) as temporary:
        Image.fromarray(picture).save(temporary)
    return path


