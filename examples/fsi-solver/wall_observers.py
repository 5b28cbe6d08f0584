"""Direct velocity feedback that counts the mass of the blood: an observer of one's own, beside those of the package.

Where the wall moves otherwise than it is seen to, wall and blood are corrected together: the blood by the motion of least kinetic
energy that goes with the wall's. In a heavy fluid that is what velocity data need: `Observer.dvf` weighs the error by the wall's own
mass, a thousandth of what moves.
"""

import numpy as np
from starlings import Observer


class KineticExtension(Observer):
    """(M + g H M H) change of the wall = g H M H (observed - predicted), M = Ms + MA, g = gain dt; the blood follows.

    H is one where the wall's velocity was observed, MA the added mass. Source: Moireau, Chapelle & Le Tallec 2008.
    """

    kind = "dvf-am"

    def __init__(self, mass: np.ndarray, extension: np.ndarray, output: str, state: str) -> None:
        """`mass` is Ms + MA, [n_wall][n_wall]; `extension` the motion of the blood for a unit of each wall velocity."""
        self._mass, self._extension = mass, extension
        self._output, self._state = output, state

    def check(self, outputs, states, measures) -> None:
        self._seen, self._corrected = outputs.slices[self._output], states.slices[self._state]

    def correct(self, at, x):
        error = at.innovation[self._seen]
        seen = np.isfinite(error)
        if not np.any(error[seen]):
            return x
        weight = at.gain * at.dt * self._mass * np.outer(seen, seen)
        wall = np.linalg.solve(self._mass + weight, weight @ np.where(seen, error, 0.0))
        corrected = x.copy()
        corrected[self._corrected] += self._extension @ wall
        return corrected
