"""The program `starlings`, started for one command: where it is, what it says while it works, how it ends.

Next file to read: commands.py.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sysconfig
import threading
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from .progress import Progress

#: Names a program to use instead of the one that was installed with this package.
VARIABLE = "STARLINGS_PROGRAM"

#: Lines of standard error that are kept for the message of a failure.
_MOST_LINES = 200


class StudyError(ValueError):
    """The study, or what was asked of it, is wrong. `problems` has an entry per place, with `file`, `line`, `column`, `message`
    and `help`; empty where the fault is in no file."""

    def __init__(self, message: str, problems: Sequence[Dict[str, Any]] = ()) -> None:
        super().__init__(message)
        self.problems = list(problems)


class RunError(RuntimeError):
    """The command began and could not be finished; the message says why and how to go on."""


def program() -> str:
    """Path of the program: what STARLINGS_PROGRAM names, else the one installed beside this Python, else the first on PATH.

    Raises RunError where there is none.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not os.access(named, os.X_OK):
            raise RunError(f"{VARIABLE} names {named}, which is no program")
        return named
    beside = Path(sysconfig.get_path("scripts"))
    found = shutil.which("starlings", path=str(beside)) or shutil.which("starlings")
    if found is None:
        raise RunError(
            f"the program `starlings` is neither in {beside} nor on PATH: this package was installed without it. Install a wheel "
            "that holds it, or in a copy of the repository `cargo install --path .`; "
            f"{VARIABLE} names one that stands elsewhere"
        )
    return found


def call(arguments: Sequence[str], progress: Optional[bool] = None) -> Any:
    """What a command prints with `--json`.

    Ctrl-C, or the kernel's interrupt, ends everything that the command has started, and is raised when that is done; the
    death of this process ends it too. Raises StudyError for what is wrong with the input and RunError for what fails.
    """
    text = output([*arguments, "--json"], progress)
    try:
        return json.loads(text)
    except ValueError as error:
        raise RunError(f"the answer of the program is no JSON: {error}") from None


def output(arguments: Sequence[str], progress: Optional[bool] = None) -> str:
    """What a command prints; see `call`."""
    shown = Progress(arguments[0], progress)
    child = subprocess.Popen(
        [program(), "--end-with-stdin", "--log", "json", *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        # A Ctrl-C of the terminal reaches it once, through us.
        start_new_session=True,
    )
    said: List[str] = []
    listener = threading.Thread(target=_listen, args=(child, shown, said), daemon=True)
    listener.start()
    try:
        answer = _read(child)
    except KeyboardInterrupt:
        _end(child)
        raise
    finally:
        listener.join()
        shown.close()
        for pipe in (child.stdin, child.stdout, child.stderr):
            if pipe is not None:
                pipe.close()
    if child.returncode != 0:
        _fail(child.returncode, answer, said)
    return answer


def _read(child: "subprocess.Popen[str]") -> str:
    assert child.stdout is not None
    answer = child.stdout.read()
    child.wait()
    return answer


def _end(child: "subprocess.Popen[str]") -> None:
    """Ends the command in order; at a second interrupt at once."""
    try:
        child.send_signal(signal.SIGINT)
        child.wait()
    except KeyboardInterrupt:
        child.kill()
        child.wait()
        raise


def _listen(child: "subprocess.Popen[str]", shown: Progress, said: List[str]) -> None:
    """Takes the records on standard error as they come; what is no record was said by a program below."""
    assert child.stderr is not None
    for line in child.stderr:
        try:
            record = json.loads(line)
            fields = record["fields"]
        except (ValueError, KeyError, TypeError):
            fields = {"message": line.rstrip("\n")}
        shown.show(fields)
        if fields.get("event") != "progress":
            said.append(str(fields.get("message", "")))
            del said[:-_MOST_LINES]


def _fail(code: int, text: str, said: Sequence[str]) -> None:
    """Raises what an exit code and the last words mean."""
    try:
        answer = json.loads(text)
    except ValueError:
        answer = None
    problems: List[Dict[str, Any]] = []
    if isinstance(answer, dict) and "error" in answer:
        message, problems = str(answer["error"]), answer.get("problems", [])
    else:
        message = "\n".join(said).strip() or f"the program ended with exit code {code} and said nothing"
    if code == 2:
        raise StudyError(message, problems)
    if code in (128 + signal.SIGINT, -signal.SIGINT):
        raise KeyboardInterrupt(message)
    raise RunError(message)
