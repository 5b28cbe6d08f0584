"""Recordings in files of other formats: Parquet, Feather, NetCDF, HDF5, MATLAB, Excel, CSV.

Every format is read by the library of its own project, which is asked for where it is not installed. Next file to read: recording.py,
which checks what was read.
"""

from __future__ import annotations

import os
import re
from importlib import import_module
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Union

import numpy as np

from .recording import RecordingError
from .tables import read_columns, table
from .values import Array

#: Seconds of the units in which NetCDF counts time (CF conventions: "hours since 2020-01-01").
_SECONDS = {"millisecond": 1e-3, "msec": 1e-3, "second": 1.0, "sec": 1.0, "s": 1.0, "minute": 60.0, "min": 60.0, "hour": 3600.0, "hr": 3600.0,
            "h": 3600.0, "day": 86400.0, "d": 86400.0}
#: Ends of names of files that are no text.
_BINARY = (".parquet", ".feather", ".arrow", ".nc", ".h5", ".hdf5", ".mat", ".xlsx", ".xls")
_SINCE = re.compile(r"\s*(?P<unit>[A-Za-z]+?)s?\s+since\s+", re.IGNORECASE)


def read(file: Union[str, "os.PathLike[str]"], *, group: Optional[str] = None) -> Any:
    """A table of the columns in a file: a pandas.DataFrame where pandas is installed, else arrays by name.

    The format is found by the file's first bytes, not by its name: Parquet, Feather (pyarrow); NetCDF 3, MATLAB 5 to 7.2 (scipy); NetCDF 4,
    HDF5, MATLAB 7.3 (h5py); Excel (pandas, openpyxl); else CSV, unless it is named as one of these. Of files with variables of any shape those are taken that are
    one-dimensional and as long as the time, or as most of them where none is named time or t. `group` names a group or a struct inside,
    "run1/sensors". Times of NetCDF that count from a date become seconds after the first.

    Raises RecordingError for what is no table or damaged, and where a library is missing; FileNotFoundError where there is no file.
    """
    path = Path(file)
    with open(path, "rb") as opened:
        start = opened.read(128)
    try:
        return _of_format(path, start, group)
    except RecordingError:
        raise
    except Exception as error:  # whatever a library raises at what it cannot read
        said = " ".join(str(error).split())
        raise RecordingError(f"{path} cannot be read, and may be damaged or cut off: write it again ({said})") from error


def _of_format(path: Path, start: bytes, group: Optional[str]) -> Any:
    """The table of a file that begins so."""
    if start.startswith(b"PAR1"):
        return _frame(_arrow("pyarrow.parquet", path).read_table(path))
    if start.startswith((b"ARROW1", b"FEA1")):
        return _frame(_arrow("pyarrow.feather", path).read_table(path))
    if start.startswith((b"CDF\x01", b"CDF\x02")):
        return table(_vectors(_netcdf3(path), path, group))
    if start.startswith(b"MATLAB 5.0"):
        return table(_vectors(_matlab5(path), path, group))
    if start.startswith(b"\x89HDF") or start.startswith(b"MATLAB 7.3"):
        return table(_vectors(_hdf5(path, group), path, None))
    if start.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        return _need("pandas", path, "a workbook").read_excel(path)
    if path.suffix.lower() in _BINARY:
        raise RecordingError(f"{path} does not begin as a {path.suffix} file does, and may be damaged, cut off or of an older kind: write it again")
    if b"\x00" in start:
        raise RecordingError(f"{path} is in no format that is known here: give it as CSV, Parquet, NetCDF or MATLAB")
    return _csv(path)


