"""What `neurosym plan --out` writes of a problem and of a result."""

from collections.abc import Mapping
from typing import Any

from neurosym import __version__
from neurosym.language.problem import Problem
from neurosym.planning.result import PlanResult

#: Of the file. Raise it when a reader of the old one would go wrong.
SCHEMA = 1


def problem_part(domain: str, problem: Problem, number: int | None, options: Mapping[str, Any]) -> dict[str, Any]:
    """Which problem was solved: of which family, with which number and options."""
    named = {"schema": SCHEMA, "neurosym": __version__, "domain": domain, "problem": problem.name, "number": number}
    return {**named, "actions": list(problem.actions), "options": dict(options)}


def result_part(result: PlanResult) -> dict[str, Any]:
    """What came of it."""
    steps = zip(result.plan or (), result.motions or (None,) * len(result.plan or ()))
    return {
        "status": result.status.name,
        "sentence": result.status.sentence,
        "plan": None if result.plan is None else list(result.plan),
        "steps": [{"action": a, **(motion.to_json() if motion else {"how": None})} for a, motion in steps],
        "best_prefix": list(result.best_prefix),
        "side": result.side,
        "best_suffix": None if result.best_suffix is None else list(result.best_suffix),
        "refusals": [
            {"after": list(r.after), "action": r.action, "reason": r.reason, "because": list(r.because), "side": r.side}
            for r in result.blame
        ],
        **{name: getattr(result, name) for name in ("iterations", "expansions", "attempts", "seconds", "cost")},
        "fewest": result.fewest,
        "why_not": None if result.why_not is None else result.why_not.as_json(),
    }
