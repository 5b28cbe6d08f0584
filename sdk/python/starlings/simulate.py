"""Runs a solver in this process, without a fleet: for trying it out, for tests, for making data. See `twin` for studies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Type, Union

import numpy as np

from .failures import BadRequest
from .job import Job
from .one_run import execute
from .solver import Served, Solver
from .values import Array, Signal


@dataclass
class Simulated:
    """Outputs by name, [n_times] or [n_times][size], and the state at the end, [n_state]."""

    outputs: Dict[str, Array]
    state: Array


def simulate(
    solver: Union[Solver, Type[Solver]],
    *,
    parameters: Optional[Mapping[str, float]] = None,
    times: Any,
    start: float = 0.0,
    state: Any = None,
    initial: Optional[Mapping[str, float]] = None,
    inputs: Optional[Mapping[str, Tuple[Any, Any]]] = None,
    observed: Optional[Mapping[str, Any]] = None,
    observer: str = "none",
    gain: float = 0.0,
    terms: Sequence[Tuple[str, str]] = (),
    constants: Optional[Mapping[str, float]] = None,
) -> Simulated:
    """Runs the solver from `start` through `times` exactly as a study would.

    `parameters` by name, those with a default may be left out. `inputs` by name as (times, values). `observed` by output,
    [n_times] or [n_times][size], NaN where nothing was measured; used by the observer alone. `terms` are pairs of a state and
    an expression that is added to its rate, with `constants` for the names in it.

    Raises starlings.Failed where the run gives no prediction.
    """
    served = Served(solver)
    grid = np.asarray(times, dtype=np.float64).reshape(-1)
    names = served.outputs.names()
    job = Job(
        parameters=_parameters(served, dict(parameters or {})),
        times=grid,
        start=start,
        outputs=names,
        state=None if state is None else np.asarray(state, dtype=np.float64).reshape(-1),
        observed=_observed(served, observed, grid.size),
        initial=dict(initial or {}),
        observer=observer,
        gain=gain,
        signals=_signals(served, dict(inputs or {})),
        terms=terms,
        constants=dict(constants or {}),
    )
    answer = execute(served, job)
    outputs = {}
    for q in served.outputs.quantities:
        part = answer.outputs[:, served.outputs.slices[q.name]]
        outputs[q.name] = part[:, 0] if q.size == 1 else part
    return Simulated(outputs, answer.state)


def _parameters(served: Served, given: Dict[str, float]) -> Array:
    values = []
    for q in served.parameters.quantities:
        value = given.pop(q.name, q.default)
        if value is None:
            raise BadRequest(f"the parameter `{q.name}` has no value and no default")
        values.append(float(value))
    if given:
        raise BadRequest(f"no parameter `{next(iter(given))}`; there are {served.parameters.told()}")
    return np.array(values)


def _observed(served: Served, given: Optional[Mapping[str, Any]], n_times: int) -> Array:
    table = np.full((n_times, served.outputs.size), np.nan)
    for name, values in (given or {}).items():
        if name not in served.outputs:
            raise BadRequest(f"no output `{name}`; there are {served.outputs.told()}")
        part = served.outputs.slices[name]
        table[:, part] = np.asarray(values, dtype=np.float64).reshape(n_times, part.stop - part.start)
    return table


def _signals(served: Served, given: Dict[str, Tuple[Any, Any]]) -> Sequence[Signal]:
    signals = []
    for name in served.inputs.names():
        if name not in given:
            raise BadRequest(f"the input `{name}` has no signal")
        times, values = (np.asarray(part, dtype=np.float64).reshape(-1) for part in given.pop(name))
        signals.append(Signal(times, values))
    if given:
        raise BadRequest(f"no input `{next(iter(given))}`; there are {served.inputs.told()}")
    return signals
