"""Where in the solver's own file an exception comes from: people look there, not into this package.

Next file to read: one_run.py.
"""

from __future__ import annotations

import dis
import inspect
import os
import sys
import sysconfig
import traceback
from types import CodeType
from typing import Any, List, Optional

from .failures import Misfit

_OWN = os.path.dirname(os.path.abspath(__file__)) + os.sep
_LIBRARIES = tuple(
    sysconfig.get_paths()[name] + os.sep for name in ("stdlib", "platstdlib", "purelib", "platlib")
)

Frame = traceback.FrameSummary


def told(error: BaseException, solver: Any) -> str:
    """One line for an exception: its kind, its words, and the last line of the solver's own code that it passed."""
    text = " ".join(str(error).split())
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if _is_own(frame)] or _returned(error, solver)
    place = (own or frames)[-1:]
    where = f" ({os.path.basename(place[0].filename)}:{place[0].lineno})" if place else ""
    kind = "ValueError" if isinstance(error, Misfit) else type(error).__name__
    return kind + (f": {text}" if text else "") + where


def show(error: BaseException, solver: Any) -> None:
    """Prints the traceback on standard error, without the lines of this package."""
    shown: Optional[traceback.TracebackException] = traceback.TracebackException.from_exception(error)
    if isinstance(error, Misfit):
        frames = [f"  File \"{f.filename}\", line {f.lineno}, in {f.name}\n    {f.line}\n" for f in _returned(error, solver)]
        print("Traceback (most recent call last):\n" + "".join(frames) + f"ValueError: {error}", file=sys.stderr, flush=True)
        return
    seen: List[traceback.TracebackException] = []
    while shown is not None and shown not in seen:
        seen.append(shown)
        shown.stack[:] = [frame for frame in shown.stack if not frame.filename.startswith(_OWN)]
        shown = shown.__cause__ or shown.__context__
    print("".join(seen[0].format()), end="", file=sys.stderr, flush=True)


def caller() -> str:
    """The place in the solver's file from which this package was called, as the end of a sentence."""
    frame = sys._getframe()
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_OWN):
        frame = frame.f_back
    name = frame.f_code.co_filename
    return "" if name.startswith((_OWN, "<")) else f" ({os.path.basename(name)}:{frame.f_lineno})"


def _is_own(frame: Frame) -> bool:
    return not frame.filename.startswith((_OWN, "<frozen", *_LIBRARIES))


def _returned(error: BaseException, solver: Any) -> List[Frame]:
    """The line of the solver's method that returned what does not fit."""
    if not isinstance(error, Misfit):
        return []
    function = inspect.unwrap(getattr(type(solver), error.method, None) or solver)
    code = getattr(function, "__code__", None)
    if code is None or code.co_filename.startswith(_OWN):
        return []
    return [Frame(code.co_filename, _return_line(code), error.method)]


def _return_line(code: CodeType) -> int:
    """The only line that returns something, or else the first of the function."""
    starts = dict(dis.findlinestarts(code))
    line, found = code.co_firstlineno, set()
    for instruction in dis.get_instructions(code):
        line = starts.get(instruction.offset) or line
        if instruction.opname.startswith("RETURN_") and instruction.opname != "RETURN_GENERATOR":
            found.add(line)
    return found.pop() if len(found) == 1 else code.co_firstlineno
