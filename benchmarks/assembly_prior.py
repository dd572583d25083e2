"""What `graph-sinkhorn` is worth on kinds of structures that it was not trained on, and on real ones.

For each kind of `domains.structures` a network is trained on all the others, and the test structures of that kind are
planned by backtracking, from the full side, with no prior, `outermost-first` and that network. Then the bundled weights
on ../shared/data, and where a simulation answers. Arguments: the page to write (out/assembly-prior.md), and a file of
`neurosym demos assembly` to learn from instead of making it anew. Two processes, one thread each; CPU seconds.
A run that was ended goes on where it was (out/*.jsonl).
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import neurosym as ns
from domains.structures import KINDS
from learned_priors.assembly_graph import read_graph
from learned_priors.graph_prior import GraphSinkhorn
from learned_priors.graph_training import Example
from neurosym.experiments.engines import run_tasks
from neurosym.experiments.journal import Journal, key_of
from neurosym.experiments.reporting import markdown_table, provenance
from neurosym.language.labelled_problems import LabelledProblems
from neurosym.pipeline import open_oracle, search_and_check
from neurosym.support.files import write_text

DATA = Path(__file__).parents[2] / "shared" / "data"
REAL = (("arch", 1), ("bricks", 0), ("wall", 0))
PRIORS = ("none", "outermost-first", "graph-sinkhorn")
FAMILY, BUNDLED = ns.load_domain("assembly"), GraphSinkhorn()
#: Something that is asked for each of some arguments.
Task = Callable[..., dict[str, Any]]
ATTEMPTS = 2_000
WORKERS = 2
SIMULATED = 3  # structures of a kind; those without fixed or held parts

PAGE = """# A prior for assemblies never seen

`graph-sinkhorn` reads an assembly's geometry, no picture: sizes, heights, contacts with the forces in which the
whole rests, and what blocks what along which direction. It is a Sinkhorn network over that graph: names and numbers of
parts do not count, and any number of parts and directions will do. It learned from structures made at random of eleven
kinds (`domains.structures`), in which gravity and holding decide the order as often as parts in the way do. An order
counts there by its probability under `outermost-first`, so the network keeps to that heuristic where it works.

## Kinds left out of training

Refusals (mean a structure) before backtracking has a plan, from the full side. Each kind's network was trained on the
other ten, 60 structures each. Hard structures are those where `outermost-first` is refused at all; the share is of its
refusals. The last column is of `graph-sinkhorn` on the others.

{kinds}

Each training took {training:.0f} s of the CPU.

## Real structures, with the bundled weights

These learned from all eleven kinds. A wall of {parts} bricks is read in {seconds:.2f} s. Refusals and seconds (of the
CPU, for reading and search) are means a structure.

{real}

## Where an attempt costs a simulation

The first {simulated} test structures of each kind without fixed and held parts, oracle physics, bundled weights.
Refusals and seconds are means a structure.

{physics}

