"""What commands answer, besides `run`: their results with the fields that are asked for most, and their pages.

Every class has `result`, all that the command says, as in the JSON files of docs.
"""

from __future__ import annotations

import html
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from . import page
from .forecasts import Forecast, Place, forecast
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
    #: The study file, where it is not the one that the folder remembers.
    study: Optional[Path] = None

    @property
    def coefficients(self) -> Any:
        """By coefficient of the drift: estimate, sd and interval."""
        return table(_columns(self.folder / "coefficients.csv"))

    @property
    def warnings(self) -> List[str]:
        """What has to be said with the numbers."""
        return list(self.result.get("warnings", []))

    def forecast(
        self,
        *,
        until: Optional[float] = None,
        step: Optional[float] = None,
        members: int = 200,
        levels: Sequence[str] = (),
        horizon: Optional[float] = None,
        record: Optional[str] = None,
        seed: Optional[int] = None,
        set: Optional[Dict[str, float]] = None,  # noqa: A002  (the name that the command has)
        workers: Optional[int] = None,
        out: Optional[Place] = None,
        progress: Optional[bool] = None,
    ) -> Forecast:
        """What comes after the last row that was inferred from, up to `until`, in steps of `step`, in the study's unit of time; `levels` are
        such as "x1>20". Coefficients and noise are drawn from the posterior."""
        options = {"until": until, "step": step, "horizon": horizon, "record": record, "seed": seed, "workers": workers}
        return forecast(self.folder, {**options, "study": self.study}, members, levels, set, out, progress)

    def _repr_html_(self) -> str:
        return page.frame(self.folder / "report.html")


@dataclass
class Diagnosis:
    """Whether a recording shows a fault, since when, of which scenario and how severe."""

    result: Dict[str, Any]
    folder: Path

    @property
    def verdict(self) -> str:
        """`no-fault`, `named`, `undecided` or `unexplained`: docs/diagnose.md says when each is given."""
        return str(self.result["verdict"])

    @property
    def says(self) -> str:
        """The answer in a sentence."""
        return str(self.result["says"])

    @property
    def named(self) -> List[str]:
        """Names of the scenarios that are left, the likeliest first; empty without a fault."""
        return [str(name) for name in self.result["named"]]

    @property
    def since(self) -> Optional[float]:
        """First time of the stretch that departs from the model without a fault, in the study's unit of time; None where none does."""
        seen = self.result["alarm"]["seen"]
        return float(seen["since"]) if seen is not None else None

    @property
    def scenarios(self) -> Any:
        """By scenario, in the order of the study: probability among the library, `log_bayes_factor` over no fault, `misfit` in units of
        the noise variance, `explains`, and the severity with its sd and 90 % interval in its own unit; NaN where it cannot be run."""
        rows = [_scenario(row) for row in self.result["scenarios"]]
        return table({key: [row[key] for row in rows] for key in rows[0]}, "name")

    @property
    def parameters(self) -> Any:
        """By scenario and parameter: estimate, sd and 90 % interval at the stated noise, each in the parameter's unit."""
        return table(_columns(self.folder / "scenarios.csv"))

    @property
    def warnings(self) -> List[str]:
        """What has to be said with the answer."""
        return list(self.result.get("warnings", []))

    def _repr_html_(self) -> str:
        return page.frame(self.folder / "report.html")


def _scenario(row: Dict[str, Any]) -> Dict[str, Any]:
    """A row of the table of scenarios."""
    nan = float("nan")
    number = {key: nan if row[key] is None else float(row[key]) for key in ("log_bayes_factor", "misfit")}
    severity: Dict[str, Any] = next((entry for entry in row["parameters"] if entry["is_severity"]), {})
    lo, hi = severity.get("interval90", (nan, nan))
    return {
        "name": row["name"],
        "probability": float(row["probability"]),
        **number,
        "explains": bool(row["explains"]),
        "severity": float(severity.get("estimate", nan)),
        "severity_sd": float(severity.get("sd", nan)),
        "severity_lo90": float(lo),
        "severity_hi90": float(hi),
    }


def _columns(file: Path) -> Dict[str, Any]:
    return read_columns(file.read_text(encoding="utf-8"))
