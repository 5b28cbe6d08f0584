"""What commands answer, besides `run`: their results with the fields that are asked for most, and their pages.

Every class has `result`, all that the command says, as in the JSON files of docs.
"""

from __future__ import annotations

import html
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional

from . import page
from .study_file import Study
from .tables import read_columns, table


@dataclass
class Checked:
    """A study that is sound."""

    result: Dict[str, Any]

    @property
    def warnings(self) -> List[str]:
        """What is doubtful about it."""
        return list(self.result.get("warnings", []))

    @property
    def trial(self) -> Any:
        """One run with the prior medians: record, output, observations, rmse, noise."""
        rows = self.result.get("trial", [])
        return table({key: [row[key] for row in rows] for key in (rows[0] if rows else {})})


@dataclass
class Explanation:
    """What a model lacks."""

    result: Dict[str, Any]
    folder: Path

    @property
    def verdict(self) -> str:
        """`named`, `tied`, `unexplained`, `no-gap`, ...: the values are those of docs/explain.md."""
        return str(self.result["verdict"])

    @property
    def headline(self) -> str:
        """The answer in a sentence or three."""
        return str(self.result["headline"])

    @property
    def effects(self) -> List[str]:
        """Names of the effects that were added."""
        return [str(effect["name"]) for effect in self.result["effects"]]

    @property
    def gap(self) -> Any:
        """By record and channel: root mean square error before and after, and the noise."""
        rows = self.result["gap"]
        return table({key: [row[key] for row in rows] for key in (rows[0] if rows else {})})

    @property
    def warnings(self) -> List[str]:
        """What has to be said with the answer."""
        return list(self.result.get("warnings", []))

    @property
    def study(self) -> Optional[Study]:
        """The study with the effect in it, to be run; None where nothing was named."""
        file = self.result.get("explained_study")
        return Study.read(self.folder / file) if file else None

    def _repr_html_(self) -> str:
        return page.frame(self.folder / "report.html")


@dataclass
class Identification:
    """What these data could determine."""

    result: Dict[str, Any]
    html: Optional[str] = None

    @property
    def advice(self) -> str:
        """Whether the estimation is reasonable."""
        return str(self.result["advice"])

    @property
    def parameters(self) -> Any:
        """By parameter: value, prior sd, expected sd, ..."""
        rows = self.result["parameters"]
        return table({key: [row[key] for row in rows] for key in rows[0]}, "name")

    def _repr_html_(self) -> str:
        return page.of_text(self.html) if self.html else f"<p>{html.escape(self.advice)}</p>"


@dataclass
class Inference:
    """Drift and noise of stochastic equations."""

    result: Dict[str, Any]
    folder: Path

    @property
    def coefficients(self) -> Any:
        """By coefficient of the drift: estimate, sd and interval."""
        return table(_columns(self.folder / "coefficients.csv"))

    @property
    def warnings(self) -> List[str]:
        """What has to be said with the numbers."""
        return list(self.result.get("warnings", []))

    def _repr_html_(self) -> str:
        return page.frame(self.folder / "report.html")


@dataclass
class Forecast:
    """An ensemble from a posterior."""

    result: Dict[str, Any]
    folder: Path

    @property
    def fan(self) -> Any:
        """Quantiles by output, kind (`quantity`, or `measured` with errors) and time."""
        return table(_columns(self.folder / "fan.csv"))

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


def _columns(file: Path) -> Dict[str, Any]:
    return read_columns(file.read_text(encoding="utf-8"))
