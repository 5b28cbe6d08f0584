"""Reads what `starlings run` leaves in its folder. It plots nothing."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Union

import numpy as np

from .values import Array


@dataclass
class Run:
    """The answer of a study.

    `parameters` has one row per parameter: `unit`, `transform`, `estimate`, `sd`, `lo95`, `hi95`, `mean_transformed`; a
    pandas.DataFrame indexed by name where pandas is installed, else a table of arrays with the names in "parameter".
    `covariance` is that of the transformed parameters, [n_param][n_param]; see `covariance_table`. `summary` is all of
    summary.json.
    """

    folder: Path
    summary: Dict[str, Any]
    names: List[str]
    parameters: Any
    covariance: Array

    def __getitem__(self, name: str) -> Dict[str, Any]:
        """Entry of one parameter in the summary: estimate, sd, interval95, prior_median, ..."""
        for entry in self.summary["parameters"]:
            if entry["name"] == name:
                found: Dict[str, Any] = entry
                return found
        raise KeyError(f"no parameter `{name}` in {self.folder}; there are {', '.join(self.names)}")

    @property
    def correlation(self) -> Array:
        """Posterior correlation of the transformed parameters, [n_param][n_param]."""
        return np.asarray(self.summary["correlation"], dtype=np.float64)

    @property
    def warnings(self) -> List[str]:
        """What has to be said with the numbers."""
        return list(self.summary.get("warnings", []))

    def covariance_table(self) -> Any:
        """The covariance as an xarray.DataArray with the names as coordinates. Needs xarray."""
        import xarray

        names = {"parameter": self.names, "with": self.names}
        return xarray.DataArray(self.covariance, dims=("parameter", "with"), coords=names, name="covariance")


def read_run(folder: Union[str, "Path"]) -> Run:
    """Reads summary.json and posterior.csv of a run folder.

    Raises FileNotFoundError where the folder is none of a run, ValueError where a file is not what it should be.
    """
    path = Path(folder)
    for name in ("summary.json", "posterior.csv"):
        if not (path / name).is_file():
            raise FileNotFoundError(f"{path} is no folder of a finished run: it lacks {name}")
    summary = json.loads((path / "summary.json").read_text(encoding="utf-8"))
    with open(path / "posterior.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows or "parameter" not in rows[0]:
        raise ValueError(f"{path / 'posterior.csv'} has no rows of parameters")
    names = [row["parameter"] for row in rows]
    covariance = np.array([[float(row[f"cov:{name}"]) for name in names] for row in rows])
    columns = {key: _column([row[key] for row in rows]) for key in rows[0] if not key.startswith("cov:")}
    return Run(path, summary, names, _table(columns), covariance)


def _column(values: List[str]) -> Any:
    try:
        return np.array([float(value) for value in values])
    except ValueError:
        return np.array(values, dtype=object)


def _table(columns: Dict[str, Any]) -> Any:
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns).set_index("parameter")
