"""Action schemas: what an action needs and what it changes, over typed parameters."""

import string
from collections.abc import Collection, Sequence

from neurosym.errors import DefinitionError
from neurosym.language.terms import Condition, Derived, Fluent, Literal, Variable, as_literal


class Action:
    """An action schema.

    Args:
        name: as in PDDL.
        params: its typed parameters, made by ``part("p")``.
        pre: atoms and literals that must hold; derived predicates are asked in this order, after all fluents.
        eff: fluents (made true) and negated fluents (made false).
        label: how its ground actions are named, for instance ``"{p}"``; default ``"name(p)"``.
    """

    def __init__(
        self,
        name: str,
        *params: Variable,
        pre: Sequence[Condition] = (),
        eff: Sequence[Condition] = (),
        label: str | None = None,
    ) -> None:
        for i, param in enumerate(params):
            if not isinstance(param, Variable):
                raise DefinitionError(f"In action {name!r}, parameter {i}: expected a variable; got {param!r}.")
        names = [p.name for p in params]
        if len(set(names)) != len(names):
            raise DefinitionError(f"In action {name!r}: expected parameters of different names; got {names}.")
        self.name = name
        self.params = tuple(params)
        self.pre = self._literals("pre", pre)
        self.eff = self._literals("eff", eff)
        self.label = label if label is not None else f"{name}({', '.join(f'{{{p}}}' for p in names)})"
        for i, literal in enumerate(self.eff):
            if isinstance(literal.atom.predicate, Derived):
                raise DefinitionError(
                    f"In action {name!r}, eff[{i}]: {literal.atom.predicate} is derived, computed from the world; "
                    "an effect can only change a fluent."
                )
        if not self.eff:
            raise DefinitionError(f"In action {name!r}: expected at least one effect; got none.")
        contradiction = {lit.atom for lit in self.eff if lit.positive} & {x.atom for x in self.eff if not x.positive}
        if contradiction:
            raise DefinitionError(
                f"In action {name!r}: {next(iter(contradiction))} is both made true and made false; keep one."
            )
        try:
            fields = {f for _, f, _, _ in string.Formatter().parse(self.label) if f is not None}
        except ValueError as error:
            raise DefinitionError(f"In action {name!r}: the label {label!r} is no format string: {error}.") from None
        if not fields <= set(names):
            raise DefinitionError(f"In action {name!r}: expected a label over {names}; got {self.label!r}.")

    def _literals(self, where: str, conditions: Sequence[Condition]) -> tuple[Literal, ...]:
        if not isinstance(conditions, list | tuple):
            raise DefinitionError(f"In action {self.name!r}: expected {where} to be a list; got {conditions!r}.")
        known = set(self.params)
        literals = []
        for i, condition in enumerate(conditions):
            place = f"action {self.name!r}, {where}[{i}]"
            literal = as_literal(condition, place)
            for arg in literal.atom.args:
                if isinstance(arg, Variable) and arg not in known:
                    raise DefinitionError(
                        f"In {place}: {literal} uses {arg} ({arg.type}), which is no parameter of the action; "
                        f"expected one of {', '.join(f'{p} ({p.type})' for p in self.params) or 'none'}."
                    )
            literals.append(literal)
        return tuple(literals)

    def ground_name(self, binding: dict[str, str]) -> str:
        """The name of the ground action, from the label."""
        return self.label.format(**binding)

    def __repr__(self) -> str:
        return f"Action({self.name!r}, {', '.join(map(str, self.params))})"


def moved_parts(
    effects: Sequence[Literal], names: Sequence[str], presence: Collection[Fluent] = ()
) -> tuple[tuple[str, ...], bool]:
    """Which of some names leave, by effects that only delete atoms of them; else which arrive, by such that only add.

    `presence`: fluents that say which parts are there; the others then say nothing of it. Empty: any may.

    Returns the names, and whether they arrive.
    """
    told = [e for e in effects if not presence or e.atom.predicate in presence]
    added, deleted = ({a for e in told if e.positive is sign for a in e.atom.args} for sign in (True, False))
    leaving = tuple(name for name in names if name in deleted - added)
    return (leaving, False) if leaving else (tuple(name for name in names if name in added - deleted), True)
