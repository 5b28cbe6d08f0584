"""Where a study stands while a command reads it, and afterwards.

A study that is a file stays where it is. One that was changed or made here is written into the folder of the command, with all that it
names, and stays there: what asks the folder later finds the study as it ran. Next file to read: study_file.py.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any, Iterator, Mapping, Optional

from .program import StudyError
from .resolved import resolved
from .study_file import FILE, AnyStudy, Study, as_study

#: Folder of the study inside that of a command.
KEPT = "study"


@contextlib.contextmanager
def standing(study: AnyStudy, overrides: Mapping[str, Any], folder: Optional[Path]) -> Iterator[Path]:
    """The study as a file: its own; one that stays in `folder` where it was changed or made here; without `folder` one that goes."""
    if isinstance(study, (str, os.PathLike)) and not overrides:
        yield Path(study)
        return
    found = resolved(as_study(study, overrides))
    if folder is None:
        with tempfile.TemporaryDirectory() as scratch:
            yield found.save(scratch)
        return
    place = _free(found, folder)
    is_new = not place.exists()
    try:
        file = found.save(place)
    except OSError as error:
        raise StudyError(
            f"the study is written into the folder of its results, and {folder} cannot be written to ({error.strerror}): "
            "name another one with out="
        ) from None
    try:
        yield file
    except StudyError:
        # Of a folder that holds other results nothing changes.
        if is_new and place.name != KEPT:
            shutil.rmtree(place, ignore_errors=True)
        raise


def _free(study: Study, folder: Path) -> Path:
    """`study` in the folder, with a number where the folder holds results of another one."""
    place, number = folder / KEPT, 2
    has_results = folder.is_dir() and any(not entry.name.startswith(KEPT) for entry in folder.iterdir())
    while has_results and place.exists() and not _is_same(study, place):
        place, number = folder / f"{KEPT}-{number}", number + 1
    return place


def _is_same(study: Study, place: Path) -> bool:
    held = {**study.files, FILE: study.text().encode()}
    return all((place / name).is_file() and (place / name).read_bytes() == data for name, data in held.items())
