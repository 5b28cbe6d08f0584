"""A solver: what it is, and the one thing it does, as `rate`, `step` or `run`.

Derive from `Solver`, or put `@solver(...)` on a class or a function. Next file to read: one_run.py.
"""

from __future__ import annotations

import inspect
import math
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Type, Union

from .failures import DeclarationError
from .observers import Observer
from .quantity import Layout, Quantities
from .values import Array, StepInputs, Values
from .window import Window


class Solver:
    """A forward model. Say what it has, then define exactly one of `rate`, `step` and `run`.

    - `rate`: the right-hand side of an ordinary differential equation; it is integrated here in steps of at most `dt`.
    - `step`: the next state after `dt`; anything that marches in time, such as a finite-element code.
    - `run`: a whole window at once; a solver of files, or one with a loop of its own.

    What a run leaves in `self` must not change the next one: the same request has to give the same numbers.
    """

    #: Name of the solver; by default that of the class in small letters.
    name: str = ""
    #: One plain sentence; by default the first of the docstring.
    says: str = ""
    #: Parameters, states, outputs and inputs: name to unit, or a list of `Quantity`.
    parameters: Quantities = ()
    states: Quantities = ()
    outputs: Quantities = ()
    inputs: Quantities = ()
    #: For each output that is one state, the state. Without `output`, outputs are these states.
    measures: Mapping[str, str] = {}
    #: Observers besides `nudging`, which any solver with `measures` and `step` or `rate` has. A `run` that corrects by itself
    #: names kinds as text.
    observers: Sequence[Union[Observer, str]] = ()
    #: Scalar states to whose rate the solver adds `self.window.terms(...)`; with `rate` that is done for all of them.
    hosts: Sequence[str] = ()
    #: Longest step, in study time. Needed by `rate`; without it `step` goes from one observation or input sample to the next.
    dt: Optional[float] = None
    #: Whether steps end at the samples of inputs, so that inputs are linear on every step.
    cut_at_samples: bool = True
    #: Whether equal requests give equal bits.
    deterministic: bool = True
    #: The run that is going on; for `step`, `rate` and `output`.
    window: Window

    def initial(self, p: Values) -> Any:
        """State at the start, [n_state], as a list, an array or a table of names; zeros by default."""
        return None

    def rate(self, t: float, x: Array, p: Values, u: Values) -> Any:
        """Rates of the states at time `t`, [n_state], per study time."""
        raise NotImplementedError

    def step(self, t: float, dt: float, x: Array, p: Values, u: StepInputs) -> Any:
        """State at `t + dt`, [n_state], from the state `x` at `t`. Inputs `u.force` are means over the step."""
        raise NotImplementedError

    def output(self, t: float, x: Array, p: Values, u: Values) -> Any:
        """Outputs at time `t`, in declared order or as a table of names."""
        raise NotImplementedError

    def run(self, window: Window) -> Any:
        """Outputs at every time of the window: one array [n_times][n_outputs] ([n_times] of a single output), or a table of
        names with [n_times] or [n_times][size] numbers each. The shape is checked and never changed: of SciPy's solve_ivp
        return `sol.y.T`. A solver with states returns them and the state at the end: `outputs, state`."""
        raise NotImplementedError


