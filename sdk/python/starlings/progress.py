"""Where a command stands: one bar in a notebook or on a terminal, nothing elsewhere.

It takes what the command says of all of its work (docs/watching.md): the share that is done, which never falls here, what is being
done, and the time that is left.
"""

from __future__ import annotations

import sys
from typing import Any, Mapping, Optional

#: Runs after a fit have stages of their own, whose names say nothing to who waits.
_ANALYSES = ("filter", "batch")
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
        bar, share, left_s = self._bar, fields.get("share"), fields.get("left_s")
        if share is not None:
            bar.bar_format, bar.n = _BAR, max(bar.n, 100.0 * min(share, 1.0))
        workers = fields.get("workers")
        words = [f"{workers} worker" + ("" if workers == 1 else "s")] if workers else []
        if left_s is not None:
            words.append(f"about {_time(left_s)} left")
        bar.set_description_str(doing, refresh=False)
        bar.set_postfix_str(", ".join(words), refresh=False)
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


def _time(seconds: float) -> str:
    """A time in its largest unit."""
    for unit, one in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * one:
            return f"{seconds / one:.0f} {unit}"
    return f"{seconds:.0f} s"


def _is_notebook() -> bool:
    """Whether a notebook's kernel runs this, rather than a script or a terminal."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")
