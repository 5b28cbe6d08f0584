"""A study: what a study file says, as tables, and the files that it names.

Next file to read: build.py, which makes one of arrays and a function.
"""

from __future__ import annotations

import copy
import html
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Union

from .plain import plain, without_none
from .program import StudyError

#: Name of the study file in a folder that `save` makes.
FILE = "study.toml"


@dataclass
class Study:
    """A study. `sections` is the study file as nested tables; `file` is where it stands, None for one made here; `files` are
    the files that it names and that stand nowhere yet."""

    sections: Dict[str, Any]
    file: Optional[Path] = None
    files: Dict[str, bytes] = field(default_factory=dict)

    @classmethod
    def read(cls, file: Union[str, "os.PathLike[str]"]) -> "Study":
        """The study in a TOML file. Raises FileNotFoundError, or StudyError for what is no TOML."""
        path = Path(file)
        return cls.of_text(path.read_text(encoding="utf-8"), path)

    @classmethod
    def of_text(cls, text: str, file: Path) -> "Study":
        """The study of a text that stood in `file`, from which its paths lead. Raises StudyError for what is no TOML."""
        import tomlkit
        from tomlkit.exceptions import ParseError

        try:
            return cls(tomlkit.parse(text), file)
        except ParseError as error:
            raise StudyError(f"{file}: {error}") from None

    @property
    def name(self) -> str:
        """Its name."""
        section = self.sections.get("study")
        return str(section.get("name", "study")) if isinstance(section, Mapping) else "study"

    def changed(self, **overrides: Any) -> "Study":
        """The same study with other values: `study.changed(study={"seed": 2}, estimator={"passes": 4})`.

        A table is merged into the section of that name. Of lists of named tables (`parameters`, `records`, `effects`) a table
        changes the entries by their names: `parameters={"k": {"prior": {"median": 30}}}`. None takes a key away.
        """
        sections = copy.deepcopy(self.sections)
        _merge(sections, overrides, "")
        return Study(sections, self.file, dict(self.files))

    def text(self) -> str:
        """As TOML. Raises StudyError for values that no study file can have."""
        import tomlkit

        # What was read from a file keeps its comments.
        is_read = isinstance(self.sections, tomlkit.TOMLDocument)
        return tomlkit.dumps(self.sections if is_read else plain(self.sections))

    def save(self, folder: Union[str, "os.PathLike[str]"]) -> Path:
        """Writes study.toml and the files that it names into a folder, which is made; its path is returned.

        Of a study that was read from a file only the text is written, to be put beside the files that it names.
        """
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        for name, held in self.files.items():
            (path / name).write_bytes(held)
        file = path / FILE
        file.write_text(self.text(), encoding="utf-8")
        return file

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text())}</pre>"


#: A study, the path of its file, or its sections as tables.
AnyStudy = Union[Study, str, "os.PathLike[str]", Mapping[str, Any]]


def as_study(study: AnyStudy, overrides: Mapping[str, Any]) -> Study:
    """The study that a command was given, changed. Sections as tables name their files relative to the current folder."""
    if isinstance(study, Study):
        found = study
    elif isinstance(study, Mapping):
        found = Study(plain(study), Path.cwd() / FILE)
    else:
        found = Study.read(study)
    return found.changed(**overrides) if overrides else found


def _merge(into: Any, changes: Mapping[str, Any], place: str) -> None:
    for key, value in changes.items():
        there = into.get(key)
        at = f"{place}{key}"
        if value is None:
            into.pop(key, None)
        elif isinstance(value, Mapping) and isinstance(there, list):
            _merge_named(there, value, at)
        elif isinstance(value, Mapping) and isinstance(there, Mapping):
            _merge(there, value, f"{at}.")
        else:
            into[key] = plain(without_none(value), at)


def _merge_named(entries: List[Any], changes: Mapping[str, Any], place: str) -> None:
    named = {entry["name"]: entry for entry in entries if isinstance(entry, Mapping) and "name" in entry}
    for name, change in changes.items():
        if name not in named:
            raise StudyError(f"no entry of `{place}` is named `{name}`; there are {', '.join(named) or 'none'}")
        if change is None:
            entries.remove(named[name])
        else:
            _merge(named[name], change, f"{place}.{name}.")
