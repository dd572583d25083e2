"""`neurosym list` and `neurosym doctor`: what there is, whether it is ours, and whether it works."""

import importlib.util
import platform
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import typer

from neurosym.commands.common import AsJson, console, print_json
from neurosym.commands.exit_codes import UNWELL
from neurosym.errors import MissingDependencyError

DISTRIBUTION = "neurosym-assembly"
#: The packages that make up this library; on PyPI other projects hold two of these names.
PACKAGES = ("neurosym", "domains", "planners", "learned_priors")
#: Entry points here name a function without arguments, which returns one line or raises.
CHECKS = "neurosym.checks"


@dataclass(frozen=True)
class Finding:
    """One line of the report: `remedy` says what to do when `ok` is False."""

    topic: str
    name: str
    ok: bool
    said: str
    remedy: str = ""


def names(as_json: AsJson = False) -> None:
    """List domains, planners with what they claim, priors, and the domains that there are trained weights for."""
    from neurosym.planning.catalogue import summary, weights_beside
    from neurosym.registry import DOMAINS, PRIORS, domain_names, load_domain, load_planner, planner_names

    domains = {name: load_domain(name).reference for name in domain_names()}
    planners = {name: asdict(load_planner(name).traits) for name in planner_names()}
    declared = sorted(metadata.entry_points(group=PRIORS))
    priors = {entry.name: summary(entry) for entry in declared}
    weights: dict[str, list[str]] = {}
    for entry in declared:
        # Several packages may have weights for one domain, and one package many priors.
        for domain, named in weights_beside(entry).items():
            weights[domain] = sorted({*weights.get(domain, ()), *named})
    if as_json:
        print_json({"domains": domains, "planners": planners, "priors": priors, "weights": weights})
        return
    out = console()
    sections: dict[str, dict[str, str]] = {
        "domains": {entry.name: summary(entry) for entry in sorted(metadata.entry_points(group=DOMAINS))},
        "planners": {name: _claims(traits) for name, traits in planners.items()},
        "priors": priors,
        "trained weights": {domain: ", ".join(names) for domain, names in weights.items()},
    }
    width = max(len(name) for entries in sections.values() for name in entries)
    for title, entries in sections.items():
        out.print(f"[bold]{title}[/bold]")
        for name, text in entries.items():
            out.print(f"  {name:<{width}}  {text}", soft_wrap=True)


def _claims(traits: dict[str, Any]) -> str:
    return ", ".join(name.replace("_", " ") for name, claimed in traits.items() if claimed) or "claims nothing"


def doctor(as_json: AsJson = False) -> None:
    """Say what is installed, who claims our package names, and whether FCL, PyBullet, OMPL and torch really work."""
    out = console()
    findings = []
    for finding in examine():
        findings.append(finding)
        if not as_json:
            mark = "[green]ok[/green]" if finding.ok else "[bold red]no[/bold red]"
            out.print(f"{mark}  {finding.topic:<10} {finding.name:<18} ", end="")
            out.print(finding.said, markup=False, soft_wrap=True)
            if not finding.ok:
                out.print(f"      -> {finding.remedy}", markup=False, soft_wrap=True)
    well = all(finding.ok for finding in findings)
    if as_json:
        print_json({"ok": well, "findings": [asdict(finding) for finding in findings]})
    else:
        out.print("All is well." if well else "Something is amiss; what to do stands under each line that says no.")
    raise typer.Exit(0 if well else UNWELL)


def examine() -> Iterator[Finding]:
    """All findings, one by one: versions, names, and whether each heavy dependency answers a question it must know."""
    version = platform.python_version()
    system = f"{version} on {platform.system()} {platform.machine()}"
    yield Finding("installed", "python", sys.version_info >= (3, 11), system, "Use Python 3.11 or later (best 3.11).")
    yield from _versions()
    claimed = metadata.packages_distributions()
    for package in PACKAGES:
        yield claim(package, claimed)
    for name, check in _checks().items():
        yield works(name, check)


