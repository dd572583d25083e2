"""`neurosym list` and `neurosym doctor`: what there is, and whether it works."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import typer

from neurosym.commands.common import AsJson, console, print_json
from neurosym.commands.exit_codes import UNWELL


def names(as_json: AsJson = False) -> None:
    """List domains, planners with what they claim, priors, and the domains that there are trained weights for."""
    from importlib.metadata import entry_points

    from neurosym.planning.catalogue import summary, weights_beside
    from neurosym.registry import DOMAINS, PRIORS, domain_names, load_domain, load_planner, planner_names

    domains = {name: load_domain(name).reference for name in domain_names()}
    planners = {name: asdict(load_planner(name).traits) for name in planner_names()}
    declared = sorted(entry_points(group=PRIORS))
    priors = {entry.name: summary(entry) for entry in declared}
    weights: dict[str, list[str]] = {}
    for entry in declared:
        # Several packages may have weights for one domain, and one package many priors.
        for domain, found in weights_beside(entry).items():
            weights[domain] = sorted({*weights.get(domain, ()), *found})
    if as_json:
        print_json({"domains": domains, "planners": planners, "priors": priors, "weights": weights})
        return
    out = console()
    sections: dict[str, dict[str, str]] = {
        "domains": {entry.name: summary(entry) for entry in sorted(entry_points(group=DOMAINS))},
        "planners": {name: _claims(traits) for name, traits in planners.items()},
        "priors": priors,
        "trained weights": {domain: ", ".join(names) for domain, names in weights.items()},
    }
    width = max(len(name) for entries in sections.values() for name in entries)
    for title, entries in sections.items():
        out.print(f"[bold]{title}[/bold]")
        for name, said in entries.items():
            out.print(f"  {name:<{width}}  {said}", soft_wrap=True)


def _claims(traits: dict[str, Any]) -> str:
    return ", ".join(name.replace("_", " ") for name, claimed in traits.items() if claimed) or "claims nothing"


def doctor(as_json: AsJson = False) -> None:
    """Say what is installed, who claims our package names, and whether FCL, PyBullet, OMPL and torch really work."""
    from neurosym.commands.doctor import examine

    out = console()
    found = []
    for finding in examine():
        found.append(finding)
        if not as_json:
            mark = "[green]ok[/green]" if finding.ok else "[bold red]no[/bold red]"
            out.print(f"{mark}  {finding.topic:<10} {finding.name:<18} ", end="")
            out.print(finding.said, markup=False, soft_wrap=True)
            if not finding.ok:
                out.print(f"      -> {finding.remedy}", markup=False, soft_wrap=True)
    well = all(finding.ok for finding in found)
    if as_json:
        print_json({"ok": well, "findings": [asdict(finding) for finding in found]})
    else:
        out.print("All is well." if well else "Something is amiss; what to do stands under each line that says no.")
    raise typer.Exit(0 if well else UNWELL)
