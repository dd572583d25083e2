"""What `neurosym view` is pointed at: a problem family, the file of a plan, or a user's own assembly."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial, wraps
from pathlib import Path
from typing import Any

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.readers.references import Reading
from neurosym.language.problem import Problem
from neurosym.plan_files.reading import SavedPlan, is_plan, problem_of, read_search
from neurosym.registry import domain_names, load_domain
from neurosym.viewer.exhibit import Maker, Query
from neurosym.viewer.planning import problem_maker

#: The family of assemblies that are files, and the prior that such a one is given where nobody names one.
ASSEMBLY, UNTRAINED = "assembly", "outermost-first"
#: What a puzzle of the user's own is called on the page.
PUZZLE = "your puzzle"


@dataclass(frozen=True, eq=False)
class Source:
    """What there is to look at: a problem, and its plan where a file holds one (`saved`), with what is asked at first.

    `given` makes, of options, what bears no number in a family, by its name on the page; `usual_prior` is that with
    which it is planned where nobody names one.
    """

    query: Query
    problem: Problem
    given: Mapping[str, Maker]
    saved: SavedPlan | None = None
    usual_prior: str | None = None


def open_source(query: Query, cells: Mapping[str, Any] | None = None, reading: Reading | None = None) -> Source:
    """Open the domain, or the file at the path, that `query.domain` names; a path wins where no problem is named.

    The domain may get cells, {name: [(x, y, z), ...]}, for a puzzle of the user's own; an assembly its reading. Raises
    UnknownNameError: neither a domain nor a path; InputError: a file that is neither a plan nor an assembly; a reading
    with anything but an assembly.
    """
    path, reading = Path(query.domain), reading or Reading()
    if path.exists() and query.number is None and cells is None:
        if not is_plan(path):
            return _assembly_at(path, query, reading)
        reading.refuse("a plan's file says how its assembly is read")
        return _plan_at(path, query)
    if query.domain not in domain_names() and path.exists():
        what = "a number (--problem)" if cells is None else "cells"
        raise InputError(f"Expected no {what} with {query.domain!r}: it is a file or a folder, not a problem family.")
    reading.refuse(f"{query.domain!r} is a problem family")
    if query.domain not in domain_names():
        hint = f"There is no file or folder {query.domain!r} either."
        raise UnknownNameError("domain", query.domain, domain_names(), hint=hint)
    if cells is not None:
        return _puzzle(query, cells)
    query = replace(query, number=query.number or 0)
    return Source(query, problem_maker(query, {})(), {})


def _puzzle(query: Query, cells: Mapping[str, Any]) -> Source:
    family = load_domain(query.domain)
    make = getattr(family, "problem_from_cells", None)
    if make is None or query.number is not None:
        number = "" if query.number is None else f" and the number {query.number}"
        raise InputError(
            f"Expected cells with a domain of polycube puzzles (soma), without a number; got {query.domain!r}{number}."
        )
    given: dict[str, Maker] = {PUZZLE: partial(make, cells)}
    query = replace(query, domain=PUZZLE)
    return Source(query, problem_maker(query, given)(), given)


def _plan_at(path: Path, query: Query) -> Source:
    saved = read_search(path)
    document = saved.document
    options = document.get("options") or {}
    settings = {key: document[key] for key in ("planner", "prior", "oracle", "seed") if document.get(key) is not None}
    domain, number, given = document["domain"], document.get("number"), {}
    if number is None:
        domain = _name_for(path)

        @wraps(load_domain(document["domain"]).problem)  # whose options it takes
        def make(**options: Any) -> Problem:
            return problem_of({**document, "options": options}, path)

        given = {domain: make}
    query = Query(domain, number, options, seconds=query.seconds, attempts=query.attempts, **settings)
    return Source(query, saved.problem, given, saved)


def _assembly_at(path: Path, query: Query, reading: Reading) -> Source:
    family = load_domain(ASSEMBLY)

    @wraps(family.problem)  # whose options it takes
    def make(**options: Any) -> Problem:
        return family.problem(reading.load(path), **{"name": path.resolve().name, **options})

    query = replace(query, domain=_name_for(path))
    given: dict[str, Maker] = {query.domain: make}
    return Source(query, problem_maker(query, given)(), given, usual_prior=UNTRAINED)


def _name_for(path: Path) -> str:
    """What a file is called on the page: unlike any domain."""
    name = path.resolve().name
    return f"{name} (a file)" if name in domain_names() else name
