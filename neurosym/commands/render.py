"""`neurosym render`: a plan as a film, and an exploded view, without a screen."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from neurosym.commands import common
from neurosym.errors import InputError

if TYPE_CHECKING:
    from neurosym.geometry.staging import Staging

#: Width and height of pictures, in pixels, unless told otherwise.
FILM_SIZE, STILL_SIZE = (640, 480), (960, 720)


def render(
    what: Annotated[
        str,
        typer.Argument(
            metavar="PATH|DOMAIN", help="A plan.json, an assembly of yours, or a family; --plan says which problem."
        ),
    ],
    *,
    plan: Annotated[Path | None, typer.Option(metavar="PLAN", help="What `neurosym plan --out` wrote.")] = None,
    number: Annotated[
        int | None, typer.Option("--problem", metavar="N", help="Number of the problem, where there is no plan.")
    ] = None,
    option: common.FamilyOptions = None,
    collapse: common.CollapseRule = None,
    files: common.FileOptions,
    out: Annotated[
        Path | None, typer.Option(metavar="FILM", help="A film of the plan: .gif, .mp4 (extra `video`), or a folder.")
    ] = None,
    exploded: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png", callback=common.to_write, help="The parts pulled apart, as the plan does: a picture."
        ),
    ] = None,
    spread: Annotated[float, typer.Option(min=0.0, help="How far apart in the exploded view.")] = 1.0,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="In pixels; default 640x480, and 960x720 exploded.")
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="AZIMUTH,ELEVATION",
            help="Side of the camera, degrees; 0,0 looks from +x. Default: the front right, from above, about -58,24.",
        ),
    ] = None,
) -> None:
    """Draw a plan as a film, part by part along its path, or the parts pulled apart."""
    from neurosym.plan_files.reading import is_plan
    from neurosym.simulation.animation import frames
    from neurosym.simulation.exploded import exploded_view
    from neurosym.simulation.film_files import check_film, still, write_film
    from neurosym.simulation.filming import DEFAULT_CAMERA
    from neurosym.simulation.looks import Camera

    if plan is None and is_plan(Path(what)):
        plan = Path(what)
    if out is None and exploded is None:
        raise InputError("Expected --out FILM, --exploded FILE.png, or both.")
    if out is not None and plan is None:
        raise InputError(f"Expected --plan with --out {out}: a film shows a plan (`neurosym plan ... --out`).")
    if out is not None:
        check_film(out)
    if exploded is not None and exploded.suffix.lower() != ".png":
        raise InputError(f"Expected --exploded with a PNG, as FILE.png; got {str(exploded)!r}.")
    camera = None
    if view is not None:
        pattern = r"(-?\d+(?:\.\d+)?),(-?\d+(?:\.\d+)?)"
        azimuth, elevation = _two(view, pattern, "--from AZIMUTH,ELEVATION, as -58,24")
        camera = Camera(azimuth, elevation, field_of_view=DEFAULT_CAMERA.field_of_view)
    film_size, still_size = FILM_SIZE, STILL_SIZE
    if size is not None:
        width, height = _two(size, r"(\d{2,4})x(\d{2,4})", "--size WxH, as 640x480")
        film_size = still_size = (int(width), int(height))
    staging, title = _staging(what, plan, number, files, {"collapse": collapse, **common.family_options(option)})
    if exploded is not None:
        picture = exploded_view(staging, spread=spread, size=still_size, camera=camera, title=title)
        print(f"{still(picture, exploded)}: {title}, {len(staging.shown)} parts pulled apart.")
    if out is not None:
        with common.progress_bar("pictures") as progress:
            film = frames(staging, title=title, size=film_size, camera=camera, progress=progress)
            write_film(film, out)
        print(f"{out}: {title}, {len(staging.motions)} steps.")


def _staging(
    what: str, plan: Path | None, number: int | None, files: common.FileOptions, options: dict[str, Any]
) -> tuple[Staging, str]:
    from neurosym.plan_files.reading import read_plan
    from neurosym.planning.staging import stage

    given = {key: value for key, value in options.items() if value is not None}
    if plan is None:
        return _at_rest(what, number, files, given)
    if number is not None or given or files.reading().as_json():
        raise InputError("Expected either --plan, which names its problem, or --problem with its options; got both.")
    saved = read_plan(plan)
    domain = saved.document["domain"]
    if what not in (domain, str(plan)) and not Path(what).exists():
        raise InputError(f"Expected what {plan} was made for, {domain!r} or the path of its assembly; got {what!r}.")
    return stage(saved.problem, saved.plan, saved.motions), saved.problem.name


def _at_rest(what: str, number: int | None, files: common.FileOptions, options: dict[str, Any]) -> tuple[Staging, str]:
    """The assembly alone."""
    from neurosym.geometry.assembly import Assembly
    from neurosym.geometry.staging import Staging
    from neurosym.registry import domain_names, load_domain

    if what not in domain_names() and Path(what).exists():
        if number is not None or options:
            raise InputError(f"Expected --problem and options of a family with the name of one; {what} is a path.")
        world, name = common.load_assembly(Path(what), files), Path(what).resolve().name
    else:
        files.reading().refuse(f"{what!r} is a problem family")
        problem = load_domain(what).problem(number or 0, **options)
        world, name = getattr(problem.world, "assembly", problem.world), problem.name
        if not isinstance(world, Assembly):
            raise InputError(f"Expected a problem of rigid parts; {name!r} has none to draw.")
    return Staging(world, world.names, ()), name


def _two(text: str, pattern: str, expected: str) -> tuple[float, float]:
    match = re.fullmatch(pattern, text.replace(" ", ""))
    if match is None:
        raise InputError(f"Expected {expected}; got {text!r}.")
    return float(match[1]), float(match[2])
