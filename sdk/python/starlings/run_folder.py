"""What `starlings run` leaves in its folder.

Next file to read: posterior.py, for draws.
"""

from __future__ import annotations

import csv
import json
import os
import sqlite3
import tempfile
import urllib.parse
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Union

import numpy as np

from . import page, posterior
from .forecasts import Forecast, Place, forecast
from .program import StudyError, output
from .resolved import resolved
from .study_file import Study
from .tables import column, read_columns, table
from .values import Array


@dataclass
class Run:
    """The answer of a study.

    `parameters` has one row per parameter: `unit`, `transform`, `estimate`, `sd`, `lo95`, `hi95`, `mean_transformed`; a
    pandas.DataFrame indexed by name where pandas is installed, else a table of arrays with the names in "parameter".
    `covariance` is that of the transformed parameters, [n_param][n_param], and `mean` their mean; see `covariance_table`.
    `summary` is all of summary.json. In a notebook it shows its report.
    """

    folder: Path
    summary: Dict[str, Any]
    names: List[str]
    parameters: Any
    covariance: Array
    mean: Array
    transforms: List[str]
    #: The study file, where it is not the one that the folder remembers.
    study: Optional[Path] = None

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

    @property
    def report(self) -> Path:
        """The page with all figures."""
        return self.folder / "report.html"

    def draws(self, n: int = 1000, seed: int = 0) -> Any:
        """Draws of the parameters from the posterior at the stated noise, in their units: a pandas.DataFrame with a column per
        parameter where pandas is installed, else a table of arrays, [n] each. The same seed gives the same draws."""
        drawn = posterior.draw(self.mean, self.covariance, self.transforms, n, seed)
        return table({name: drawn[:, k] for k, name in enumerate(self.names)})

    def table(self, name: str) -> Any:
        """A table of the run folder: "estimates" (every parameter after every analysis), "innovations", "predictions" (the run
        with the estimate beside what was observed), "analyses", "jobs", "events"."""
        return table(self.columns(name))

    def columns(self, name: str) -> Dict[str, Array]:
        """The same as arrays by name."""
        return read_columns(output(["export", str(self.folder), "--table", name]))

    def forecast(
        self,
        *,
        members: int = 200,
        until: Optional[float] = None,
        step: Optional[float] = None,
        levels: Sequence[str] = (),
        horizon: Optional[float] = None,
        record: Optional[str] = None,
        seed: Optional[int] = None,
        set: Optional[Dict[str, float]] = None,  # noqa: A002  (the name that the command has)
        workers: Optional[int] = None,
        out: Optional[Place] = None,
        progress: Optional[bool] = None,
    ) -> Forecast:
        """Quantiles against time, and when a quantity crosses a level ("pressure>5"), of an ensemble from the posterior. `until`, `horizon` and
        `step`, the spacing of times after the record's end, are in the study's unit of time."""
        options = {"until": until, "step": step, "horizon": horizon, "record": record, "seed": seed, "workers": workers}
        return forecast(self.folder, {**options, "study": self.study}, members, levels, set, out, progress)

    def to_arviz(self, draws: int = 1000, chains: int = 4, seed: int = 0, *, predictive: bool = False) -> Any:
        """The run as ArviZ takes it: posterior, observed data, and the run with the estimate. Needs arviz.

        With `predictive` also draws of the posterior predictive and the log likelihood of every fitted value, for `arviz.plot_ppc` and
        `arviz.loo`. That runs the model around the estimate as `starlings.identify` does: predictions are those of the model to
        first order in the transformed parameters, as the posterior is, with the noise that the study states.
        """
        from .inference_data import of_run

        return of_run(self, draws, chains, seed, predictive)

    def study_file(self) -> Path:
        """The study file of the run: `study` where that is named, else where it was when it was run."""
        return self.study if self.study is not None else Path(json.loads(self._remembered("info"))["file"])

    @contextmanager
    def as_it_ran(self) -> Iterator[Path]:
        """The study as it ran, as a file: where it stands, or, where that was changed since, one that is gone afterwards.

        Raises StudyError where its recordings cannot be found, since the study is not where it was.
        """
        place, text = self.study_file(), self._remembered("study")
        if not place.is_file():
            raise StudyError(
                f"the study of {self.folder} stood at {place}, and is not there: set `study` of the run to where it and its recordings are"
            )
        if place.read_text(encoding="utf-8") == text:
            yield place
            return
        with tempfile.TemporaryDirectory() as scratch:
            yield resolved(Study.of_text(text, place)).save(scratch)

    def _remembered(self, key: str) -> str:
        """What the store of the run has under a key."""
        database = f"file:{urllib.parse.quote(str(self.folder / 'run.db'))}?mode=ro"
        with closing(sqlite3.connect(database, uri=True)) as store:
            (text,) = store.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        return str(text)

    def save(
        self, file: Union[str, "os.PathLike[str]"], *, draws: int = 4000, chains: int = 4, seed: int = 0
    ) -> Path:
        """Writes draws of the posterior: `.nc` as InferenceData of `to_arviz`, which `arviz.from_netcdf` reads; `.parquet` or `.csv` with a
        column per parameter. Needs arviz, or pyarrow. A file that is there is replaced."""
        path = Path(file)
        if path.suffix == ".nc":
            self.to_arviz(draws, chains, seed).to_netcdf(str(path))
            return path
        drawn = posterior.draw(self.mean, self.covariance, self.transforms, draws, seed)
        columns = {name: drawn[:, k] for k, name in enumerate(self.names)}
        if path.suffix == ".parquet":
            import pyarrow
            from pyarrow import parquet

            parquet.write_table(pyarrow.table(columns), path)
        elif path.suffix == ".csv":
            np.savetxt(path, drawn, fmt="%.17g", delimiter=",", header=",".join(self.names), comments="")
        else:
            raise ValueError(f"{path}: a posterior is saved as .nc, .parquet or .csv")
        return path

    def _repr_html_(self) -> str:
        return page.frame(self.report)

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
    columns = {key: column([row[key] for row in rows]) for key in rows[0] if not key.startswith("cov:")}
    # A unit may be written as a number: "1" stays text.
    columns["unit"] = np.array([row.get("unit", "") for row in rows], dtype=object)
    transforms = [row.get("transform", "linear") for row in rows]
    means = np.array([float(row["mean_transformed"]) for row in rows])
    return Run(path, summary, names, table(columns, "parameter"), covariance, means, transforms)
