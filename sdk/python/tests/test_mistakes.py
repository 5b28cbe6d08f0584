"""The mistakes of docs/mistakes.md, made through Python: the same words, in a StudyError (or a RunError where the exit code is 1).

The tables stand in tests/mistakes; tests/mistakes.rs says how they are written, and makes them on the command line.
"""

import os
import re
import shlex
import sys
from pathlib import Path

import pytest
from test_commands import EXAMPLES, pytestmark  # noqa: F401

import starlings

TABLES = EXAMPLES.parent / "tests" / "mistakes"
#: Commands that the package has as functions, or passes on by them.
CALLS = ("check", "run", "explain")
#: What cannot be said in Python: a run always has a folder there.
NOT_HERE = ("Resume without saying what",)


def plain(text):
    """A text of a table as bytes."""
    return re.sub(rb"\\(n|t|x[0-9A-Fa-f]{2})", lambda m: {b"n": b"\n", b"t": b"\t"}.get(m[1]) or bytes([int(m[1][1:], 16)]), text.encode())


def sound(table):
    parts = (TABLES / f"{table}.base").read_text(encoding="utf-8").split("=== ")[1:]
    return {name: text.encode() for name, _, text in (part.partition("\n") for part in parts)}


def mistakes():
    for table in ("study", "program", "package"):
        for block in (TABLES / f"{table}.txt").read_text(encoding="utf-8").strip().split("\n\n"):
            title, *lines = block.splitlines()
            files, taken, command, answer = sound(table), None, None, None
            for line in lines:
                name, _, rest = line.partition(" ")
                if name == "$":
                    command = shlex.split(rest)
                elif name.isdigit():
                    answer = (int(name), rest)
                elif rest.startswith("-"):
                    taken = plain(rest[2:])
                else:
                    text = plain(rest[2:])
                    files[name] = text if taken is None else files[name].replace(taken, text)
                    taken = None
            if command and command[0] in CALLS and title[2:] not in NOT_HERE:
                yield pytest.param(files, command, answer, id=title[2:])


def says(pattern, text):
    """Whether a text begins with the first part of a pattern and has the others after it."""
    parts = [part.strip() for part in pattern.split("…")]
    place = len(parts[0]) if text.startswith(parts[0]) else -1
    for part in parts[1:]:
        found = text.find(part, place) if place >= 0 else -1
        place = found + len(part) if found >= 0 else -1
    return place >= 0


@pytest.mark.parametrize(("files", "command", "answer"), list(mistakes()))
def test_a_mistake_is_told_in_the_same_words(files, command, answer, tmp_path, monkeypatch):
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    (code, wanted), (name, study, *rest) = answer, command
    # What the package has no argument for it passes on.
    out = {"out": rest[rest.index("--out") + 1]} if "--out" in rest else {}
    options = [word for word in rest if word != "--out" and word not in out.values()]
    with pytest.raises(starlings.StudyError if code == 2 else starlings.RunError) as raised:
        getattr(starlings, name)(study, options=options, **out)
    problems = getattr(raised.value, "problems", [])
    told = problems[0]["message"] if problems else str(raised.value)
    if problems and problems[0]["line"] is None:
        told = f"{problems[0]['file']}: {told}"
    first = re.sub(r"\s+", " ", told)
    assert says(wanted.replace("{folder}", str(tmp_path)), first), f"wanted {wanted}\ngot    {first}"


def test_the_tables_hold_the_mistakes_of_the_page():
    assert len(list(mistakes())) >= 35
