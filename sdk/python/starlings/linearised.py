"""What a fitted model predicts around the estimate of a run, to first order in the transformed parameters.

The posterior of a run is the Gaussian that this model has; next file to read: inference_data.py, which makes predictive draws of it.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Dict

import numpy as np

from .program import call
from .tables import read_columns
from .values import Array

if TYPE_CHECKING:
    from .run_folder import Run


@dataclass
class Linearised:
    """The fitted values of a channel, [n_time] each, and what changes them."""

    time: Array
    observed: Array
    #: The run with the estimate.
    predicted: Array
    #: Standard deviation of the noise as the study states it.
    noise: Array
    #: d predicted / d transformed parameter, [n_time][n_param].
    slopes: Array


def linearised(run: "Run") -> Dict[str, Linearised]:
    """Every channel with fitted values, by `RECORD:OUTPUT`. Runs the model: an ensemble around the estimate, as `identify` makes it."""
    with run.as_it_ran() as study, tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "slopes.csv"
        call(["identify", str(study), "--at", str(run.folder), "--csv", str(file)], False)
        slopes = read_columns(file.read_text(encoding="utf-8"))
    rows = run.columns("predictions")
    found = {}
    for record, output in dict.fromkeys(zip(slopes["record"], slopes["output"])):
        here = (slopes["record"] == record) & (slopes["output"] == output)
        of_run = (rows["record"] == record) & (rows["output"] == output)
        at = dict(zip(rows["time"][of_run], zip(rows["observed"][of_run], rows["predicted"][of_run])))
        time, noise = slopes["time"][here], slopes["noise"][here]
        beside = np.array([at[t] for t in time])
        # The table has them in units of the noise.
        by_name = [slopes[f"sensitivity:{name}"][here] * noise for name in run.names]
        found[f"{record}:{output}"] = Linearised(time, beside[:, 0], beside[:, 1], noise, np.column_stack(by_name))
    return found
