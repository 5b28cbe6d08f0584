"""Runs a model forward, without a fleet: for trying it out, for tests, for making data.

A solver runs in this process; what a study says is run by the program. Next file to read: one_run.py, or commands.py.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Type, Union, overload

import numpy as np

from .commands import twin
from .failures import BadRequest
from .job import Job
from .one_run import execute
from .program import StudyError
from .solver import Served, Solver
from .study_file import AnyStudy, Study
from .values import Array, Signal


@dataclass
class Simulated:
    """Outputs by name, [n_times] or [n_times][size], and the state at the end, [n_state]."""

    outputs: Dict[str, Array]
    state: Array


#: Arguments of a run of a solver that a study says itself.
_OF_SOLVERS = ("times", "start", "state", "initial", "inputs", "observed", "gain", "terms", "constants")


@overload
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
) -> Simulated: ...


@overload
def simulate(
    solver: AnyStudy,
    values: Optional[Mapping[str, float]] = None,
    *,
    noise: Optional[float] = None,
    seed: Optional[int] = None,
    record: Optional[str] = None,
    options: Sequence[str] = (),
    **overrides: Any,
) -> Any: ...


def simulate(solver: Any, values: Optional[Mapping[str, float]] = None, **given: Any) -> Any:
    """Runs a model forward: that of a study, at its times and with its inputs, or a solver in this process.

    simulate(study, {"k": 40.0}, noise=None, seed=None, record=None, options=(), **overrides)

    Of a study (a `Study`, the path of its file, or its sections as tables) it is `twin`: a table of the outputs against time. The
    values may stand in `parameters={"k": 40.0}` as well; the others have their prior medians.

    simulate(solver, parameters=None, times=..., start=0.0, state=None, initial=None, inputs=None, observed=None, observer="none",
             gain=0.0, terms=(), constants=None)

    Of a solver it is a run from `start` through `times`, [n_times], exactly as a study would make it: a `Simulated`. `parameters` by name,
    those with a default may be left out. `inputs` by name as (times, values). `observed` by output, [n_times] or [n_times][size], NaN
    where nothing was measured; used by the observer alone. `terms` are pairs of a state and an expression that is added to its
    rate, with `constants` for the names in it.

    Raises starlings.Failed where the run of a solver gives no prediction, as `twin` where that of a study does.
    """
    if isinstance(solver, (Study, str, os.PathLike, Mapping)):
        return _of_study(solver, values, given)
    if values is not None:
        raise BadRequest("the values of a solver's parameters stand in parameters={name: value}")
    return _of_solver(solver, **given)


def _of_study(study: AnyStudy, values: Optional[Mapping[str, float]], given: Dict[str, Any]) -> Any:
    stray = next((name for name in _OF_SOLVERS if name in given), None)
    if stray is not None:
        raise StudyError(
            f"`{stray}` is for a solver: a study has times and inputs of its own; options=[\"--until\", \"10\", \"--step\", \"0.1\"] "
            "gives other times"
        )
    # Of the tables of a study a parameter is never a number.
    parameters = given.get("parameters")
    if isinstance(parameters, Mapping):
        numbers = {name: float(value) for name, value in parameters.items() if isinstance(value, (int, float, np.number))}
        values = {**(values or {}), **numbers}
        rest = {name: value for name, value in parameters.items() if name not in numbers}
        given = {key: value for key, value in given.items() if key != "parameters"}
        if rest:
            given["parameters"] = rest
    return twin(study, values, **given)


def _of_solver(
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