{versions}
"""


def refusals(problems: Iterable[ns.Problem], learned: ns.Prior, *, oracle: str = "geometry") -> dict[str, Any]:
    """By prior: refusals of each problem, and CPU seconds for reading and search, all problems together."""
    counted: dict[str, Any] = {name: ([], 0.0, 0) for name in PRIORS}
    for problem in problems:
        with open_oracle(problem, oracle) as search:
            for name in PRIORS:
                start = time.process_time()
                prior = None if name == "none" else learned if name == "graph-sinkhorn" else ns.load_prior(name)
                scores = None if prior is None else prior.scores([problem])[0]
                [result] = search_and_check(
                    problem,
                    search,
                    ns.load_planner("backtracking"),
                    scores,
                    budget=ns.Budget(attempts=ATTEMPTS),
                    rng=np.random.default_rng(0),
                    oracle=oracle,
                )
                counts, seconds, unsolved = counted[name]
                unsolved += result.plan is None
                spent = seconds + time.process_time() - start
                counted[name] = [*counts, result.iterations], spent, unsolved
    return counted


def left_out(kind: str, made: Sequence[tuple[str, Example]]) -> dict[str, Any]:
    """Refusals on the test structures of a kind after training on the others, and CPU seconds of the training."""
    start = time.process_time()
    prior = GraphSinkhorn().fit(example for own, example in made if own != kind)
    seconds = time.process_time() - start
    counted = refusals(map(FAMILY.problem, FAMILY.numbers("test", kind=kind)), prior)
    return {**counted, "training": seconds}


def of_data(name: str, held: int) -> dict[str, Any]:
    return refusals([FAMILY.problem(DATA / name, held=held)], BUNDLED)


def simulated(kind: str) -> dict[str, Any]:
    problems = map(FAMILY.problem, FAMILY.numbers("test", kind=kind))
    return refusals([p for p in problems if p.simulation is not None][:SIMULATED], BUNDLED, oracle="physics")


def reading(length: int = 25, courses: int = 20) -> tuple[int, float]:
    """How many bricks a wall has, and CPU seconds for reading it with nothing known of it."""
    bricks = {f"{z}, {k}": [(2 * k + z % 2 + x, 0, z) for x in (0, 1)] for z in range(courses) for k in range(length)}
    problem = FAMILY.problem(ns.Assembly.from_cells(bricks))
    BUNDLED.scores([FAMILY.problem(0)])
    start = time.process_time()
    BUNDLED.scores([problem])
    return len(bricks), time.process_time() - start


def table_of_kinds(by_kind: dict[str, dict[str, Any]]) -> list[str]:
    lines, pooled = [["kind left out", "hard of 20", *PRIORS, "share", "others"]], {name: [] for name in PRIORS}
    for kind, counted in by_kind.items():
        own = {name: np.array(counted[name][0]) for name in PRIORS}
        lines.append(_line(kind, own))
        pooled = {name: [*pooled[name], *own[name].tolist()] for name in PRIORS}
    lines.append(_line("all", {name: np.array(values) for name, values in pooled.items()}))
    return markdown_table(lines)


def _line(kind: str, own: dict[str, Any]) -> list[str]:
    hard = own["outermost-first"] > 0
    means = {name: float(own[name][hard].mean()) if hard.any() else None for name in PRIORS}
    share = f"{means['graph-sinkhorn'] / means['outermost-first']:.2f}" if hard.any() else ""
    easy = f"{own['graph-sinkhorn'][~hard].mean():.2f}" if (~hard).any() else ""
    return [kind, str(int(hard.sum())), *("" if m is None else f"{m:.2f}" for m in means.values()), share, easy]


def table_of_totals(rows: Sequence[tuple[str, dict[str, Any]]]) -> list[str]:
    columns = [f"{name}: {what}" for name in PRIORS for what in ("refusals", "s")]
    lines = [["structure", *columns]]
    for name, counted in rows:
        cells = []
        for counts, seconds, unsolved in (counted[name] for name in PRIORS):
            mark = " (no plan)" if unsolved else ""
            cells += [f"{np.mean(counts):.2f}{mark}", f"{seconds / max(len(counts), 1):.2f}"]
        lines.append([name, *cells])
    return markdown_table(lines)


def answers(task: Task, journal: Journal, tasks: Sequence[Sequence[Any]]) -> list[dict[str, Any]]:
    """What a task gives for each of its arguments, asked or from the journal of an earlier run that was ended."""
    keys = {key_of([task.__name__, *given]): given for given in tasks}
    missing = [key for key in keys if key not in journal]
    for key, answer in run_tasks(lambda key: task(*keys[key]), missing, workers=WORKERS):
        journal.add({key: answer})
        print(*keys[key], "done", file=sys.stderr, flush=True)
    return [journal[key] for key in keys]


def main() -> None:
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "out/assembly-prior.md")
    journal, known = Journal(Path("out") / f"{out.stem}.jsonl"), Path(sys.argv[2]) if len(sys.argv) > 2 else None
    start = time.process_time()
    given = LabelledProblems.load(known, FAMILY) if known else FAMILY.labelled_problems("train")
    made = [(problem.name.rpartition(" ")[0], Example(read_graph(problem), shares)) for problem, shares in given]
    print(f"{len(made)} examples in {time.process_time() - start:.0f} s", file=sys.stderr, flush=True)

    def left_out_of_these(kind: str) -> dict[str, Any]:
        return left_out(kind, made)

    kinds = dict(zip(KINDS, answers(left_out_of_these, journal, [[kind] for kind in KINDS])))
    training = np.mean([answer["training"] for answer in kinds.values()])
    there = [pair for pair in REAL if (DATA / pair[0]).is_dir()]
    real = [(f"{name}, {held} held", own) for (name, held), own in zip(there, answers(of_data, journal, there))]
    simulations = dict(zip(KINDS, answers(simulated, journal, [[kind] for kind in KINDS])))
    parts, seconds = reading()
    text = PAGE.format(
        kinds="\n".join(table_of_kinds(kinds)),
        training=training,
        real="\n".join(table_of_totals([*real, ("samples", refusals(FAMILY.problems("all"), BUNDLED))])),
        parts=parts,
        seconds=seconds,
        simulated=SIMULATED,
        physics="\n".join(table_of_totals([(k, own) for k, own in simulations.items() if own["none"][0]])),
        versions=f"neurosym {ns.__version__}, `python benchmarks/assembly_prior.py`; {provenance()}",
    )
    write_text(out, text)


if __name__ == "__main__":
    main()
