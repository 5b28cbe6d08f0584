"""Observers inside a run: corrections of the state towards what was observed (Luenberger 1971).

A run predicts, records, and only then corrects: an observer never sees a datum before the prediction of the same time stands.
On noise-free data of the true model it changes nothing, and with gain 0 it is not even called. Each correction is the step of
d/dt error = -gain * feedback over the time since the previous observation, in an exponential or implicit form that no gain
makes unstable. Next file to read: one_run.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from .failures import DeclarationError
from .matrices import Matrix, MatrixOf, Places, added, evaluated, extension, factor
from .quantity import Layout
from .values import Array, Values


@dataclass(frozen=True)
class Correction:
    """What an observer corrects with: one observation time."""

    #: Gain, 1/study time.
    gain: float
    #: Time since the previous observation or since the start of the window; positive.
    dt: float
    #: Observed minus predicted, for every component of every declared output; NaN where nothing was observed.
    innovation: Array
    #: The same for every component of the state that is itself observed, else NaN.
    of_state: Array
    p: Values


class Observer:
    """Corrects a state. Make one with `Observer.nudging`, `Observer.sdf` or `Observer.dvf`, or derive from this class."""

    #: The `kind` by which a study names it.
    kind = ""

    def check(self, outputs: Layout, states: Layout, measures: Dict[str, str]) -> None:
        """Finds its places. Raises DeclarationError where the solver lacks them."""

    def correct(self, at: Correction, x: Array) -> Array:
        """The corrected state; `x` itself stays as it is."""
        raise NotImplementedError

    @staticmethod
    def nudging() -> Observer:
        """Each observed output pulls the state that it measures."""
        return _Nudging()

    @staticmethod
    def sdf(
        stiffness: MatrixOf,
        observed_dofs: Optional[Sequence[int]] = None,
        *,
        output: Optional[str] = None,
        state: Optional[str] = None,
        fixed_dofs: Sequence[int] = (),
    ) -> Observer:
        """Schur displacement feedback: observed displacements pull the whole body along its own elastic extension.

        d/dt displacement = velocity + gain * Ext (observed - predicted), where Ext is the displacement of least elastic
        energy with given values on the observed degrees of freedom: the identity there and -K_uu^-1 K_uo elsewhere.

        `stiffness`: the n × n stiffness matrix of the displacement state, or a function of the parameters that gives it.
        `observed_dofs`: the degree of freedom that each component of the output shows; by default component i shows i.
        `output`, `state`: their names; by default the ones with role "displacement".
        `fixed_dofs`: degrees of freedom whose displacement is prescribed; they stay as they are.

        Source: Moireau, Chapelle & Le Tallec 2009.
        """
        return _Sdf(stiffness, observed_dofs, output, state, fixed_dofs)

    @staticmethod
    def dvf(
        mass: MatrixOf,
        observed_dofs: Optional[Sequence[int]] = None,
        *,
        solid_mass: Optional[MatrixOf] = None,
        output: Optional[str] = None,
        state: Optional[str] = None,
        fixed_dofs: Sequence[int] = (),
    ) -> Observer:
        """Direct velocity feedback: a damping force on the observed degrees of freedom.

        M d/dt velocity = ... + gain * H^T Ms H (observed - predicted), with M = `mass` and Ms = `solid_mass`, by default the
        same. The other arguments are those of `sdf`, for the velocity.

        Source: Moireau, Chapelle & Le Tallec 2008.
        """
        return _Dvf(mass, solid_mass, observed_dofs, output, state, fixed_dofs)


class _Nudging(Observer):
    """Direct state feedback: 1 - exp(-gain dt) of the innovation (Hoke & Anthes 1976)."""

    kind = "nudging"

    def __init__(self) -> None:
        self._pairs: List[Tuple[slice, slice]] = []

    def check(self, outputs: Layout, states: Layout, measures: Dict[str, str]) -> None:
        if not measures:
            raise DeclarationError("the observer `nudging` needs `measures`: which output shows which state")
        self._pairs = [(outputs.slices[o], states.slices[s]) for o, s in measures.items()]

    def correct(self, at: Correction, x: Array) -> Array:
        total, count = np.zeros(x.size), np.zeros(x.size)
        for output, state in self._pairs:
            seen = np.isfinite(at.innovation[output])
            total[state] += np.where(seen, at.innovation[output], 0.0)
            count[state] += seen
        seen = np.isfinite(at.of_state)
        total += np.where(seen, at.of_state, 0.0)
        count += seen
        # Several channels of one state pull as many times as fast, towards the mean of their innovations.
        pull = -np.expm1(-count * at.gain * at.dt)
        return np.where(count > 0, x + pull * total / np.maximum(count, 1), x)


class _Places(Observer):
    """What SDF and DVF share: which degrees of freedom are observed."""

    role = ""

    def __init__(
        self,
        observed_dofs: Optional[Sequence[int]],
        output: Optional[str],
        state: Optional[str],
        fixed_dofs: Sequence[int],
    ) -> None:
        self._dofs = None if observed_dofs is None else np.asarray(observed_dofs, dtype=np.intp).reshape(-1)
        self._output, self._state = output, state
        self._fixed = np.asarray(fixed_dofs, dtype=np.intp).reshape(-1)
        self._rows = slice(0, 0)
        self._part = slice(0, 0)
        self._kept: Optional[Tuple[bytes, Any]] = None

    def check(self, outputs: Layout, states: Layout, measures: Dict[str, str]) -> None:
        output, state = self._of(outputs, self._output), self._of(states, self._state)
        self._rows, self._part = outputs.slices[output], states.slices[state]
        n, m = states.of(state).size, outputs.of(output).size
        dofs = np.arange(n) if self._dofs is None else self._dofs
        if len(dofs) != m:
            raise DeclarationError(
                f"the observer `{self.kind}`: the output `{output}` has {m} components, and {len(dofs)} observed "
                "degrees of freedom are named; name one per component in `observed_dofs`"
            )
        both = np.concatenate([dofs, self._fixed])
        if both.size and (both.min() < 0 or both.max() >= n):
            raise DeclarationError(
                f"the observer `{self.kind}`: the state `{state}` has degrees of freedom 0 to {n - 1}, and "
                f"{int(both.max()) if both.max() >= n else int(both.min())} is named"
            )
        self._dofs = dofs

    def _of(self, layout: Layout, name: Optional[str]) -> str:
        if name is not None:
            if name not in layout:
                raise DeclarationError(
                    f"the observer `{self.kind}`: no `{name}` among the {layout.what}: {layout.told()}"
                )
            return name
        found = [q.name for q in layout.quantities if q.role == self.role]
        if len(found) != 1:
            raise DeclarationError(
                f'the observer `{self.kind}` takes the one of the {layout.what} with role "{self.role}", and '
                f"{len(found)} have it: give its name as `{layout.what[:-1]}`"
            )
        return found[0]

    def _seen(self, at: Correction) -> Tuple[Places, Array]:
        """Observed degrees of freedom, increasing, and the mean innovation of each."""
        innovation = at.innovation[self._rows]
        finite = np.isfinite(innovation)
        assert self._dofs is not None, "check comes first"
        dofs, place = np.unique(self._dofs[finite], return_inverse=True)
        total = np.bincount(place, weights=innovation[finite], minlength=dofs.size)
        count = np.bincount(place, minlength=dofs.size)
        # A prescribed degree of freedom is known better than it is observed.
        free = ~np.isin(dofs, self._fixed)
        return dofs[free], (total / np.maximum(count, 1))[free]

    def _remembered(self, key: bytes, make: Callable[[], Any]) -> Any:
        """The last thing made, if for the same key: parameters and observed places hold for a whole run."""
        if self._kept is None or self._kept[0] != key:
            self._kept = (key, make())
        return self._kept[1]


class _Sdf(_Places):
    kind = "sdf"
    role = "displacement"

    def __init__(self, stiffness: MatrixOf, *places: Any) -> None:
        super().__init__(*places)
        self._stiffness = stiffness

    def correct(self, at: Correction, x: Array) -> Array:
        dofs, innovation = self._seen(at)
        if not np.any(innovation):
            return x
        n = self._part.stop - self._part.start

        def make() -> Array:
            return extension(evaluated(self._stiffness, at.p, n, "stiffness"), dofs, self._fixed)

        extended = self._remembered(at.p.array.tobytes() + dofs.tobytes(), make)
        corrected = x.copy()
        corrected[self._part] += -math.expm1(-at.gain * at.dt) * (extended @ innovation)
        return corrected


class _Dvf(_Places):
    kind = "dvf"
    role = "velocity"

    def __init__(self, mass: MatrixOf, solid_mass: Optional[MatrixOf], *places: Any) -> None:
        super().__init__(*places)
        self._mass = mass
        self._solid = mass if solid_mass is None else solid_mass

    def correct(self, at: Correction, x: Array) -> Array:
        """(M + gain dt H^T Ms H) change = gain dt H^T Ms H (observed - predicted): the implicit step."""
        dofs, innovation = self._seen(at)
        if not np.any(innovation):
            return x
        n = self._part.stop - self._part.start
        free = np.setdiff1d(np.arange(n), self._fixed)
        strength = at.gain * at.dt

        def make() -> Tuple[Any, Matrix]:
            solid = evaluated(self._solid, at.p, n, "solid_mass")[dofs][:, dofs]
            mass = evaluated(self._mass, at.p, n, "mass")
            place = np.searchsorted(free, dofs)
            return factor(added(mass[free][:, free], place, solid, strength)), solid

        key = at.p.array.tobytes() + dofs.tobytes() + np.float64(strength).tobytes()
        solve, solid = self._remembered(key, make)
        force = np.zeros(free.size)
        force[np.searchsorted(free, dofs)] = strength * (solid @ innovation)
        corrected = x.copy()
        corrected[self._part.start + free] += solve(force)
        return corrected