def claim(package: str, claimed: Mapping[str, list[str]]) -> Finding:
    """Whether a package is ours alone: no other distribution claims its name, and it is imported from our folder."""
    others = sorted({d for d in claimed.get(package, []) if re.sub(r"[-_.]+", "-", d).lower() != DISTRIBUTION})
    if others:
        remedy = f"Uninstall it (pip uninstall {' '.join(others)}), then install {DISTRIBUTION} again."
        return Finding("names", package, False, f"also claimed by {', '.join(others)}", remedy)
    spec = importlib.util.find_spec(package)
    home = Path(__file__).resolve().parent.parent.parent
    origin = None if spec is None or spec.origin is None else Path(spec.origin).resolve().parent.parent
    if origin != home:
        where = "not found" if origin is None else f"imported from {origin}, while neurosym is in {home}"
        remedy = f"Remove or rename what hides it, or install {DISTRIBUTION} again."
        return Finding("names", package, False, where, remedy)
    return Finding("names", package, True, "ours alone")


def works(name: str, check: Callable[[], str]) -> Finding:
    """Call a check; whatever it raises is the finding."""
    try:
        return Finding("works", name, True, check())
    except MissingDependencyError as error:  # an extra that nobody asked for
        return Finding("works", name, True, str(error))
    except Exception as error:  # whatever a broken installation raises is what the user needs to read
        remedy = f"Install it again: pip install --force-reinstall {_PACKAGE.get(name, name)}"
        return Finding("works", name, False, f"{type(error).__name__}: {error}", remedy)


def fcl_works() -> str:
    """Two unit boxes whose answers are known: overlapping by a tenth, touching nothing, a unit apart."""
    import numpy as np

    from neurosym.geometry.contact.collision import box_object, box_patch, collide, distance
    from neurosym.geometry.rigid_motions import shifted

    unit = np.ones(3)
    still, near, far = (box_object(unit, shifted(np.array([x, 0, 0]))) for x in (0.0, 0.9, 2.0))
    if not collide(still, near) or collide(still, far):
        raise RuntimeError("boxes that overlap, or that do not, are told apart wrongly")
    patch = box_patch(still, near)
    if patch is None or not np.allclose(patch[1], [1, 0, 0]):
        raise RuntimeError(f"the normal between two boxes along x came as {None if patch is None else patch[1]}")
    apart = distance(still, far)
    if not np.isclose(apart, 1.0, atol=1e-6):
        raise RuntimeError(f"two boxes one unit apart are {apart:g} apart")
    return "boxes overlap, touch and keep their distance as they should"


def pybullet_works() -> str:
    """A ball that falls for a tenth of a second, against g t^2 / 2."""
    from neurosym.simulation.client import Client

    with Client() as client:
        p = client.p
        p.setGravity(0, 0, -9.81)
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        body = p.createMultiBody(1.0, ball, basePosition=[0, 0, 10])
        for _ in range(24):
            p.stepSimulation()
        fallen = 10 - p.getBasePositionAndOrientation(body)[0][2]
    if not 0.04 < fallen < 0.06:
        raise RuntimeError(f"a ball fell {fallen:g} m in 0.1 s; expected about 0.05")
    return f"a ball falls {100 * fallen:.1f} cm in 0.1 s"


def _ompl() -> str:
    from neurosym.geometry.paths.trees import ompl_works

    return ompl_works()


_PACKAGE = {"FCL": "python-fcl", "PyBullet": "pybullet", "OMPL": "ompl"}


def _checks() -> dict[str, Callable[[], str]]:
    """Ours, and those that other packages declare: torch is the business of the learned priors."""
    checks: dict[str, Callable[[], str]] = {"FCL": fcl_works, "PyBullet": pybullet_works, "OMPL": _ompl}
    for entry in metadata.entry_points(group=CHECKS):
        checks[entry.name] = lambda entry=entry: str(entry.load()())  # type: ignore[misc]
    return checks


def _versions() -> Iterator[Finding]:
    try:
        own = metadata.version(DISTRIBUTION)
        needed = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        remedy = "Install it: pip install -e . in the repository."
        yield Finding("installed", DISTRIBUTION, False, "imported, but not installed", remedy)
        return
    yield Finding("installed", DISTRIBUTION, True, own)
    for requirement in needed:
        extra = "extra ==" in requirement
        if extra and not re.search("['\"]all['\"]", requirement):
            continue
        match = re.match(r"[A-Za-z0-9._-]+", requirement)
        name = match.group() if match else requirement
        try:
            yield Finding("installed", name, True, metadata.version(name))
        except metadata.PackageNotFoundError:
            if not extra:
                yield Finding("installed", name, False, "missing", f'pip install "{requirement}"')
