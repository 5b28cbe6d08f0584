"""Terms of effects that a request adds to the rates of hosted states.

Next file to read: one_run.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

from .expression import Expression, ExpressionError
from .scope import Code, Scope
from .failures import BadRequest
from .quantity import Layout
from .values import Array, Inputs, Values


@dataclass(frozen=True)
class Frame:
    """Where a term is evaluated."""

    t: float
    x: Array
    u: Array
    #: A time inside the span on which the inputs are linear, for their slopes.
    inside: float


class _Run(Scope):
    """Names in a term of one run: states, inputs, parameters, constants of the request."""

    def __init__(self, states: Layout, inputs: Layout, signals: Inputs, numbers: Mapping[str, float]) -> None:
        self._states = states
        self._inputs = inputs
        self._signals = signals
        self._numbers = numbers

    def name(self, name: str) -> Optional[Code]:
        at = self._states.find(name)
        if at is not None and len(at) == 1:
            i = at[0]
            return lambda frame: float(frame.x[i])
        if name in self._inputs:
            k = self._inputs.slices[name].start
            return lambda frame: float(frame.u[k])
        value = self._numbers.get(name)
        if value is None:
            return None
        number = value
        return lambda _: number

    def time(self) -> Code:
        return lambda frame: float(frame.t)

    def delayed(self, name: str) -> Optional[Callable[[Any, float], float]]:
        if name not in self._inputs:
            return None
        signal = self._signals[name]
        return lambda frame, tau: signal.at(frame.t - tau)

    def slope(self, name: str) -> Optional[Code]:
        if name not in self._inputs:
            return None
        signal = self._signals[name]
        return lambda frame: signal.slope(frame.inside)


class Terms:
    """The terms of one run, compiled."""

    def __init__(
        self,
        terms: Sequence[Tuple[str, str]],
        hosts: Sequence[str],
        states: Layout,
        inputs: Tuple[Layout, Inputs],
        numbers: Dict[str, float],
    ) -> None:
        scope = _Run(states, inputs[0], inputs[1], numbers)
        self.of: Dict[int, List[Code]] = {}
        for state, text in terms:
            if state not in hosts:
                told = ", ".join(hosts) or "none"
                raise BadRequest(f"a term for the state `{state}`, which hosts none; states that do: {told}")
            try:
                code = Expression(text).compile(scope)
            except ExpressionError as error:
                raise BadRequest(f"the term of `{state}`: {error}") from None
            self.of.setdefault(states.slices[state].start, []).append(code)

    def add(self, rate: Array, frame: Frame) -> None:
        """Adds every term to the rates of the states."""
        for at, codes in self.of.items():
            for code in codes:
                rate[at] += code(frame)

    def value(self, at: int, frame: Frame) -> float:
        """Sum of the terms of one state; zero where there are none."""
        return sum((code(frame) for code in self.of.get(at, ())), 0.0)


def frame(t: float, x: Array, u: Values, inside: float) -> Frame:
    """Where a term is evaluated, from what a solver has."""
    return Frame(t, x, u.array, inside)
