"""What a solver sees of one run.

Next file to read: one_run.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import numpy as np

from .failures import Cancelled
from .observers import Correction, Observer
from .quantity import Layout
from .shapes import vector
from .terms import Frame, Terms
from .values import Array, Inputs, Values

#: One row of the prediction: of the outputs ("output") or of the state ("state"), and which component.
Row = Tuple[str, int]

#: More steps than this between two observations mean a wrong `dt`.
_MOST_STEPS = 10_000_000


@dataclass
class Window:
    """One run over one window: from `start` through `times`, the last of which ends it.

    A solver with `run` gets it as argument; one with `step` or `rate` finds it as `self.window` while it runs.
    """

    #: Start of the run, study time.
    start: float
    #: Observation times, [n_times], increasing, none before the start.
    times: Array
    #: Parameters in declared order: `window.p.k`.
    p: Values
    #: Input signals: `window.inputs.at(t).force`.
    inputs: Inputs
    #: State at the start, [n_state]: the one in which another run ended, or that of `initial`; empty without states.
    state: Array
    #: Names of the outputs that are asked for.
    outputs: List[str]
    #: Observed values, [n_times][n_obs]; NaN: nothing. Look at a row only after the outputs of its time are final.
    observed: Array
    #: Kind of the observer that is asked for, "none" for none, and its gain in 1/study time.
    observer: str
    gain: float
    #: Values of the parameters of terms.
    constants: Dict[str, float]
    #: A folder of this program's own, for files: the same for all its runs, removed after its end.
    scratch: str
    #: Index of the sigma point and of the record, for names of files.
    particle: int
    record: int
    #: Where the run belongs in a trace: `traceparent` of the W3C recommendation "Trace Context"; empty for none.
    traceparent: str
    _rows: List[Row]
    _layouts: Tuple[Layout, Layout]
    _terms: Terms
    _corrector: Optional[Observer]
    _stopped: Callable[[], bool]
    _progress: Callable[[float], None]
    _span: Tuple[float, float] = field(default=(0.0, 0.0))

    @property
    def cancelled(self) -> bool:
        """Whether nobody waits for the run any more."""
        return self._stopped()

    def check_cancelled(self) -> None:
        """Ends the run where nobody waits for it any more."""
        if self._stopped():
            raise Cancelled

    def steps(
        self, start: float, end: float, dt: Optional[float] = None, cut_at_samples: bool = True
    ) -> Iterator[Tuple[float, float]]:
        """Steps from `start` to `end`, as pairs of their begin and their length.

        None is longer than `dt`, and those between two input samples are equal; without `cut_at_samples` they are all equal.
        Ends the run where nobody waits for it any more.
        """
        ends = [*(self.inputs.samples(start, end) if cut_at_samples else []), end] if end > start else []
        for stop in ends:
            self._span = (start, stop)
            # A step that divides the span but for rounding must not be cut in two.
            count = max(1, math.ceil((stop - start) / dt - 1e-9)) if dt else 1
            if count > _MOST_STEPS:
                raise ValueError(f"{count} steps of {dt} from {start} to {stop}: is `dt` in study time?")
            h = (stop - start) / count
            for i in range(count):
                self.check_cancelled()
                yield start + i * h, h
            start = stop

    def progress(self, time: float) -> None:
        """Tells how far the run has come, study time. May be called as often as one likes."""
        self._progress(time)

    def terms(self, state: str, t: float, x: Array, u: Optional[Values] = None) -> float:
        """Sum of the terms that are added to the rate of a state at time `t`; zero where there are none.

        `x` is the whole state, [n_state]; `u` are the inputs, by default those at `t`. A solver that names the state in
        `hosts` has to add this to its rate.
        """
        states = self._layouts[1]
        if state not in states:
            raise KeyError(f"no `{state}` among the states: {states.told()}")
        inputs = self.inputs.at(t) if u is None else u
        lo, hi = self._span
        inside = 0.5 * (lo + hi) if lo < hi else t
        return self._terms.value(states.slices[state].start, Frame(t, x, inputs.array, inside))

    def correct(self, index: int, x: Array, outputs: Any) -> Array:
        """The state after the observer's correction at `times[index]`; call it once those outputs are recorded.

        `x` is the whole state, [n_state]; `outputs` are what was predicted for that time, all declared ones, as a list in
        declared order or a table. Without observer, with gain 0 or at the start itself this is `x`, unchanged.
        """
        previous = self.start if index == 0 else float(self.times[index - 1])
        dt = float(self.times[index]) - previous
        if self._corrector is None or not self.gain > 0.0 or not dt > 0.0:
            return x
        declared, states = self._layouts
        y = vector("run", "correct was given the outputs", outputs, declared)
        innovation, of_state = np.full(declared.size, np.nan), np.full(states.size, np.nan)
        for value, (what, at) in zip(self.observed[index], self._rows):
            if what == "output":
                innovation[at] = value - y[at]
            else:
                of_state[at] = value - x[at]
        return self._corrector.correct(Correction(self.gain, dt, innovation, of_state, self.p), x)
