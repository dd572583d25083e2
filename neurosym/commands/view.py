"""`neurosym view`: a local page that shows an assembly, a plan and its search, or a file that needs no server."""

from __future__ import annotations

import threading
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from neurosym.commands.common import FileOptions, RemovalOptions, SearchOptions, family_options, say
from neurosym.errors import InputError

if TYPE_CHECKING:
    from neurosym.viewer.exhibit import Exhibit
    from neurosym.viewer.sources import Source


def view(
    what: Annotated[
        str,
        typer.Argument(
            metavar="PATH|DOMAIN",
            help="A plan.json, an assembly of yours as for `plan`, or a problem family (`neurosym list` names them).",
        ),
    ],
    *,
    number: Annotated[
        int | None, typer.Option("--problem", metavar="N", help="Number of the domain's problem; default 0.")
    ] = None,
    planner: Annotated[
        str | None, typer.Option(metavar="P", help="Default backtracking; with --target fewest.")
    ] = None,
    search: SearchOptions,
    files: FileOptions,
    removal: RemovalOptions,
    host: Annotated[str, typer.Option(help="Where to listen; 0.0.0.0 lets the whole network in.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Where to listen; the next free one if taken, 0 any.")
    ] = 8080,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    export: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Write a page that plays without a server, and exit.")
    ] = None,
) -> None:
    """Look at a plan: step by step in 3D, with what the prior believed and where the search went."""
    from neurosym.viewer import need_viser

    need_viser()
    from neurosym.viewer.exhibit import Exhibit, Query
    from neurosym.viewer.export import check_name, export_page
    from neurosym.viewer.planning import Planning, check_query
    from neurosym.viewer.server import check_host
    from neurosym.viewer.sources import open_source

    if export is None:
        check_host(host)
    else:
        check_name(export)
    options = {name: value for name, value in search.of_problem().items() if value is not None}
    options |= removal.given() | family_options(search.option)
    prior = None if search.prior == "none" else search.prior
    limits = (search.seconds, search.attempts)
    planner = planner or ("fewest" if removal.target else "backtracking")
    query = Query(what, number, options, planner, prior, search.oracle, search.seed, *limits)
    check_query(query)
    source = open_source(query, search.own_cells(), files.reading())
    if search.prior is None and source.saved is None:
        source = replace(source, query=replace(source.query, prior=source.usual_prior))
    exhibit = None if source.saved is None else Exhibit.saved(source.saved)
    if export is None:
        _serve(source, exhibit, host=host, port=port, browser=browser)
        return
    if exhibit is None:
        planning = Planning(lambda: source.problem, source.query)
        planning.wait()
        if planning.exhibit is None:
            raise InputError(planning.message or "")
        exhibit = planning.exhibit
    export_page(exhibit, export)
    print(f"{export}: {exhibit.problem.name}, {len(exhibit.search.steps)} steps. {exhibit.search.sentence}")
    raise typer.Exit(exhibit.search.status.exit_code)


def _serve(source: Source, exhibit: Exhibit | None, *, host: str, port: int, browser: bool) -> None:
    """Show the page until the keyboard ends it."""
    from neurosym.viewer.page import Page
    from neurosym.viewer.server import LOOPBACKS, LocalServer

    server = LocalServer(host, port, "neurosym")
    page = Page(server, source.query, source.given)
    try:
        if exhibit is None:
            page.plan(source.query, source.problem)
        else:
            page.show(exhibit)
        name = "localhost" if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
        address = f"http://{name}:{server.get_port()}"
        print(f"{address} shows {source.problem.name}. Ctrl+C ends it.", flush=True)
        if host not in LOOPBACKS:
            say(f"Note: {host} is not this machine alone; who reaches the page can plan with it.")
        if browser:
            webbrowser.open(address)
        threading.Event().wait()
    except KeyboardInterrupt:
        print("Ended.")
    finally:
        page.close()
        server.stop()
