"""Recordings that are in memory: columns of numbers over time, checked and written as CSV."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence

import numpy as np

from .values import Array

#: Columns that hold the time where none is named.
_TIMES = ("time", "t")


class RecordingError(ValueError):
    """A recording holds what cannot be fitted; the message names column and row, counted from 0."""


@dataclass
class Recording:
    """Columns of equal length over increasing times, [n_times]; NaN where nothing was measured."""

    time: str
    columns: Dict[str, Array]

    @property
    def measured(self) -> List[str]:
        """Names of the columns beside the time."""
        return [name for name in self.columns if name != self.time]

    def csv(self) -> str:
        """As a CSV file that gives the same numbers to the last bit; a gap is an empty cell."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for row in zip(*self.columns.values()):
            writer.writerow(["" if np.isnan(value) else repr(float(value)) for value in row])
        return text.getvalue()


def take(data: Any, name: str, time: Optional[str] = None) -> Recording:
    """A recording of a pandas.DataFrame, of a table of names with an array each, or of a file as `starlings.read` takes it.

    The time is the column `time`, or one named "time" or "t", or the index of a DataFrame. Dates and time spans become
    seconds after the first row. Raises RecordingError for what is no column of numbers.
    """
    if isinstance(data, (str, os.PathLike)):
        from .read import read

        data = read(data)
    columns = _columns(data, name)
    key = _time(data, columns, name, time)
    if key not in columns:
        columns = {key: data.index.to_numpy(), **columns}
    found = {column: _numbers(values, f"record `{name}`: column `{column}`") for column, values in columns.items()}
    lengths = {column: len(values) for column, values in found.items()}
    if len(set(lengths.values())) > 1:
        raise RecordingError(f"record `{name}`: columns of different lengths: {lengths}")
    _check_times(found[key], f"record `{name}`: the time `{key}`")
    return Recording(key, found)


def _columns(data: Any, name: str) -> Dict[str, Any]:
    if hasattr(data, "columns") and hasattr(data, "to_numpy"):
        repeated = data.columns[data.columns.duplicated()]
        if len(repeated):
            raise RecordingError(f"record `{name}`: two columns are named `{repeated[0]}`")
        return {str(column): data[column].to_numpy() for column in data.columns}
    if isinstance(data, Mapping):
        return {str(column): np.asarray(values).reshape(-1) for column, values in data.items()}
    raise RecordingError(
        f"record `{name}` is a {type(data).__name__}: give a pandas.DataFrame or a table of names with an array each"
    )


def _time(data: Any, columns: Mapping[str, Any], name: str, wanted: Optional[str]) -> str:
    index = getattr(data, "index", None)
    is_named = getattr(index, "name", None)
    if wanted is not None:
        if wanted in columns or is_named == wanted:
            return wanted
        raise RecordingError(f"record `{name}` has no column `{wanted}`; there are {', '.join(columns)}")
    for candidate in _TIMES:
        if candidate in columns:
            return candidate
    # An index that counts rows is no time.
    if index is not None and not isinstance(data, Mapping) and type(index).__name__ != "RangeIndex":
        return str(is_named or "time")
    raise RecordingError(
        f"record `{name}` has no column named time or t: name the one that holds the time with time=; "
        f"there are {', '.join(columns)}"
    )


def _numbers(values: Any, what: str) -> Array:
    """Numbers as 64-bit floats; dates and spans as seconds after the first."""
    array = np.asarray(values)
    if array.dtype == object:
        array = _uniform(array, what)
    if array.dtype.kind in "Mm":
        first = array[~np.isnat(array)][:1]
        spans = array - first[0] if array.dtype.kind == "M" and len(first) else array
        seconds: Array = np.where(np.isnat(spans), np.nan, spans / np.timedelta64(1, "s"))
        return seconds
    if array.dtype.kind not in "fiu":
        raise RecordingError(f"{what} holds {array.dtype.name}, expected numbers")
    numbers: Array = np.asarray(array, dtype=np.float64)
    infinite = np.flatnonzero(np.isinf(numbers))
    if len(infinite):
        raise RecordingError(f"{what} is infinite in row {infinite[0]}: leave the value out (NaN) where nothing was measured")
    return numbers


def _uniform(array: Any, what: str) -> Any:
    """Objects that are all numbers, or all instants of time, as an array of them."""
    if all(hasattr(value, "timestamp") for value in array):
        return np.array([round(value.timestamp() * 1e9) for value in array], dtype="datetime64[ns]")
    numbers = np.full(len(array), np.nan)
    for row, value in enumerate(array):
        if value is None or type(value).__name__ in ("NAType", "NaTType"):
            continue
        if isinstance(value, (bool, np.bool_, str, bytes)) or not np.isscalar(value):
            raise RecordingError(f"{what} holds {value!r} in row {row}, expected a number: convert it, or leave it out (NaN)")
        numbers[row] = float(value)  # type: ignore[arg-type]
    return numbers


def _check_times(times: Array, what: str) -> None:
    if not len(times):
        raise RecordingError(f"{what} has no rows")
    missing = np.flatnonzero(np.isnan(times))
    if len(missing):
        raise RecordingError(f"{what} has no value in row {missing[0]}: drop the row, or fill it in")
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if len(back):
        row = back[0] + 1
        raise RecordingError(
            f"{what} does not increase in row {row}: {times[row]!r} after {times[row - 1]!r}; sort the rows, and let none stand twice"
        )


def by_name(data: Any) -> "Dict[str, Any]":
    """Recordings by name: one alone is "data"; a list is counted from 1."""
    if isinstance(data, Mapping) and data and all(_is_table(value) for value in data.values()):
        return {str(name): value for name, value in data.items()}
    if isinstance(data, Sequence) and not isinstance(data, (str, bytes)):
        return {f"record-{i + 1}": value for i, value in enumerate(data)}
    return {"data": data}


def _is_table(value: Any) -> bool:
    return isinstance(value, (Mapping, os.PathLike)) or (hasattr(value, "columns") and hasattr(value, "to_numpy"))
