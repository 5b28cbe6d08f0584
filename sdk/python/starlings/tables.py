"""Tables: pandas.DataFrames where pandas is installed, arrays by name elsewhere."""

from __future__ import annotations

import csv
import io
from typing import Any, Dict, List, Optional

import numpy as np


#: Truth values in CSV files.
_TRUTH = {"true": True, "false": False}


def column(values: List[str]) -> Any:
    """The cells of a CSV file: numbers where all of them are, an empty cell as NaN; truth values, an empty cell as None; or text."""
    if set(values) & set(_TRUTH) and set(values) <= {*_TRUTH, ""}:
        truths = [_TRUTH.get(value) for value in values]
        return np.array(truths, dtype=object if None in truths else bool)
    try:
        return np.array([float(value) if value else np.nan for value in values])
    except ValueError:
        return np.array(values, dtype=object)


def table(columns: Dict[str, Any], index: Optional[str] = None) -> Any:
    """A DataFrame, with one of its columns as index; without pandas the columns themselves."""
    try:
        import pandas
    except ImportError:
        return columns
    frame = pandas.DataFrame(columns)
    return frame if index is None else frame.set_index(index)


def read_columns(text: str) -> Dict[str, Any]:
    """The columns of a CSV file, by name."""
    reader = csv.reader(io.StringIO(text))
    names = next(reader, [])
    rows = list(reader)
    return {name: column([row[k] for row in rows]) for k, name in enumerate(names)}
