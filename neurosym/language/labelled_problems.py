"""Problems about assemblies with shares of their orders: what priors learn from that read geometry, not pictures.

Stored as ``.npz`` without pickle: assemblies and options as JSON, one table a problem.
"""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import DemonstrationError, NeurosymError
from neurosym.geometry.assembly import Assembly
from neurosym.language.problem import Problem
from neurosym.support.files import replacing

if TYPE_CHECKING:
    from neurosym.language.problem_family import ProblemFamily

SCHEMA = 1


@dataclass(frozen=True, eq=False)
class LabelledProblems:
    """Problems, and of each the share of its orders that have each action at each step.

    Attributes:
        problems: M of them, each about an `Assembly`.
        marginals: M tables, float64 (N, N), N the problem's actions; rows sum to one.
    """

    problems: tuple[Problem, ...]
    marginals: tuple[NDArray[np.float64], ...]

    def __post_init__(self) -> None:
        if len(self.problems) != len(self.marginals):
            raise DemonstrationError(
                f"Expected a table of shares a problem; got {len(self.problems)} and {len(self.marginals)}."
            )
        for problem, table in zip(self.problems, self.marginals):
            n = len(problem.actions)
            if table.shape != (n, n) or not np.isfinite(table).all() or (np.abs(table.sum(axis=1) - 1) > 1e-6).any():
                raise DemonstrationError(
                    f"Expected shares ({n}, {n}) for {problem.name!r}, rows that sum to one; got shape {table.shape}."
                )

    def __len__(self) -> int:
        return len(self.problems)

    def summary(self) -> str:
        """What they are, in words."""
        counts = [len(problem.actions) for problem in self.problems]
        return f"{len(self)} assemblies of {min(counts, default=0)} to {max(counts, default=0)} actions"

    def save(self, path: str | Path) -> Path:
        """Write ``.npz``, whole or not at all."""
        path = Path(path)
        if path.suffix != ".npz":
            raise DemonstrationError(f"Expected a file name that ends in .npz; got {path.name!r}.")
        documents = [json.dumps({"name": p.name, "options": dict(p.details)}) for p in self.problems]
        with tempfile.TemporaryDirectory() as folder:
            at = Path(folder) / "assembly.json"
            assemblies = [_written(problem.world, at) for problem in self.problems]
        tables = {f"marginals-{k}": table for k, table in enumerate(self.marginals)}
        with replacing(path) as temporary:
            np.savez_compressed(
                temporary,
                labelled=np.array(SCHEMA),
                problems=np.array(documents, dtype=np.str_),
                assemblies=np.array(assemblies, dtype=np.str_),
                **tables,  # type: ignore[arg-type]
            )
        return path

    @classmethod
    def load(cls, path: str | Path, family: ProblemFamily) -> LabelledProblems:
        """What `save` wrote, as problems of a family. Raises DemonstrationError: the file is something else."""
        try:
            with np.load(path, allow_pickle=False) as file:
                if "labelled" not in file.files or file["labelled"].item() != SCHEMA:
                    raise DemonstrationError(
                        f"Expected labelled problems of schema {SCHEMA} in {path}; `neurosym demos` writes them."
                    )
                pairs = zip(file["problems"].tolist(), file["assemblies"].tolist())
                problems = tuple(_read(family, document, assembly) for document, assembly in pairs)
                tables = tuple(file[f"marginals-{k}"] for k in range(len(problems)))
        except NeurosymError:
            raise
        except (OSError, ValueError, KeyError, TypeError, AttributeError, zipfile.BadZipFile, EOFError) as error:
            raise DemonstrationError(f"Expected labelled problems, an .npz file, in {path}; got: {error}.") from None
        return cls(problems, tables)

    def __iter__(self) -> Iterator[tuple[Problem, NDArray[np.float64]]]:
        return iter(zip(self.problems, self.marginals))


def _written(assembly: Assembly, at: Path) -> str:
    assembly.save(at)
    return at.read_text(encoding="utf-8")


def _read(family: ProblemFamily, document: str, assembly: str) -> Problem:
    given = json.loads(document)
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder) / "assembly.json"
        at.write_text(assembly, encoding="utf-8")
        return problem_again(family, Assembly.load(at), given["name"], given["options"])


def problem_again(family: ProblemFamily, assembly: Assembly, name: str, details: Mapping[str, Any]) -> Problem:
    """The problem about an assembly that a family once made with these details."""
    ground = False if details.get("ground") is None else details["ground"]
    return family.problem(assembly, name=name, **{**details, "ground": ground})
