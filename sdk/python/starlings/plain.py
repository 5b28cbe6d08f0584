"""Values that a study file can have, of what Python has: numbers of numpy, arrays, tuples, paths.

Next file to read: study_file.py.
"""

from __future__ import annotations

import datetime
import os
from typing import Any, Mapping

import numpy as np

from .program import StudyError


def plain(value: Any, place: str = "") -> Any:
    """A copy of tables, lists and values as a study file has them. Raises StudyError for what is none, with the path of its key."""
    if isinstance(value, Mapping):
        return {_key(key, place): plain(inner, f"{place}.{key}" if place else str(key)) for key, inner in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        if isinstance(value, np.ndarray) and value.ndim == 0:
            return plain(value.item(), place)
        return [plain(inner, f"{place}{_entry(inner, number)}") for number, inner in enumerate(value)]
    if isinstance(value, np.generic):
        return plain(value.item(), place)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if value is None:
        raise StudyError(f"`{place}` is None, which a study file cannot say: leave the key out, or give it a value")
    if not isinstance(value, (bool, int, float, str, datetime.date, datetime.time)):
        kind = type(value).__name__
        raise StudyError(f"`{place}` is a {kind}, which a study file cannot say: give a number, text, true or false, a list or a table")
    return value


def without_none(value: Any) -> Any:
    """Tables without the keys that are None: a change that takes away what is not there."""
    if isinstance(value, Mapping):
        return {key: without_none(inner) for key, inner in value.items() if inner is not None}
    return value


def _key(key: Any, place: str) -> str:
    if not isinstance(key, str):
        raise StudyError(f"`{place or 'the study'}` has the key {key!r}, which is no text: write it as text")
    return key


def _entry(value: Any, number: int) -> str:
    """How an entry of a list is called: by its name, as overrides do, or by its place from 0."""
    name = value.get("name") if isinstance(value, Mapping) else None
    return f".{name}" if isinstance(name, str) else f"[{number}]"
