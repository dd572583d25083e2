"""The delete relaxation of a ground problem as arrays: what heuristics ask.

Facts are numbers: first the bits of a state, then the complements of those that must be false somewhere, then one for
each "or" or nested "and". Nothing that became a fact is lost again. Derived predicates count as facts that hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from neurosym.language.conditions import And, Condition, Or
from neurosym.language.terms import Derived, Literal
from neurosym.support.arrays import Array, Numbers
from neurosym.support.bitsets import bits as numbers_in

if TYPE_CHECKING:
    from neurosym.language.grounding import GroundProblem


@dataclass(frozen=True, eq=False)
class GroundTask:
    """Operators with one effect each ("unary"), in compressed rows, and the goal.

    Attributes:
        width: bits of a state, the first facts. `facts`: how many there are.
        negated: int64 (k,): the bits whose complements are the facts ``width + i``.
        pre_start, pre: int64 (U + 1,) and (P,): preconditions of operator u are ``pre[pre_start[u]:pre_start[u + 1]]``.
        used_start, used: the same the other way round: operators that need a fact.
        add: int64 (U,): the fact that an operator makes true.
        cost: float64 (U,): 0 for those that only join conditions.
        action: int64 (U,): of which action it is an effect; -1 for those that only join.
        goal: int64 (g,).
    """

    width: int
    facts: int
    negated: Numbers
    pre_start: Numbers
    pre: Numbers
    used_start: Numbers
    used: Numbers
    add: Numbers
    cost: Array
    action: Numbers
    goal: Numbers

    @classmethod
    def of(cls, ground: GroundProblem) -> GroundTask:
        """The relaxation of a ground problem; without costs each action costs 1."""
        return _Builder(ground).task()


class _Builder:
    def __init__(self, ground: GroundProblem) -> None:
        self.ground, self.bits = ground, ground.bits
        self.negated: dict[int, int] = {}  # bit -> number of its complement
        self.joined: dict[Condition, int] = {}
        self.operators: list[tuple[tuple[int, ...], object, float, int]] = []  # facts are numbered at the end

    def task(self) -> GroundTask:
        ground = self.ground
        costs = ground.costs or (1.0,) * len(ground.actions)
        for number, instance in enumerate(ground.instances):
            pre = self._all([*instance.fluents, *instance.conditions])
            pre += tuple(numbers_in(ground.precedence(number)))
            for extra, literal in [(And(()), e) for e in instance.eff] + instance.conditional:
                needs = tuple(dict.fromkeys((*pre, *self._all([extra]))))
                self.operators.append((needs, literal, costs[number], number))
            for bit in numbers_in(ground.done_bit(number)):
                self.operators.append((pre, bit, costs[number], number))
        goal = self._all(ground.goal_conditions)
        width = ground.width
        # Complements are known only now: those of facts that nothing needs to be false are left out.
        number_of = {bit: width + k for k, bit in enumerate(self.negated)}
        joined = {key: width + len(number_of) + k for k, key in enumerate(self.joined.values())}

        def fact(given: object) -> int:
            if isinstance(given, Literal):
                bit = self.bits[given.atom]
                return bit if given.positive else number_of.get(bit, -1)
            assert isinstance(given, int)
            return given if given >= 0 else joined[given] if given in joined else number_of[~given]

        rows, add, cost, action = [], [], [], []
        for needs, effect, price, number in self.operators:
            added = fact(effect)
            if added >= 0:
                rows.append([fact(n) for n in needs])
                add.append(added)
                cost.append(price)
                action.append(number)
        facts = width + len(number_of) + len(joined)
        users: list[list[int]] = [[] for _ in range(facts)]
        for operator, row in enumerate(rows):
            for needed in row:
                users[needed].append(operator)
        return GroundTask(
            width,
            facts,
            np.array(list(number_of), dtype=np.int64),
            *_compressed(rows),
            *_compressed(users),
            np.array(add, dtype=np.int64),
            np.array(cost, dtype=np.float64),
            np.array(action, dtype=np.int64),
            np.array([fact(g) for g in goal], dtype=np.int64),
        )

    def _all(self, conditions: Sequence[Condition]) -> tuple[int, ...]:
        """Facts that together are the relaxed conditions. Complements and joined ones are negative numbers as yet."""
        found: list[int] = []
        for condition in conditions:
            if isinstance(condition, Literal):
                if isinstance(condition.atom.predicate, Derived):
                    continue
                bit = self.bits[condition.atom]
                found.append(bit if condition.positive else ~self.negated.setdefault(bit, bit))
            elif isinstance(condition, And):
                found += self._all(condition.parts)
            else:
                assert isinstance(condition, Or)
                found.append(self._either(condition))
        return tuple(dict.fromkeys(found))

    def _either(self, condition: Or) -> int:
        """The fact that one part holds."""
        if condition not in self.joined:
            # Below the complements of all bits.
            self.joined[condition] = key = ~(self.ground.width + len(self.joined))
            for part in condition.parts:
                self.operators.append((self._all([part]), key, 0.0, -1))
        return self.joined[condition]


def _compressed(rows: Sequence[Sequence[int]]) -> tuple[Numbers, Numbers]:
    start = np.cumsum([0, *map(len, rows)]).astype(np.int64)
    return start, np.array([x for row in rows for x in row], dtype=np.int64)
