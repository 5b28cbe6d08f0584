"""The commands of the program, for studies in files, tables or memory.

Each takes a study (`starlings.Study`, the path of a study file, or its sections as tables) and overrides: sections of the study as
tables, merged into it (`Study.changed`). Next files to read: standing.py, program.py.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from pathlib import Path
from typing import Any, Iterator, List, Mapping, Optional, Sequence, Union

from .answers import Checked, Diagnosis, Explanation, Identification, Inference
from .forecasts import Place
from .program import RunError, StudyError, call, output
from .run_folder import Run, read_run
from .standing import standing
from .study_file import AnyStudy, Study
from .tables import read_columns, table


def run(
    study: AnyStudy,
    /,
    *,
    out: Optional[Place] = None,
    resume: bool = False,
    workers: Optional[int] = None,
    listen: Optional[str] = None,
    access: Optional[Place] = None,
    options: Sequence[str] = (),
    progress: Optional[bool] = None,
    **overrides: Any,
) -> Run:
    """Estimates the parameters of a study.

    `out`: the run folder, by default `runs/NAME-TIME`; of a study made or changed here the files stand in `study` inside it. `resume`: goes
    on with what was interrupted there. `workers`: local processes. `listen` and `access`: workers on other machines dial an
    address, with what stands in the access file. `options`: further options of `starlings run --help`. `progress`: whether a bar
    is shown; by default where somebody looks.

    Raises StudyError for what is wrong with the study, RunError for what fails. Ctrl-C raises KeyboardInterrupt, which says where what
    was computed is and how it goes on.
    """
    folder = _folder(study, out, "")
    words = [*_fleet(workers, listen, access), *options, *(["--resume"] if resume else [])]
    with standing(study, overrides, folder) as file, _going_on("run", folder):
        call(["run", str(file), "--out", str(folder), *words], progress)
    found = read_run(folder)
    found.study = Path(os.path.abspath(file))
    return found


def explain(
    study: AnyStudy,
    /,
    *,
    out: Optional[Place] = None,
    resume: bool = False,
    budget: Optional[int] = None,
    without: Sequence[str] = (),
    only: Sequence[str] = (),
    workers: Optional[int] = None,
    listen: Optional[str] = None,
    access: Optional[Place] = None,
    options: Sequence[str] = (),
    progress: Optional[bool] = None,
    **overrides: Any,
) -> Explanation:
    """Says where a model disagrees with its recordings, names the missing effect, adds it and shows the gap shrink.

    `budget`: runs of the model at most. `without`: effects that are not tried; `only`: effects besides which none is tried. The
    rest is as in `run`.
    """
    folder = _folder(study, out, "-explain")
    words = [*_fleet(workers, listen, access), *options, *(["--resume"] if resume else [])]
    words += ["--budget", str(budget)] if budget is not None else []
    words += [word for name in without for word in ("--without", name)]
    words += [word for name in only for word in ("--only", name)]
    with standing(study, overrides, folder) as file, _going_on("explain", folder):
        found = call(["explain", str(file), "--out", str(folder), *words], progress)
    return Explanation(found, folder)


def infer(
    study: AnyStudy,
    /,
    *,
    out: Optional[Place] = None,
    workers: Optional[int] = None,
    listen: Optional[str] = None,
    access: Optional[Place] = None,
    options: Sequence[str] = (),
    progress: Optional[bool] = None,
    **overrides: Any,
) -> Inference:
    """Infers drift and noise of stochastic equations from recordings of all states. As `run`."""
    folder = _folder(study, out, "-infer")
    words = [*_fleet(workers, listen, access), *options]
    with standing(study, overrides, folder) as file:
        found = call(["infer", str(file), "--out", str(folder), *words], progress)
    return Inference(found, folder, Path(os.path.abspath(file)))


def diagnose(
    study: AnyStudy,
    /,
    *,
    out: Optional[Place] = None,
    workers: Optional[int] = None,
    listen: Optional[str] = None,
    access: Optional[Place] = None,
    options: Sequence[str] = (),
    progress: Optional[bool] = None,
    **overrides: Any,
) -> Diagnosis:
    """Says whether recordings show a fault, since when, which scenario of `[diagnose]` it followed and how severe it is. As `run`."""
    folder = _folder(study, out, "-diagnose")
    words = [*_fleet(workers, listen, access), *options]
    with standing(study, overrides, folder) as file:
        found = call(["diagnose", str(file), "--out", str(folder), *words], progress)
    return Diagnosis(found, folder)


def check(study: AnyStudy, /, *, options: Sequence[str] = (), **overrides: Any) -> Checked:
    """Validates a study and makes one trial run of its model. Raises StudyError with every problem that it finds."""
    with standing(study, overrides, None) as file:
        return Checked(call(["check", str(file), *options], False))


def identify(
    study: AnyStudy,
    /,
    *,
    at: Optional[Union[Run, Place]] = None,
    workers: Optional[int] = None,
    options: Sequence[str] = (),
    progress: Optional[bool] = None,
    **overrides: Any,
) -> Identification:
    """Says what these data could determine, before it is estimated; around the prior medians, or the estimate of a run `at`."""
    centre = ["--at", str(at.folder if isinstance(at, Run) else at)] if at is not None else []
    with standing(study, overrides, None) as file, tempfile.TemporaryDirectory() as scratch:
        page = Path(scratch) / "identify.html"
        words = [*centre, *_fleet(workers, None, None), "--html", str(page), *options]
        found = call(["identify", str(file), *words], progress)
        return Identification(found, page.read_text(encoding="utf-8"))


def twin(
    study: AnyStudy,
    values: Optional[Mapping[str, float]] = None,
    /,
    *,
    noise: Optional[float] = None,
    seed: Optional[int] = None,
    record: Optional[str] = None,
    options: Sequence[str] = (),
    **overrides: Any,
) -> Any:
    """What would be measured if parameters had these values (the others have their prior medians): a twin experiment.

    A pandas.DataFrame where pandas is installed, else arrays by name. `noise`: standard deviation of the measurements.
    """
    given = {"noise": noise, "seed": seed, "record": record}
    words = [word for key, value in given.items() if value is not None for word in (f"--{key}", str(value))]
    words += [word for name, value in (values or {}).items() for word in ("--set", f"{name}={float(value)!r}")]
    with standing(study, overrides, None) as file:
        return table(read_columns(output(["simulate", str(file), *words, *options], False)))


@contextlib.contextmanager
def _going_on(command: str, folder: Path) -> Iterator[None]:
    """Says, of what ends before it is done, how it goes on here: the program says how on the command line."""
    remedy = f"starlings.{command}(..., out={str(folder)!r}, resume=True)"
    try:
        yield
    except KeyboardInterrupt:
        if not (folder / "run.db").is_file():
            raise
        raise KeyboardInterrupt(f"what was computed so far is in {folder}: {remedy} goes on") from None
    except (RunError, StudyError) as error:
        if "--resume" in str(error):
            error.args = (f"{error}\nFrom Python: {remedy}",)
        raise


def _fleet(workers: Optional[int], listen: Optional[str], access: Optional[Place]) -> List[str]:
    given = {"workers": workers, "listen": listen, "access": access}
    return [word for key, value in given.items() if value is not None for word in (f"--{key}", str(value))]


def _folder(study: AnyStudy, out: Optional[Place], kind: str) -> Path:
    """The folder of a command: `runs/NAME-TIME`, with a number where that is taken."""
    if out is not None:
        return Path(out)
    name = _name(study)
    stamp = time.strftime("%Y%m%d-%H%M%S", time.gmtime())
    runs = Path("runs")
    try:
        tempfile.TemporaryFile(dir=runs if runs.is_dir() else ".").close()
    except OSError as error:
        raise StudyError(
            f"results go into {runs} in the current folder, which cannot be written to ({error.strerror}): name another place with out="
        ) from None
    first = runs / f"{name}{kind}-{stamp}"
    folder, number = first, 2
    while folder.exists():
        folder, number = first.with_name(f"{first.name}-{number}"), number + 1
    return folder


def _name(study: AnyStudy) -> str:
    if isinstance(study, Study):
        return study.name
    if isinstance(study, Mapping):
        return Study(dict(study)).name
    try:
        return Study.read(study).name
    except (StudyError, OSError, UnicodeDecodeError):
        # The command says what is wrong with the file.
        return Path(study).stem
