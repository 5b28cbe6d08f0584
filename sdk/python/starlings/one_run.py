"""One run: march through the window, record, correct.

For each observation time: advance, record the outputs, and only then let the observer see what was observed at that time. A run
over consecutive windows takes the steps of one run over the whole. Next file to read: service.py.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np

from .failures import (
    BAD_REQUEST,
    NOT_FINITE,
    OUTSIDE_DOMAIN,
    SOLVER,
    UNAVAILABLE,
    BadRequest,
    Cancelled,
    Failed,
    Misfit,
    NotFinite,
    OutsideDomain,
    Unavailable,
)
from .job import Answer, Job, check_finite, prepare
from .places import show, told
from .shapes import table, vector
from .solver import Served
from .terms import Frame
from .values import Array, StepInputs, Values
from .window import Row, Window


def execute(
    served: Served,
    job: Job,
    stopped: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda time: None,
) -> Answer:
    """Runs a job, of which the state is taken. Raises Failed, or Cancelled when nobody waits any more."""
    try:
        window = prepare(served, job, stopped, progress)
        served.solver.window = window
        if job.state is None:
            window.state = initial_state(served, window, job.initial)
        # The window has its own, which the solver may change.
        job.state = None
        if served.form == "run":
            return _whole(served, window)
        return _March(served, window).run()
    except (Cancelled, Failed):
        raise
    except BadRequest as error:
        raise Failed(BAD_REQUEST, str(error)) from error
    except NotFinite as error:
        raise Failed(NOT_FINITE, error.what, error.time) from error
    except OutsideDomain as error:
        raise Failed(OUTSIDE_DOMAIN, str(error)) from error
    except Unavailable as error:
        raise Failed(UNAVAILABLE, str(error)) from error
    except (OSError, MemoryError) as error:  # of the machine, not of the parameters
        show(error, served.solver)
        raise Failed(UNAVAILABLE, told(error, served.solver)) from error
    except KeyboardInterrupt:  # of who sits before it
        raise
    except SystemExit as error:  # the process serves others too: it goes on
        show(error, served.solver)
        what = f"{told(error, served.solver)}: the model ended the process by sys.exit; raise an exception where a run fails"
        raise Failed(SOLVER, what) from error
    except BaseException as error:  # whatever a solver raises is data about this run
        show(error, served.solver)
        raise Failed(SOLVER, told(error, served.solver)) from error
    finally:
        # A large state of the past would stay beside the next one.
        vars(served.solver).pop("window", None)


class _March:
    """A run by `step` or `rate`."""

    def __init__(self, served: Served, window: Window) -> None:
        self.served, self.window, self.solver = served, window, served.solver
        # Begin of a span between samples, the inputs there, and their slopes on it.
        self._line: Tuple[float, Array, Array] = (math.nan, np.zeros(0), np.zeros(0))

    def run(self) -> Answer:
        served, window = self.served, self.window
        # No attribute: a method of this object that it holds itself would keep it, and its states, until the collector comes by.
        advance = self._step if served.form == "step" else self._runge_kutta
        x = window.state
        recorded = np.empty((window.times.size, len(window._rows)))
        previous = window.start
        for index, time in enumerate(window.times.tolist()):
            # Here and not in a method of its own, whose caller would keep the state before.
            for t, h in window.steps(previous, time, self.solver.dt, self.solver.cut_at_samples):
                x = advance(t, h, x)
            y = self._outputs(time, x)
            check_finite(served.states, "state", x, time)
            check_finite(served.outputs, "output", y, time)
            recorded[index] = _recorded(window._rows, y, x)
            x = window.correct(index, x, y)
            window.progress(time)
            previous = time
        check_finite(served.states, "state", x, previous)
        return Answer(recorded, x)

    def _step(self, t: float, h: float, x: Array) -> Array:
        u = StepInputs(self.served.inputs, self.window.inputs, t, t + h)
        given = self.solver.step(t, h, x, self.window.p, u)
        return vector("step", "step returned the states", given, self.served.states)

    def _rate(self, t: float, x: Array) -> Array:
        u = self._driven(t)
        given = self.solver.rate(t, x, self.window.p, u)
        rate = vector("rate", "rate returned the states' rates", given, self.served.states)
        # A solver may give the same array every time.
        rate = rate.copy()
        if not self.window._terms.of:
            return rate
        lo, hi = self.window._span
        self.window._terms.add(rate, Frame(t, x, u.array, 0.5 * (lo + hi)))
        return rate

    def _driven(self, t: float) -> Values:
        """Inputs at a time inside the span that is being marched through, its end included."""
        inputs = self.window.inputs
        if not self.solver.cut_at_samples or not len(inputs):
            return inputs.at(t)
        begin = self.window._span[0]
        if self._line[0] != begin:
            self._line = (begin, *inputs.line(begin))
        _, value, slope = self._line
        return Values(self.served.inputs, value + slope * (t - begin))

    def _runge_kutta(self, t: float, h: float, x: Array) -> Array:
        """One step of the classical method (Kutta 1901)."""
        k1 = self._rate(t, x)
        k2 = self._rate(t + 0.5 * h, x + 0.5 * h * k1)
        k3 = self._rate(t + 0.5 * h, x + 0.5 * h * k2)
        k4 = self._rate(t + h, x + h * k3)
        moved: Array = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        check_finite(self.served.states, "state", moved, t + h)
        return moved

    def _outputs(self, time: float, x: Array) -> Array:
        served = self.served
        if served.plain:
            parts = [x[served.states.slices[served.measures[name]]] for name in served.outputs.names()]
            shown: Array = np.concatenate(parts)
            return shown
        given = self.solver.output(time, x, self.window.p, self.window.inputs.at(time))
        return vector("output", "output returned", given, served.outputs)


def initial_state(served: Served, window: Window, estimated: Dict[str, float]) -> Array:
    """The solver's initial state with the estimated initial values in their places."""
    given = served.solver.initial(window.p)
    states = served.states
    x = np.zeros(states.size)
    if given is not None:
        x = vector("initial", "initial returned the states", given, states).copy()
    for name, value in estimated.items():
        at = states.find(name)
        if at is None:
            raise BadRequest(f"an initial value of `{name}`, which is no state; there are {states.told()}")
        x[at.start : at.stop] = value
    check_finite(states, "state", x, window.start)
    return x


def _whole(served: Served, window: Window) -> Answer:
    """A run by `run`."""
    given = served.solver.run(window)
    state: Any = np.zeros(0)
    if served.restart:
        if not (isinstance(given, tuple) and len(given) == 2):
            got = f"{len(given)} things" if isinstance(given, tuple) else f"a {type(given).__name__}"
            what = "run: a solver with states returns two things, outputs and the state at the end"
            raise Misfit("run", f"{what}; got {got}: `return outputs, state`")
        given, state = given
        state = vector("run", "run returned the states", state, served.states)
    shown = table("run", given, served.outputs, window.times.size)
    for index, time in enumerate(window.times.tolist()):
        check_finite(served.outputs, "output", shown[index], time)
    end = float(window.times[-1])
    if served.restart:
        check_finite(served.states, "state", state, end)
    recorded = np.array([_recorded(window._rows, row, state) for row in shown])
    return Answer(recorded.reshape(window.times.size, len(window._rows)), state)


def _recorded(rows: Sequence[Row], y: Array, x: Array) -> List[float]:
    return [float(y[at]) if what == "output" else float(x[at]) for what, at in rows]
