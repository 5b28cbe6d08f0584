"""A study whose files are named by absolute paths: it says the same wherever it stands.

What names a file is what `coordinator/explain/src/tell/patch/place.rs` renames; a key that is added there belongs here too. Next file
to read: standing.py, which puts such a study where a command finds it.
"""

from __future__ import annotations

import copy
import csv
import io
import os
from pathlib import Path
from typing import Any, Dict, List, Optional

from .study_file import Study


def resolved(study: Study) -> Study:
    """The study with absolute paths for those that lead from its file; one that was made here has its files with it."""
    if study.file is None:
        return study
    base = Path(os.path.abspath(study.file)).parent
    sections, files = copy.deepcopy(study.sections), dict(study.files)
    model = sections.get("model")
    if isinstance(model, dict):
        _rename(model, "initial", base)
        if model.get("kind") == "solver":
            _solver(model, base)
    for number, record in enumerate(_tables(sections, "records")):
        _rename(record, "file", base)
        _inputs(record, base)
        for place, channel in enumerate(_tables(record, "channels")):
            meshes = _meshes(channel.get("surface"), base)
            if meshes is not None:
                channel["surface"] = f"surface-{number + 1}-{place + 1}.csv"
                files[channel["surface"]] = meshes
            else:
                _rename(channel, "surface", base)
            _rename(channel, "rest", base)
    for scenario in _tables(sections.get("diagnose"), "scenarios"):
        _inputs(scenario, base)
    return Study(sections, None, files)


def _inputs(of: Dict[str, Any], base: Path) -> None:
    inputs = of.get("inputs")
    if not isinstance(inputs, dict):
        return
    for name, written in list(inputs.items()):
        # `other.csv:column`; a column of the record's own file may hold a colon too.
        file, colon, column = str(written).rpartition(":")
        found = _found(file, base) if colon else None
        if found is not None:
            inputs[name] = f"{found}:{column}"


def _solver(model: Dict[str, Any], base: Path) -> None:
    _rename(model, "described", base)
    for key in ("templates", "copies"):
        files = model.get(key)
        places: Any = files.keys() if isinstance(files, dict) else range(len(files)) if isinstance(files, list) else ()
        for place in list(places):
            _rename(files, place, base)
    # Names in its command lead from the folder in which it runs.
    folder = model.get("folder", ".")
    if "command" in model and isinstance(folder, str):
        model["folder"] = os.path.normpath(base / folder)


def _tables(of: Any, key: str) -> List[Dict[str, Any]]:
    entries = of.get(key) if isinstance(of, dict) else None
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []


def _rename(of: Any, key: Any, base: Path) -> None:
    """Puts an absolute path for one from `base`, also where no file is there: the command says so, with the place."""
    name = of.get(key) if isinstance(of, dict) else of[key]
    if isinstance(name, str) and name:
        of[key] = os.path.normpath(base / name)


def _found(name: Any, base: Path) -> Optional[str]:
    """The absolute path of a file that is there; None for what is none."""
    return os.path.normpath(base / name) if isinstance(name, str) and name and (base / name).is_file() else None


def _meshes(surface: Any, base: Path) -> Optional[bytes]:
    """A list of meshes with absolute paths; None where the file of a surface is no such list."""
    file = _found(surface, base)
    if file is None:
        return None
    with open(file, newline="", encoding="utf-8", errors="replace") as opened:
        rows = list(csv.reader(opened))
    if not rows or "file" not in rows[0]:
        return None
    at = rows[0].index("file")
    for row in rows[1:]:
        if len(row) > at:
            row[at] = _found(row[at], base) or row[at]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()
