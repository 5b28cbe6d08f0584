"""Serves a Functional Mock-up Unit, FMI 2 or 3 for co-simulation, through fmpy.

    python3 -m starlings.fmu MODEL.fmu [--step H] [--states NAME,NAME]

Parameters are its fixed and tunable real parameters with their starts as defaults, outputs and inputs its real scalar outputs
and inputs, units and bounds those of the model description. The FMU is asked for outputs at the observation times and steps
from one to the next, in steps of at most H; inputs are held at their mean over each step.

A filter combines the states of its particles, so that a state is numbers with a meaning: the FMU's own opaque state, which can
only be put back as it was, is no use here. States are the continuous states of the model description where all of them can be
set before a run, or the variables that `--states` names; together they must be everything that the FMU remembers. Without
states an FMU cannot restart, and whole records are estimated (`kind = "batch"`).
"""

from __future__ import annotations

import argparse
import atexit
import math
import os
import re
import shutil
import tempfile
from typing import Any, List, Optional, Sequence

import numpy as np

from .failures import DeclarationError
from .quantity import Quantity
from .serve import SOCKET, serve
from .solver import Solver
from .values import Array
from .window import Window


class Fmu(Solver):
    """A Functional Mock-up Unit."""

    def __init__(self, path: str, step: Optional[float] = None, states: Optional[Sequence[str]] = None) -> None:
        import fmpy

        description: Any = fmpy.read_model_description(path, validate=False)
        exchange = description.coSimulation
        if exchange is None:
            raise DeclarationError(
                f"{path} offers no co-simulation, only model exchange, which is not supported"
            )
        reals = [v for v in description.modelVariables if v.type in ("Real", "Float64") and not v.dimensions]
        tuned = ("fixed", "tunable")
        self._parameters = [v for v in reals if v.causality == "parameter" and v.variability in tuned]
        self._outputs = [v for v in reals if v.causality == "output"]
        self._inputs = [v for v in reals if v.causality == "input"]
        self._states = _states(description, reals, states)
        self.name = description.modelName or "fmu"
        self.says = description.description or ""
        self.parameters = [_quantity(v, default=True) for v in self._parameters]
        self.outputs = [_quantity(v) for v in self._outputs]
        self.inputs = [_quantity(v) for v in self._inputs]
        self.states = [_quantity(v) for v in self._states]
        self._variable_step = exchange.canHandleVariableCommunicationStepSize
        self._step = step if step is not None else _own_step(description)
        self._folder = _own_folder()
        fmpy.extract(path, unzipdir=self._folder)
        self._unit = (
            _Two(description, self._folder)
            if description.fmiMajorVersion == 2
            else _Three(description, self._folder)
        )

    def initial(self, p: Any) -> Array:
        """The starts of the states, as the FMU has them."""
        return np.array([_number(v.start) or 0.0 for v in self._states])

    def run(self, window: Window) -> Any:
        """Steps through the window."""
        references = [v.valueReference for v in self._outputs]
        self._unit.start(window.start)
        self._unit.set([v.valueReference for v in self._parameters], window.p.array)
        self._unit.set([v.valueReference for v in self._states], window.state)
        self._drive(window, window.start)
        self._unit.initialized()
        rows: List[List[float]] = []
        previous = window.start
        for time in window.times.tolist():
            for t, h in self._steps(window, previous, time):
                self._drive(window, t + 0.5 * h)
                self._unit.advance(t, h)
            self._drive(window, time)
            rows.append(self._unit.get(references))
            window.progress(time)
            previous = time
        outputs = np.array(rows)
        state = np.array(self._unit.get([v.valueReference for v in self._states]))
        self._unit.end()
        return (outputs, state) if self._states else outputs

    def _drive(self, window: Window, t: float) -> None:
        if self._inputs:
            self._unit.set([v.valueReference for v in self._inputs], window.inputs.at(t).array)

    def _steps(self, window: Window, previous: float, time: float) -> Any:
        if self._variable_step or time == previous:
            return window.steps(previous, time, self._step)
        if self._step is None:
            raise ValueError("this FMU steps in steps of one length: say which with --step")
        count = (time - previous) / self._step
        if abs(count - round(count)) > 1e-6:
            raise ValueError(
                f"this FMU steps in steps of {self._step} only, and {previous} to {time} is not a whole number of them"
            )
        return window.steps(previous, time, self._step, cut_at_samples=False)


