"""Why a run gave no prediction, and why a solver cannot be served.

Next file to read: places.py.
"""

from __future__ import annotations

from typing import Optional

#: The kinds of failure, by the names of the wire.
SOLVER, NOT_FINITE, BAD_REQUEST = "SOLVER", "NOT_FINITE", "BAD_REQUEST"
OUTSIDE_DOMAIN, UNAVAILABLE = "OUTSIDE_DOMAIN", "UNAVAILABLE"


class DeclarationError(ValueError):
    """What a solver says of itself does not fit together; the text says what."""


class NotFinite(ArithmeticError):
    """A quantity stopped being a finite number. A solver may raise it itself.

    `what` names the quantity; `time` is the study time, where known.
    """

    def __init__(self, what: str, time: Optional[float] = None) -> None:
        super().__init__(what if time is None else f"{what} at time {time:g}")
        self.what = what
        self.time = time


class OutsideDomain(ArithmeticError):
    """The model has no solution for these parameters, such as no convergence. A solver raises it itself; the text says how."""


class Unavailable(Exception):
    """The solver cannot compute here and now, such as a refused licence. A solver raises it itself; the text says why.

    It says nothing of the parameters: the run is made elsewhere or later.
    """


class BadRequest(ValueError):
    """A request does not fit the solver; the text says how."""


class Misfit(ValueError):
    """What a method of a solver returned has the wrong shape or kind; the text says which and what to do.

    `method` is the method's name, by which its place in the solver's file is found.
    """

    def __init__(self, method: str, text: str) -> None:
        super().__init__(text)
        self.method = method


class Cancelled(Exception):
    """Nobody waits for the run any more."""


class Failed(Exception):
    """A run that gave no prediction: kind, one sentence, and the study time where known."""

    def __init__(self, kind: str, text: str, time: Optional[float] = None) -> None:
        super().__init__(text)
        self.kind = kind
        self.text = text
        self.time = time