def _need(module: str, path: Path, what: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        library = module.split(".")[0]
        raise RecordingError(f"{path} is {what}, which {library} reads: pip install {library}") from error


def _arrow(module: str, path: Path) -> Any:
    return _need(module, path, "a Parquet or Feather file")


def _frame(found: Any) -> Any:
    """A table of Arrow as a DataFrame, or as arrays by name."""
    try:
        import pandas  # noqa: F401
    except ImportError:
        return {name: found[name].to_numpy() for name in found.column_names}
    return found.to_pandas()


def _csv(path: Path) -> Any:
    text = path.read_text(encoding="utf-8-sig")
    if not text.strip():
        raise RecordingError(f"{path} is empty: it holds no table")
    first = text.partition("\n")[0]
    if any(first.count(sign) > first.count(",") for sign in ";\t|"):
        raise RecordingError(
            f"{path} is not separated by commas: `starlings init {path.name}` reads it, or pandas.read_csv with sep= and decimal="
        )
    return table(read_columns(text))


def _netcdf3(path: Path) -> Dict[str, Any]:
    scipy_io = _need("scipy.io", path, "a NetCDF 3 file")
    with scipy_io.netcdf_file(str(path), "r", mmap=False, maskandscale=True) as opened:
        found = {}
        for name, variable in opened.variables.items():
            units = getattr(variable, "units", b"")
            values = np.ma.filled(np.ma.asarray(variable[:], dtype=np.float64), np.nan) if variable.typecode() != "c" else np.array("")
            found[name] = _from_date(values, units.decode() if isinstance(units, bytes) else str(units))
    return found


def _matlab5(path: Path) -> Dict[str, Any]:
    found: Dict[str, Any] = _need("scipy.io", path, "a MATLAB file").loadmat(path, simplify_cells=True)
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _hdf5(path: Path, group: Optional[str]) -> Dict[str, Any]:
    h5py = _need("h5py", path, "an HDF5 file (NetCDF 4, MATLAB 7.3)")
    with h5py.File(path, "r") as opened:
        if group is not None and not isinstance(opened.get(group), h5py.Group):
            raise RecordingError(f"{path} has no group `{group}`; there are {_listed(opened)}")
        inside = opened[group] if group is not None else opened
        found = {name: _dataset(value) for name, value in inside.items() if isinstance(value, h5py.Dataset)}
        if not any(np.ndim(value) for value in found.values()):
            groups = [name for name, value in inside.items() if isinstance(value, h5py.Group) and not name.startswith("#")]
            if groups:
                raise RecordingError(f"{path} holds groups and no table: name one by group=; there are {', '.join(groups)}")
    return found


def _dataset(data: Any) -> Any:
    """Numbers of a dataset; what is none is a scalar, which no table takes."""
    if data.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"function_handle") or data.dtype.kind not in "fiu":
        return np.array("")
    values = np.asarray(data[()], dtype=np.float64)
    for name in ("_FillValue", "missing_value"):
        if name in data.attrs:
            values = np.where(values == np.float64(np.ravel(data.attrs[name])[0]), np.nan, values)
    scale, offset = (np.ravel(data.attrs.get(name, standard))[0] for name, standard in (("scale_factor", 1.0), ("add_offset", 0.0)))
    units = data.attrs.get("units", "")
    return _from_date(values * float(scale) + float(offset), units.decode() if isinstance(units, bytes) else str(units))


def _from_date(values: Any, units: str) -> Any:
    """Times that count from a date, as seconds after the first."""
    since = _SINCE.match(units)
    factor = _SECONDS.get(since["unit"].lower()) if since else None
    if factor is None or not np.size(values):
        return values
    return (values - np.ravel(values)[0]) * factor


def _vectors(found: Mapping[str, Any], path: Path, group: Optional[str]) -> Dict[str, Array]:
    """The variables that are columns of one table."""
    for name in (group or "").split("/") if group else []:
        inner = found.get(name)
        if not isinstance(inner, Mapping):
            raise RecordingError(f"{path} has no struct `{name}`; there are {_listed(found)}")
        found = inner
    vectors = {}
    for name, value in found.items():
        array = np.asarray(value)
        if array.dtype.kind in "fiu" and array.size > 1 and array.size == max(array.shape):
            vectors[name] = array.reshape(-1).astype(np.float64)
    if not vectors:
        raise RecordingError(f"{path} holds no one-dimensional variable; there are {_listed(found)}")
    lengths = [len(vectors[name]) for name in ("time", "t", "Time") if name in vectors] or [len(value) for value in vectors.values()]
    usual = max(lengths, key=lengths.count)
    return {name: value for name, value in vectors.items() if len(value) == usual}


def _listed(found: Mapping[str, Any]) -> str:
    names = [str(name) for name in found if not str(name).startswith("#")]
    return ", ".join(names[:20]) + (", ..." if len(names) > 20 else "") or "none"
