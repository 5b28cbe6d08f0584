"""What is asked of a run afterwards is asked of the study as it ran: changed, given as tables, or edited since."""

import json
import shutil
import subprocess

import pytest
from test_commands import EXAMPLES, pytestmark  # noqa: F401

import starlings
from starlings.program import program
from starlings.resolved import resolved

#: Ten times what the file says.
NOISE = 0.022
COARSE = {"records": {"shaker": {"channels": [{"column": "position", "output": "position", "noise": NOISE}]}}}


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with the study of an oscillator below it."""
    shutil.copytree(EXAMPLES / "oscillator", tmp_path / "osc", ignore=shutil.ignore_patterns("runs"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def as_tables(folder):
    """The study of the oscillator as plain tables, with paths from the folder above it."""
    tables = starlings.Study.read(folder / "osc" / "study.toml").sections.unwrap()
    (record,) = tables["records"]
    record.update(file="osc/position.csv", inputs={"F": "osc/force.csv:force"})
    return tables


def spread(run):
    """Standard deviation of the predictive draws at a time, in the mean over times."""
    pytest.importorskip("arviz")
    data = run.to_arviz(draws=400, predictive=True)
    return float(data.posterior_predictive["shaker:position"].std(("chain", "draw")).mean())


def again(run):
    """What the command line says of a run of the folder, made once more."""
    done = subprocess.run([program(), "replay", str(run.folder), "0", "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["agrees"]


def test_a_changed_study_is_predicted_with_its_changes(here):
    run = starlings.run("osc/study.toml", out="out", workers=1, **COARSE)
    # Of 1600 draws the sd is within a few per cent of the noise, which the posterior adds little to.
    assert 0.98 * NOISE < spread(run) < 1.1 * NOISE
    assert 0.98 * NOISE < spread(starlings.read_run("out")) < 1.1 * NOISE
    assert again(run)


def test_a_study_that_was_edited_after_its_run_is_predicted_as_it_ran(here):
    run = starlings.run("osc/study.toml", out="out", workers=1)
    file = here / "osc" / "study.toml"
    file.write_text(file.read_text().replace("noise = 0.0022", "noise = 0.022"))
    assert spread(run) < 0.004
    file.unlink()
    with pytest.raises(starlings.StudyError, match="is not there: set `study` of the run"):
        run.to_arviz(predictive=True)


def test_a_study_of_tables_is_asked_afterwards_whatever_else_is_there(here, monkeypatch):
    (here / "study.toml").write_text("[study]\nname = 'another'\n")
    run = starlings.run(as_tables(here), out="out", workers=1, **COARSE)
    monkeypatch.chdir(here / "osc")
    run.folder, run.study = here / "out", None
    assert spread(run) > 0.98 * NOISE
    assert len(run.forecast(until=12.0, members=20, workers=1).fan["time"])
    assert again(run)


def test_the_study_of_a_run_lasts_and_is_no_other_ones(here):
    run = starlings.run(as_tables(here), out="out", workers=1)
    assert run.study == here / "out" / "study" / "study.toml"
    text = run.study.read_bytes()
    with pytest.raises(starlings.StudyError, match="already"):
        starlings.run(as_tables(here), out="out", study={"seed": 9})
    assert run.study.read_bytes() == text
    assert sorted(path.name for path in (here / "out").glob("study*")) == ["study", "study.toml"]
    assert starlings.run(as_tables(here), out="out", resume=True, workers=1).study == run.study


def test_every_path_of_a_study_is_resolved(tmp_path):
    for name in ("a.csv", "b.csv", "walls.csv", "mesh.stl", "beam.tpl"):
        (tmp_path / name).write_text("time,file\n0,mesh.stl\n" if name == "walls.csv" else "")
    model = {
        "kind": "solver",
        "initial": "a.csv",
        "command": ["python3", "beam.py"],
        "templates": {"beam.inp": "beam.tpl"},
        "copies": ["a.csv", "/far.csv"],
    }
    record = {"name": "r", "file": "a.csv", "inputs": {"F": "b.csv:f", "G": "g:2"}, "channels": [{"surface": "walls.csv", "rest": "b.csv"}]}
    scenario = {"name": "s", "inputs": {"F": "b.csv:g"}}
    sections = {"model": model, "records": [record], "diagnose": {"scenarios": [scenario]}}
    found = resolved(starlings.Study(sections, tmp_path / "study.toml"))
    at = {name: str(tmp_path / name) for name in ("a.csv", "b.csv", "mesh.stl", "beam.tpl")}
    assert found.file is None
    assert found.sections["model"] == {
        **model,
        "initial": at["a.csv"],
        "folder": str(tmp_path),
        "templates": {"beam.inp": at["beam.tpl"]},
        "copies": [at["a.csv"], "/far.csv"],
    }
    (record,) = found.sections["records"]
    assert (record["file"], record["inputs"]) == (at["a.csv"], {"F": f"{at['b.csv']}:f", "G": "g:2"})
    assert found.sections["diagnose"]["scenarios"][0]["inputs"] == {"F": f"{at['b.csv']}:g"}
    (channel,) = record["channels"]
    assert channel["rest"] == at["b.csv"]
    assert found.files[channel["surface"]].decode() == f"time,file\n0,{at['mesh.stl']}\n"


def test_a_file_that_is_not_there_is_looked_for_where_the_study_was(here):
    (here / "osc" / "position.csv").unlink()
    with pytest.raises(starlings.StudyError) as raised:
        starlings.check("osc/study.toml", study={"seed": 2})
    assert any(str(here / "osc" / "position.csv") in problem["message"] for problem in raised.value.problems)
