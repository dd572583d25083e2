"""Films as files: GIF, MP4, or a folder of frames, written whole or not at all."""

import importlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import InputError, MissingDependencyError
from neurosym.support.arrays import Pixels
from neurosym.support.files import replacing

#: Pictures a second, in every kind of film.
RATE = 15
#: Endings of films.
ENDINGS = (".gif", ".mp4")


def write_film(pictures: Iterator[Pixels], out: str | Path) -> Path:
    """Write pictures as a film, whole or not at all.

    Args:
        pictures: uint8 (height, width, 3) each, all of one size. An .mp4 repeats the last row or column where their
            number is odd: video has even ones.
        out: ends in .gif or .mp4; anything else is a folder, which is to be new, empty or made by this function, for
            frame-0000.png, frame-0001.png and so on.

    Raises:
        InputError: a folder with other things in it, a file where a folder is to be, an ending of another kind.
        MissingDependencyError: .mp4 without the extra `video`.
    """
    path = Path(out)
    return {".gif": _write_gif, ".mp4": _write_mp4}.get(path.suffix.lower(), _write_folder)(pictures, path)


def check_film(out: str | Path) -> None:
    """What `write_film` would refuse, refused before the first picture is drawn."""
    path = Path(out)
    if path.suffix.lower() == ".mp4":
        _ffmpeg()
    elif path.suffix.lower() != ".gif":
        _check_folder(path)
    if path.suffix.lower() in ENDINGS and path.is_dir():
        raise InputError(f"Expected a file to write; {path} is a folder.")


def _write_gif(pictures: Iterator[Pixels], path: Path) -> Path:
    from PIL import Image

    runs: list[Any] = []
    times: list[int] = []
    last: Pixels | None = None
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


def _write_mp4(pictures: Iterator[Pixels], path: Path) -> Path:
    ffmpeg = _ffmpeg()
    writer: Any = None
    with replacing(path) as temporary:
        try:
            for picture in pictures:
                height, width = picture.shape[:2]
                picture = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
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
    if path.name in ("", ".."):
        raise InputError(f"Expected a folder of a name of its own, which is replaced as a whole; got {str(path)!r}.")
    if (path.suffix or path.exists()) and not path.is_dir():
        raise InputError(f"Expected a film's name to end in {' or '.join(ENDINGS)}, or a folder; got {str(path)!r}.")
    strange = [p.name for p in path.iterdir() if not _is_frame(p.name)] if path.is_dir() else []
    if strange:
        raise InputError(f"Expected {path} to be new, or to hold frames only; it has {strange[0]!r}. Name another.")


def _is_frame(name: str) -> bool:
    return name.startswith("frame-") and name.endswith(".png")


def _write_folder(pictures: Iterator[Pixels], path: Path) -> Path:
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


def still(picture: Pixels, out: str | Path) -> Path:
    """Write one picture as PNG, whole or not at all. Raises InputError: a name that does not end in .png."""
    from PIL import Image

    path = Path(out)
    if path.suffix.lower() != ".png":
        raise InputError(f"Expected a picture's name to end in .png; got {str(out)!r}.")
    with replacing(path) as temporary:
        Image.fromarray(picture).save(temporary)
    return path
