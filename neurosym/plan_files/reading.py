"""plan.json: what `neurosym plan --out` writes, read back as a problem and its plan."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from neurosym.errors import InputError
from neurosym.geometry.readers.references import referenced
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection
from neurosym.plan_files.writing import SCHEMA
from neurosym.planning.result import Status
from neurosym.registry import load_domain
from neurosym.support.documents import read_json

#: Figures of a search.
COUNTS = ("iterations", "attempts", "expansions", "seconds")


@dataclass(frozen=True, eq=False)
class SavedPlan:
    """A plan from a file.

    `problem`: made again from what the file says of it. `plan`: names of the actions, in order. `motions`: one a step;
    None where the file says none. `document`: the whole file.
    """

    problem: Problem
    plan: tuple[str, ...]
    motions: tuple[StepMotion | None, ...]
    document: Mapping[str, Any]

    def account(self) -> Account:
        """What the search did. Raises InputError: it is not what `neurosym plan --out` writes."""
        document = self.document
        try:
            return Account(
                Status[document["status"]],
                tuple(map(_rejection, document["refusals"])),
                {name: document[name] for name in COUNTS if isinstance(document[name], int | float)},
                tuple(map(str, (document.get("why_not") or {}).get("sentences", ()))),
                None if (end := document.get("best_suffix")) is None else tuple(map(str, end)),
            )
        except (AttributeError, KeyError, TypeError) as error:
            raise InputError(f"Expected a plan's file as `neurosym plan --out` writes it; got {error!r}.") from None


@dataclass(frozen=True, eq=False)
class Account:
    """What a plan's file tells of its search: `counts` are figures by name, `why_not` is in sentences.

    The longest end of an order that was verified from the goal is `best_suffix`; None: it was not searched from there.
    """

    status: Status
    refusals: tuple[Rejection, ...]
    counts: Mapping[str, float]
    why_not: tuple[str, ...]
    best_suffix: tuple[str, ...] | None = None


def _rejection(given: Mapping[str, Any]) -> Rejection:
    action, after, side = str(given["action"]), tuple(given["after"]), str(given.get("side", "full"))
    return Rejection(str(given["reason"]), tuple(given["because"]), action=action, after=after, side=side)


def read_search(path: str | Path) -> SavedPlan:
    """Read a plan or, of a search without one, the longest prefix that works, whose motions the file does not say."""
    document = read_document(Path(path))
    if document.get("plan") is not None:
        return read_plan(path)
    return SavedPlan(problem_of(document, path), tuple(map(str, document.get("best_prefix") or ())), (), document)


def read_plan(path: str | Path) -> SavedPlan:
    """Read a plan.

    Raises InputError: no such file, not what `neurosym plan --out` writes, of another schema, or without a plan in it.
    """
    document = read_document(Path(path))
    schema = document.get("schema")
    if schema != SCHEMA:
        raise InputError(f"Expected a plan of schema {SCHEMA} in {path}; got {schema!r}. Plan again with this version.")
    if document.get("plan") is None:
        raise InputError(
            f"Expected a plan in {path}; its search found none: {document.get('sentence', 'it does not say why')}"
        )
    steps = document.get("steps")
    if not isinstance(steps, list) or not all(isinstance(s, dict) and isinstance(s.get("action"), str) for s in steps):
        raise InputError(f'Expected "steps" in {path} as a list of {{"action": name, "how": ...}}; got {steps!r}.')
    problem = problem_of(document, path)
    for step in steps:
        if step["action"] not in problem.actions:
            raise InputError(
                f"Expected steps in {path} that are actions of {problem.name!r}; got {step['action']!r}, and there are "
                f"{', '.join(problem.actions)}."
            )
    if document["plan"] != [step["action"] for step in steps]:
        raise InputError(f'Expected the same actions, in the same order, in "plan" and "steps" of {path}; they differ.')
    moves = [step.get("how") is not None or "parts" in step for step in steps]
    motions = tuple(StepMotion.from_json(step) if move else None for step, move in zip(steps, moves))
    return SavedPlan(problem, tuple(s["action"] for s in steps), motions, document)


def problem_of(document: Mapping[str, Any], path: str | Path = "plan.json") -> Problem:
    """The problem that a plan's file was made for, made again.

    Raises InputError: the file does not say which problem it was.
    """
    domain, options = document.get("domain"), document.get("options") or {}
    if not isinstance(domain, str) or not isinstance(options, dict):
        raise InputError(f'Expected "domain" (a name) and "options" in {path}; got {domain!r} and {options!r}.')
    family = load_domain(domain)
    if document.get("assembly") is not None:
        options = {"stability": "limit", **options}  # which 0.1 did not write, for it knew of no other
    try:
        if document.get("cells") is not None:
            made: Problem = family.problem_from_cells(document["cells"], **options)  # type: ignore[attr-defined]
        elif document.get("assembly") is not None:
            made = family.problem(referenced(document["assembly"], Path(path)), name=document.get("problem"), **options)
        elif document.get("number") is not None:
            made = family.problem(document["number"], **options)
        else:
            raise InputError(
                f'Expected {path} to say which problem it solves ("number", "cells" or "assembly"); it says none.'
            )
    except (AttributeError, TypeError) as error:
        raise InputError(f"Expected {path} to name a problem of {domain!r}, with options that fit; {error}.") from None
    return made


def is_plan(path: Path) -> bool:
    """Whether a file is a plan's: JSON that names a domain and steps. Anything else is left to the loader."""
    if path.is_dir() or path.suffix.lower() != ".json":
        return False
    document = read_document(path)
    return "domain" in document and "steps" in document


def read_document(path: Path) -> dict[str, Any]:
    if not os.path.exists(path):
        raise InputError(f"Expected a plan at {path}; there is no such file. Write one with `neurosym plan ... --out`.")
    document = read_json(path, "JSON, as `neurosym plan --out` writes it,", InputError)
    if not isinstance(document, dict):
        raise InputError(f"Expected a JSON object, as `neurosym plan --out` writes it, in {path}; got something else.")
    return document