class Served:
    """A solver with its declarations checked."""

    def __init__(self, solver: Union[Solver, Type[Solver]]) -> None:
        if inspect.isclass(solver):
            solver = solver()
        if not isinstance(solver, Solver):
            raise DeclarationError(
                f"{solver!r} is no solver: derive its class from starlings.Solver or decorate it with starlings.solver"
            )
        self.solver: Solver = solver
        self.form = _form(solver)
        self.name = solver.name or type(solver).__name__.lower()
        self.says = solver.says or _first_sentence(type(solver).__doc__ or "")
        self.parameters = Layout("parameters", solver.parameters)
        self.states = Layout("states", solver.states)
        self.outputs = Layout("outputs", solver.outputs)
        self.inputs = Layout("inputs", solver.inputs)
        self.restart = len(self.states) > 0
        self._check_sizes()
        self.measures = self._measures()
        self.plain = _overrides(solver, "output") is False and self.form != "run"
        self.observers = self._observers()
        self.kinds = list(self.observers) + [o for o in solver.observers if isinstance(o, str)]
        self.hosts = self._hosts()

    def _check_sizes(self) -> None:
        if not len(self.outputs):
            raise DeclarationError(f"`{self.name}` declares no outputs: nothing of it could be observed")
        if self.form != "run" and not len(self.states):
            raise DeclarationError(f"`{self.name}` has `{self.form}` and declares no states")
        dt = self.solver.dt
        if dt is not None and not (dt > 0.0 and math.isfinite(dt)):
            raise DeclarationError(f"`{self.name}`: `dt` is {dt}, expected a positive number")
        if self.form == "rate" and dt is None:
            raise DeclarationError(f"`{self.name}` has `rate`: give the longest step as `dt`, in study time")

    def _measures(self) -> Dict[str, str]:
        for output, state in self.solver.measures.items():
            if output not in self.outputs or state not in self.states:
                raise DeclarationError(
                    f"`measures` says `{output}` shows `{state}`; outputs: {self.outputs.told()}; "
                    f"states: {self.states.told()}"
                )
            if self.outputs.of(output).size != self.states.of(state).size:
                raise DeclarationError(f"`measures`: `{output}` and `{state}` have different sizes")
        missing = [name for name in self.outputs.names() if name not in self.solver.measures]
        if self.form != "run" and not _overrides(self.solver, "output") and missing:
            raise DeclarationError(
                f"`{self.name}` defines no `output`, and `measures` does not say which state is `{missing[0]}`"
            )
        return dict(self.solver.measures)

    def _observers(self) -> Dict[str, Observer]:
        found: Dict[str, Observer] = {}
        given = [o for o in self.solver.observers if isinstance(o, Observer)]
        if self.form != "run":
            named = [o for o in self.solver.observers if isinstance(o, str)]
            if named:
                raise DeclarationError(
                    f"`{self.name}`: the observer `{named[0]}` is only a name; give an Observer"
                )
            if self.measures and not any(o.kind == "nudging" for o in given):
                given.append(Observer.nudging())
        for observer in given:
            if observer.kind in found or not observer.kind:
                raise DeclarationError(
                    f"`{self.name}` has two observers of kind `{observer.kind}`, or one of none"
                )
            observer.check(self.outputs, self.states, self.measures)
            found[observer.kind] = observer
        return found

    def _hosts(self) -> List[str]:
        scalars = [q.name for q in self.states.quantities if q.size == 1]
        if self.form == "rate":
            return scalars
        for name in self.solver.hosts:
            if name not in scalars:
                raise DeclarationError(
                    f"`hosts`: `{name}` is no scalar state; there are {', '.join(scalars) or 'none'}"
                )
        return list(self.solver.hosts)


def solver(
    *,
    parameters: Quantities = (),
    states: Quantities = (),
    outputs: Quantities = (),
    inputs: Quantities = (),
    measures: Optional[Mapping[str, str]] = None,
    observers: Sequence[Union[Observer, str]] = (),
    hosts: Sequence[str] = (),
    dt: Optional[float] = None,
    name: str = "",
    says: str = "",
    deterministic: bool = True,
) -> Callable[[Any], Type[Solver]]:
    """Makes a solver of a class with `rate`, `step` or `run`, or of a function `run(window)`.

    The arguments are the attributes of `Solver`.
    """

    def decorate(what: Any) -> Type[Solver]:
        declared: Dict[str, Any] = {
            "parameters": parameters,
            "states": states,
            "outputs": outputs,
            "inputs": inputs,
            "measures": dict(measures or {}),
            "observers": observers,
            "hosts": hosts,
            "dt": dt,
            "name": name or what.__name__.lower(),
            "says": says,
            "deterministic": deterministic,
            "__doc__": what.__doc__,
            "__module__": what.__module__,
        }
        if inspect.isclass(what):
            bases = (what,) if issubclass(what, Solver) else (what, Solver)
            return type(what.__name__, bases, declared)

        def run(self: Any, window: Window) -> Any:
            return what(window)

        # Where a message names the line that returned something, it is that of the function itself.
        run.__wrapped__ = what  # type: ignore[attr-defined]
        declared["run"] = run
        return type(what.__name__, (Solver,), declared)

    return decorate


def _overrides(solver: Solver, method: str) -> bool:
    return getattr(type(solver), method) is not getattr(Solver, method)


def _form(solver: Solver) -> str:
    forms = [form for form in ("rate", "step", "run") if _overrides(solver, form)]
    if len(forms) != 1:
        told = " and ".join(f"`{form}`" for form in forms) or "none of them"
        raise DeclarationError(
            f"a solver defines one of `rate`, `step` and `run`; `{type(solver).__name__}` defines {told}"
        )
    return forms[0]


def _first_sentence(text: str) -> str:
    first = " ".join(inspect.cleandoc(text).split("\n\n")[0].split())
    return first
