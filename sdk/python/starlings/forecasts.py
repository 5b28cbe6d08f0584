"""What `starlings forecast` answers, of a run or an inference.

Next file to read: run_folder.py, or answers.py.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

from . import page
from .program import call
from .tables import read_columns, table

#: A folder or a file.
Place = Union[str, "os.PathLike[str]"]


@dataclass
class Forecast:
    """An ensemble from a posterior."""

    result: Dict[str, Any]
    folder: Path

    @property
    def fan(self) -> Any:
        """Quantiles by output, kind (`quantity`, or `measured` with errors) and time."""
        return table(read_columns((self.folder / "fan.csv").read_text(encoding="utf-8")))

    @property
    def levels(self) -> List[Dict[str, Any]]:
        """Per level: probability, median, interval90, ..."""
        return list(self.result["levels"])

    @property
    def warnings(self) -> List[str]:
        """What has to be said with the numbers."""
        return list(self.result.get("warnings", []))

    def _repr_html_(self) -> str:
        return page.frame(self.folder / "report.html")


def forecast(
    source: Path,
    options: Mapping[str, Any],
    members: int,
    levels: Sequence[str],
    set: Optional[Mapping[str, float]],  # noqa: A002  (the name that the command has)
    out: Optional[Place],
    progress: Optional[bool],
) -> Forecast:
    """Runs the command on the folder of a run or an inference; options that are None are left out."""
    folder = Path(out) if out is not None else source / "forecast"
    words = ["forecast", str(source), "--members", str(members), "--out", str(folder)]
    words += [word for key, value in options.items() if value is not None for word in (f"--{key}", str(value))]
    words += [word for level in levels for word in ("--level", level)]
    words += [word for key, value in (set or {}).items() for word in ("--set", f"{key}={value!r}")]
    return Forecast(call(words, progress), folder)
