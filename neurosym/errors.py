"""The exception tree.

    NeurosymError                   whatever this library refuses, in one catch
    ├── DefinitionError             a domain or a problem contradicts itself
    ├── InputError                  an argument, a file or a picture is not what was asked for
    │   ├── UnknownNameError        a name that nothing is registered under; lists those there are
    │   ├── AssemblyError           parts that overlap, float, fall apart or are empty
    │   │   └── FaultyPartsError    all that is wrong with the parts of a file, part by part (neurosym.geometry.notes)
    │   ├── DemonstrationError      demonstrations whose arrays do not fit together
    │   └── CheckpointError         a weights file of another make, or damaged
    ├── ContractError               a plug-in broke its promise (a planner's plan fails its replay)
    └── MissingDependencyError      an optional package is absent; says how to get it

Every message says what was expected, what came, and what to do. That there is no plan is never an
exception: it is a `PlanResult`.
"""

import difflib
from collections.abc import Iterable
from typing import Self

#: Characters of a message: of a longer one the middle is left out.
LONGEST = 1_000


class NeurosymError(Exception):
    """Base of everything this library raises on purpose."""

    def __init__(self, message: str = "") -> None:
        if len(message) > LONGEST:
            start, end = 2 * LONGEST // 3, LONGEST // 4
            message = f"{message[:start]} ... {len(message) - start - end:,} more characters ... {message[-end:]}"
        super().__init__(message)


class DefinitionError(NeurosymError):
    """A domain, an action or a problem is ill-defined; the message names the place."""


class InputError(NeurosymError, ValueError):
    """An argument, a file or an array is not what was asked for."""


class UnknownNameError(InputError, LookupError):
    """A name that nothing is registered under.

    The message lists the valid names and suggests the nearest, so that call sites stay one line.
    """

    def __init__(self, kind: str, name: object, known: Iterable[str], *, hint: str = "") -> None:
        names = sorted(known)
        close = difflib.get_close_matches(str(name), names, n=1)
        article = "an" if kind[0] in "aeiou" else "a"
        message = f"Expected the name of {article} {kind}, one of {', '.join(names) or '(none)'}; got {name!r}."
        if close:
            message += f" Did you mean {close[0]!r}?"
        if hint:
            message += f" {hint}"
        super().__init__(message)
        self.kind, self.name, self.known = kind, name, tuple(names)


class AssemblyError(InputError):
    """Parts that overlap, float, fall apart, are empty or bear one name twice."""


class DemonstrationError(InputError):
    """Demonstrations whose arrays do not fit together."""


class CheckpointError(InputError):
    """A weights file that is damaged, or was made for something else."""


class ContractError(NeurosymError):
    """A plug-in (domain, planner or prior) broke its promise; the message says which."""


class MissingDependencyError(NeurosymError, ImportError):
    """An optional package is not installed; the message says how to get it."""

    @classmethod
    def of(cls, package: str, purpose: str, extra: str, distribution: str = "neurosym-assembly") -> Self:
        """For a package that an extra of a distribution has; `purpose` goes on after "which"."""
        install = f"pip install '{distribution}[{extra}]', or from the repository pip install '.[{extra}]'"
        return cls(f"Expected {package}, which {purpose}; it is not installed. Install the extra `{extra}`: {install}.")
