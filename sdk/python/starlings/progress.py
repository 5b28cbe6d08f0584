"""Where a command stands: a bar in a notebook or on a terminal, nothing elsewhere."""

from __future__ import annotations

import sys
from typing import Any, Mapping, Optional


class Progress:
    """Follows the records of a command. Shown where somebody looks, or as `wanted` says."""

    def __init__(self, title: str, wanted: Optional[bool]) -> None:
        self._title = title
        self._wanted = _is_notebook() or sys.stderr.isatty() if wanted is None else wanted
        self._bar: Any = None

    def show(self, fields: Mapping[str, Any]) -> None:
        """Takes a record: a bar of analyses where they are counted, a counter of runs of the model elsewhere."""
        if not self._wanted or fields.get("event") != "progress":
            return
        if self._bar is None:
            from tqdm.auto import tqdm

            self._bar = tqdm(total=fields.get("steps"), leave=False, unit=_unit(fields))
        bar, steps = self._bar, fields.get("steps")
        if steps is not None and bar.total != steps:
            bar.reset(total=steps)
        bar.set_description_str(self._description(fields), refresh=False)
        bar.set_postfix_str(f"{fields.get('workers', 0)} workers", refresh=False)
        bar.n = fields.get("step", fields.get("runs", fields.get("blocks", 0)))
        bar.refresh()

    def close(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()

    def _description(self, fields: Mapping[str, Any]) -> str:
        stage, number, of = fields.get("stage", ""), fields.get("pass"), fields.get("passes")
        if number is None:
            return f"{self._title}: {stage}"
        return f"{self._title}: {stage}, pass {number}" + (f"/{of}" if of else "")


def _unit(fields: Mapping[str, Any]) -> str:
    if "steps" in fields:
        return " analyses"
    return " blocks" if "blocks" in fields else " runs"


def _is_notebook() -> bool:
    """Whether a notebook's kernel runs this, rather than a script or a terminal."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")
