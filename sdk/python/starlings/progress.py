"""Where a command stands: one bar in a notebook or on a terminal, nothing elsewhere.

It takes what the command says of all of its work (docs/watching.md): the share that is done, which never falls here, what is being
done, and the time that is left.
"""

from __future__ import annotations

import re
import sys
from typing import Any, Mapping, Optional

#: Runs after a fit have stages of their own, whose names say nothing to who waits.
_ANALYSES = ("filter", "batch")
#: The share and the time left at the end of a sentence, of a program that tells them in words only.
_SHARE = re.compile(r", (?P<percent>\d+) %")
_LEFT = re.compile(r"about (?P<time>\d+ \w+) left")
#: A bar once a share is known, a sentence before.
_BAR, _SENTENCE = "{desc} {percentage:3.0f}%|{bar}| {elapsed}{postfix}", "{desc}, {elapsed}{postfix}"


class Progress:
    """Follows the records of a command. Shown where somebody looks, or as `wanted` says."""

    def __init__(self, title: str, wanted: Optional[bool]) -> None:
        self._title = title
        self._wanted = _is_notebook() or sys.stderr.isatty() if wanted is None else wanted
        self._bar: Any = None

    def show(self, fields: Mapping[str, Any]) -> None:
        """Takes a record. Those of the fleet have the same event and no stage: they count the runs of one analysis."""
        if not self._wanted or fields.get("event") != "progress" or not fields.get("stage"):
            return
        doing = f"{self._title}: {_doing(fields)}"
        if self._bar is None:
            from tqdm.auto import tqdm

            self._bar = tqdm(desc=doing, total=100.0, leave=False, bar_format=_SENTENCE)
        bar, share = self._bar, _share(fields)
        if share is not None:
            bar.bar_format, bar.n = _BAR, max(bar.n, 100.0 * min(share, 1.0))
        workers = fields.get("workers")
        words = [f"{workers} worker" + ("" if workers == 1 else "s")] if workers else []
        left = _left(fields)
        bar.set_description_str(doing, refresh=False)
        bar.set_postfix_str(", ".join([*words, *([f"about {left} left"] if left else [])]), refresh=False)
        bar.refresh()

    def close(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()


def _doing(fields: Mapping[str, Any]) -> str:
    """What is being done, in a few words."""
    stage, step, steps = fields["stage"], fields.get("step"), fields.get("steps")
    if step is None:
        counted = next((f", {fields[what]} {what}" for what in ("runs", "blocks") if fields.get(what)), "")
        return f"{stage}{counted}"
    if stage not in _ANALYSES:
        return f"after the fit, {step} of {steps}"
    if stage == "batch":
        # A batch fit ends where it has converged; its steps are those that it may take at most.
        return f"batch fit, iteration {step}"
    passes = f"/{fields['passes']}" if fields.get("passes") else ""
    return f"pass {fields.get('pass', 1)}{passes}, {step} of {steps} analyses"


def _share(fields: Mapping[str, Any]) -> Optional[float]:
    """The share of all work that is done, from 0 to 1, where it is known."""
    if fields.get("share") is not None:
        return float(fields["share"])
    if fields.get("done") is not None and fields.get("total"):
        return float(fields["done"]) / float(fields["total"])
    told = _SHARE.search(str(fields.get("message", "")))
    return float(told["percent"]) / 100.0 if told else None


def _left(fields: Mapping[str, Any]) -> str:
    """The time that is left, in words; empty where it is not known."""
    left = fields.get("left_s")
    if left is None:
        told = _LEFT.search(str(fields.get("message", "")))
        return told["time"] if told else ""
    for unit, seconds in (("h", 3600.0), ("min", 60.0)):
        if left >= 1.5 * seconds:
            return f"{left / seconds:.0f} {unit}"
    return f"{max(float(left), 0.0):.0f} s"


def _is_notebook() -> bool:
    """Whether a notebook's kernel runs this, rather than a script or a terminal."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")