class _Two:
    """An instance of FMI 2, used again from run to run."""

    def __init__(self, description: Any, folder: str) -> None:
        self._description, self._folder = description, folder
        self._slave: Any = None

    def _new(self) -> Any:
        from fmpy.fmi2 import FMU2Slave

        slave = FMU2Slave(**_identity(self._description, self._folder))
        slave.instantiate()
        return slave

    def start(self, time: float) -> None:
        """A fresh instance whose clock stands at `time`."""
        self._fresh()
        self._time = time

    def _fresh(self) -> None:
        if self._slave is not None:
            try:
                self._slave.reset()
                return
            except Exception:  # an FMU that cannot be reset is made anew
                self._slave.freeInstance()
        self._slave = self._new()

    def set(self, references: Sequence[int], values: Array) -> None:
        """Sets real variables."""
        if len(references):
            self._slave.setReal(list(references), [float(v) for v in values])

    def get(self, references: Sequence[int]) -> List[float]:
        """Values of real variables."""
        return list(self._slave.getReal(list(references))) if len(references) else []

    def initialized(self) -> None:
        """From the values that were set to a state in which it can step."""
        self._slave.setupExperiment(startTime=self._time)
        self._slave.enterInitializationMode()
        self._slave.exitInitializationMode()

    def advance(self, t: float, h: float) -> None:
        """One step."""
        self._slave.doStep(currentCommunicationPoint=t, communicationStepSize=h)

    def end(self) -> None:
        """After a run that went well."""
        self._slave.terminate()


class _Three(_Two):
    """An instance of FMI 3."""

    def _new(self) -> Any:
        from fmpy.fmi3 import FMU3Slave

        slave = FMU3Slave(**_identity(self._description, self._folder))
        slave.instantiate()
        return slave

    def set(self, references: Sequence[int], values: Array) -> None:
        if len(references):
            self._slave.setFloat64(list(references), [float(v) for v in values])

    def get(self, references: Sequence[int]) -> List[float]:
        return list(self._slave.getFloat64(list(references))) if len(references) else []

    def initialized(self) -> None:
        self._slave.enterInitializationMode(startTime=self._time)
        self._slave.exitInitializationMode()

    def advance(self, t: float, h: float) -> None:
        _, ended, early, reached = self._slave.doStep(t, h)
        if ended or early:
            raise ArithmeticError(f"the FMU stopped at {reached}, inside the step from {t} to {t + h}")


def _own_folder() -> str:
    """Where the FMU is unpacked: beside the socket, in the folder that the worker removes however this process ends."""
    socket = os.environ.get(SOCKET)
    folder = tempfile.mkdtemp(prefix="fmu-", dir=os.path.dirname(os.path.abspath(socket)) if socket else None)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _identity(description: Any, folder: str) -> Any:
    return {
        "guid": description.guid if hasattr(description, "guid") else description.instantiationToken,
        "unzipDirectory": folder,
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "instanceName": "starlings",
    }


def _states(description: Any, reals: List[Any], names: Optional[Sequence[str]]) -> List[Any]:
    if names is not None:
        by_name = {v.name: v for v in reals}
        for name in names:
            if name not in by_name:
                raise DeclarationError(f"--states: the FMU has no real variable `{name}`")
            if not _settable(by_name[name]):
                raise DeclarationError(
                    f"--states: `{name}` cannot be set before a run: its `initial` is {by_name[name].initial!r}, not 'exact'"
                )
        return [by_name[name] for name in names]
    found = [unknown.variable.derivative for unknown in description.derivatives]
    whole = all(v is not None and v in reals and _settable(v) for v in found)
    return found if whole else []


def _settable(variable: Any) -> bool:
    return bool(variable.initial in ("exact", "approx"))


def _quantity(variable: Any, default: bool = False) -> Quantity:
    declared = variable.declaredType
    unit = variable.unit or (declared.unit if declared is not None else None)
    lo = variable.min if variable.min is not None else (declared.min if declared is not None else None)
    hi = variable.max if variable.max is not None else (declared.max if declared is not None else None)
    return Quantity(
        # `x[1]` would be the component of a field.
        re.sub(r"[^\w.]", "_", variable.name).strip("_"),
        unit or "",
        lo=_number(lo),
        hi=_number(hi),
        default=_number(variable.start) if default else None,
        says=" ".join((variable.description or "").split()),
    )


def _own_step(description: Any) -> Optional[float]:
    own = _number(getattr(description.coSimulation, "fixedInternalStepSize", None))
    experiment = description.defaultExperiment
    return own or (_number(experiment.stepSize) if experiment is not None else None)


def _number(text: Any) -> Optional[float]:
    if text is None or text == "":
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def main() -> None:
    """The command line."""
    options = argparse.ArgumentParser(prog="python3 -m starlings.fmu", description="Serves an FMU as a solver.")
    options.add_argument("fmu", help="the .fmu file")
    options.add_argument(
        "--step", type=float, help="longest communication step, study time; by default the FMU's own"
    )
    options.add_argument("--states", help="variables that are all it remembers, separated by commas")
    options.add_argument("--describe", action="store_true", help="print what it declares and end")
    chosen = options.parse_args()
    try:
        states = [name.strip() for name in chosen.states.split(",")] if chosen.states else None
        solver = Fmu(chosen.fmu, chosen.step, states)
    except ImportError:
        raise SystemExit("an FMU needs the package fmpy: pip install fmpy") from None
    except (DeclarationError, OSError) as error:
        raise SystemExit(f"this FMU cannot be served: {error}") from None
    serve(solver, ["--describe"] if chosen.describe else [])


if __name__ == "__main__":
    main()
