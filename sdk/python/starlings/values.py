"""Numbers with names, and input signals.

Next file to read: window.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Iterator, List, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from .quantity import Layout

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(np.float64).eps)


def rounding(t: float) -> float:
    """Times closer than this are one time."""
    return 4.0 * _EPSILON * abs(t)


class Values:
    """Numbers in declared order, by name or position: `p.k`, `p["k"]`, `p[0]`, `k, c = p`; `p.array` is all of them.

    A single number comes as a float, a field as an array.
    """

    __slots__ = ("_layout", "array")

    def __init__(self, layout: Layout, array: Array) -> None:
        self._layout = layout
        self.array = array

    def __getitem__(self, key: Union[str, int]) -> Any:
        if isinstance(key, str):
            part = self._layout.slices.get(key)
            if part is None:
                raise KeyError(f"no `{key}` among the {self._layout.what}: {self._layout.told()}")
            return float(self.array[part.start]) if part.stop - part.start == 1 else self.array[part]
        return self[self._layout.quantities[key].name]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None

    def __len__(self) -> int:
        return len(self._layout)

    def __iter__(self) -> Iterator[Any]:
        return (self[q.name] for q in self._layout.quantities)

    def __repr__(self) -> str:
        inside = ", ".join(f"{name}={self[name]!r}" for name in self._layout.names())
        return f"Values({inside})"


@dataclass(frozen=True)
class Signal:
    """Samples of one input: linear between them, constant beyond. `times` increase, in study time."""

    times: Array
    values: Array

    def at(self, t: float) -> float:
        """Value at time `t`."""
        k = int(self.times.searchsorted(t, "right"))
        if k == 0:
            return float(self.values[0])
        if k == len(self.times):
            return float(self.values[-1])
        return float(self.values[k - 1]) + self._slope(k) * (t - float(self.times[k - 1]))

    def slope(self, t: float) -> float:
        """Slope at time `t`; at a sample that of the span which begins there."""
        k = int(self.times.searchsorted(t, "right"))
        return 0.0 if k in (0, len(self.times)) else self._slope(k)

    def _slope(self, k: int) -> float:
        rise = float(self.values[k]) - float(self.values[k - 1])
        return rise / (float(self.times[k]) - float(self.times[k - 1]))


class Inputs:
    """The input signals of a window: `inputs.at(t)` gives all values at a time, `inputs["force"]` one signal."""

    def __init__(self, layout: Layout, signals: Sequence[Signal]) -> None:
        self._layout = layout
        self._signals = list(signals)
        self._by_name: Dict[str, Signal] = dict(zip(layout.names(), signals))

    def __getitem__(self, name: str) -> Signal:
        return self._by_name[name]

    def __len__(self) -> int:
        return len(self._signals)

    def at(self, t: float) -> Values:
        """Every input at time `t`."""
        return Values(self._layout, np.array([s.at(t) for s in self._signals], dtype=np.float64))

    def line(self, start: float) -> Tuple[Array, Array]:
        """Every input at `start` and its slope on the span that begins there, up to the next sample of any."""
        begin = start + rounding(start)
        slopes = np.array([s.slope(begin) for s in self._signals], dtype=np.float64)
        return np.array([s.at(start) for s in self._signals], dtype=np.float64), slopes

    def samples(self, start: float, end: float) -> List[float]:
        """Sample times of any signal strictly between two times, but for rounding."""
        found: List[float] = []
        lo, hi = start + rounding(start), end - rounding(end)
        for signal in self._signals:
            a, b = signal.times.searchsorted(lo, "right"), signal.times.searchsorted(hi, "left")
            found.extend(signal.times[a:b].tolist())
        merged: List[float] = []
        for t in sorted(found):
            if not merged or t > merged[-1] + rounding(t):
                merged.append(t)
        return merged


class StepInputs(Values):
    """Inputs as a step sees them: by name their mean over the step, and `u.at(t)` at any time."""

    __slots__ = ("_inputs",)

    def __init__(self, layout: Layout, inputs: Inputs, start: float, end: float) -> None:
        # Steps end at samples, so that inputs are linear on them and the middle is the mean.
        super().__init__(layout, inputs.at(0.5 * (start + end)).array)
        self._inputs = inputs

    def at(self, t: float) -> Values:
        """Every input at time `t`."""
        return self._inputs.at(t)


def array(values: Any, size: int, what: str, names: str, error: type = ValueError) -> Array:
    """`values` as a flat array of `size` numbers; `error` names what was expected and what came."""
    try:
        flat = np.asarray(values, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise error(f"{what}: expected {size} numbers ({names}), got {short(values)}") from None
    if flat.size != size:
        raise error(f"{what}: expected {size} numbers ({names}), got {flat.size}")
    return flat


def short(value: Any) -> str:
    """The beginning of how a value prints, for messages."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
