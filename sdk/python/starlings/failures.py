"""Why a run gave no prediction, and why a solver cannot be served.

Next file to read: run.py.
"""

from __future__ import annotations

import os
import sysconfig
import traceback
from typing import Optional

#: The three kinds of failure, by the names of the wire.
SOLVER, NOT_FINITE, BAD_REQUEST = "SOLVER", "NOT_FINITE", "BAD_REQUEST"


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


class BadRequest(ValueError):
    """A request does not fit the solver; the text says how."""


class Cancelled(Exception):
    """Nobody waits for the run any more."""


class Failed(Exception):
    """A run that gave no prediction: kind, one sentence, and the study time where known."""

    def __init__(self, kind: str, text: str, time: Optional[float] = None) -> None:
        super().__init__(text)
        self.kind = kind
        self.text = text
        self.time = time


_OWN = os.path.dirname(os.path.abspath(__file__)) + os.sep
_LIBRARIES = tuple(
    sysconfig.get_paths()[name] + os.sep for name in ("stdlib", "platstdlib", "purelib", "platlib")
)


def told(error: BaseException) -> str:
    """One line for an exception: its kind, its words, and the last line of the solver's own code that it passed."""
    text = " ".join(str(error).split())
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if not f.filename.startswith((_OWN, "<frozen", *_LIBRARIES))]
    place = (own or frames)[-1:]
    where = f" ({os.path.basename(place[0].filename)}:{place[0].lineno})" if place else ""
    return type(error).__name__ + (f": {text}" if text else "") + where
