"""A request of one run as arrays, and whether it fits the solver.

Next file to read: one_run.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from .failures import BadRequest, NotFinite
from .quantity import Layout
from .solver import Served
from .terms import Terms
from .values import Array, Inputs, Signal, Values, array
from .window import Row, Window


@dataclass
class Job:
    """A request of one run, as arrays."""

    parameters: Array
    times: Array
    start: float
    outputs: Sequence[str]
    state: Optional[Array] = None
    observed: Optional[Array] = None
    initial: Dict[str, float] = field(default_factory=dict)
    observer: str = "none"
    gain: float = 0.0
    signals: Sequence[Signal] = ()
    terms: Sequence[Tuple[str, str]] = ()
    constants: Dict[str, float] = field(default_factory=dict)
    scratch: str = ""
    particle: int = 0
    record: int = 0
    traceparent: str = ""


@dataclass
class Answer:
    """Predicted outputs, [n_times][n_obs], before any correction, and the state at the end, [n_state]."""

    outputs: Array
    state: Array


def prepare(served: Served, job: Job, stopped: Callable[[], bool], progress: Callable[[float], None]) -> Window:
    """The window of a job. Raises BadRequest for what does not fit the solver."""
    names = served.parameters.told()
    parameters = array(job.parameters, served.parameters.size, "parameters", names, BadRequest)
    check_finite(served.parameters, "parameter", parameters, job.start)
    times, start = job.times, job.start
    _check_times(times, start)
    rows = _rows(served, job.outputs)
    observed = np.full((times.size, len(rows)), np.nan) if job.observed is None else job.observed
    if observed.size != times.size * len(rows):
        raise BadRequest(
            f"observed values: expected {times.size} times of {len(rows)} ({', '.join(job.outputs)}), got {observed.size}"
        )
    inputs = _inputs(served.inputs, job.signals)
    state = np.zeros(0)
    if job.state is not None:
        if not served.restart and job.state.size:
            raise BadRequest(f"a state for `{served.name}`, which cannot start from one")
        state = array(job.state, served.states.size, "state", served.states.told(), BadRequest).copy()
        check_finite(served.states, "state", state, start)
    p = Values(served.parameters, parameters)
    kind, corrector = job.observer or "none", served.observers.get(job.observer)
    if kind != "none" and kind not in served.kinds:
        told_kinds = ", ".join(served.kinds) or "none"
        raise BadRequest(f"`{served.name}` hosts no observer `{kind}`; it hosts {told_kinds}")
    if not (math.isfinite(job.gain) and job.gain >= 0.0):
        raise BadRequest(f"the gain is {job.gain}, expected a finite number from 0")
    numbers = {**{q.name: float(v) for q, v in zip(served.parameters.quantities, parameters)}, **job.constants}
    terms = Terms(job.terms, served.hosts, served.states, (served.inputs, inputs), numbers)
    return Window(
        start=start,
        times=times,
        p=p,
        inputs=inputs,
        state=state,
        outputs=list(job.outputs),
        observed=observed.reshape(times.size, len(rows)),
        observer=kind,
        gain=job.gain,
        constants=dict(job.constants),
        scratch=job.scratch,
        particle=job.particle,
        record=job.record,
        traceparent=job.traceparent,
        _rows=rows,
        _layouts=(served.outputs, served.states),
        _terms=terms,
        _corrector=corrector,
        _stopped=stopped,
        _progress=progress,
    )


def _rows(served: Served, names: Sequence[str]) -> List[Row]:
    """What the named outputs record, in their order; a scalar state where no output has that name."""
    rows: List[Row] = []
    if len(set(names)) != len(names):
        raise BadRequest(f"an output is asked for twice: {', '.join(names)}")
    for name in names:
        at = served.outputs.find(name)
        if at is not None:
            rows.extend(("output", i) for i in at)
            continue
        at = served.states.find(name)
        if at is None or len(at) != 1:
            raise BadRequest(f"no output `{name}`; there are {served.outputs.told()}")
        if served.form == "run":
            raise BadRequest(
                f"`{name}` is a state, and `{served.name}` gives states only at the end; ask for an output"
            )
        rows.append(("state", at[0]))
    return rows


def _inputs(layout: Layout, signals: Sequence[Signal]) -> Inputs:
    if len(signals) != len(layout):
        raise BadRequest(f"input signals: expected {len(layout)} ({layout.told()}), got {len(signals)}")
    for name, signal in zip(layout.names(), signals):
        if signal.times.size != signal.values.size or not signal.times.size:
            raise BadRequest(f"input `{name}` has {signal.times.size} times and {signal.values.size} values")
        if not np.all(np.diff(signal.times) > 0):
            raise BadRequest(f"the times of input `{name}` do not increase")
        if not np.all(np.isfinite(signal.values)):
            bad = int(np.flatnonzero(~np.isfinite(signal.values))[0])
            raise NotFinite(f"input `{name}`", float(signal.times[bad]))
    return Inputs(layout, signals)


def _check_times(times: Array, start: float) -> None:
    if not times.size:
        raise BadRequest("a window without observation times")
    if not (math.isfinite(start) and np.all(np.isfinite(times))):
        raise BadRequest("a window with a time that is not finite")
    if times[0] < start or not np.all(np.diff(times) > 0):
        raise BadRequest("observation times must increase from the start of the window")


def check_finite(layout: Layout, what: str, values: Array, time: float) -> None:
    """Raises NotFinite that names the first component which is no finite number."""
    with np.errstate(all="ignore"):
        # The sum of finite numbers is finite unless they are huge; it is looked at closely only then.
        if math.isfinite(float(values.sum())) or np.all(np.isfinite(values)):
            return
    at = int(np.flatnonzero(~np.isfinite(values))[0])
    raise NotFinite(f"{what} `{layout.component(at)}`", time)
