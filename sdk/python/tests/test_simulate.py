"""`simulate` of a study in each of its forms, beside that of a solver."""

import shutil

import numpy as np
import pytest
from chain import Chain
from test_commands import EXAMPLES, pytestmark  # noqa: F401

import starlings

FILE = EXAMPLES / "oscillator" / "study.toml"


def columns(found):
    return {name: np.asarray(found[name]) for name in found}


def same(one, other):
    one, other = columns(one), columns(other)
    assert list(one) == list(other) and len(one["time"]) > 400
    assert all(np.array_equal(one[name], other[name]) for name in one)


def test_a_study_is_simulated_in_every_form_that_commands_take(tmp_path, monkeypatch):
    wanted = starlings.twin(FILE, {"k": 42.0}, noise=0.1, seed=3)
    study = starlings.Study.read(FILE)
    for form in (FILE, str(FILE), study):
        same(starlings.simulate(form, {"k": 42.0}, noise=0.1, seed=3), wanted)
    shutil.copytree(FILE.parent, tmp_path / "osc", ignore=shutil.ignore_patterns("runs"))
    monkeypatch.chdir(tmp_path / "osc")
    same(starlings.simulate(study.sections.unwrap(), {"k": 42.0}, noise=0.1, seed=3), wanted)


def test_values_and_changes_of_parameters_are_told_apart():
    changed = {"k": np.float64(42.0), "c": {"prior": {"median": 0.7}}}
    same(starlings.simulate(FILE, parameters=changed), starlings.twin(FILE, {"k": 42.0, "c": 0.7}))


def test_what_is_for_the_other_is_refused():
    with pytest.raises(starlings.StudyError, match="`times` is for a solver: a study has times and inputs of its own"):
        starlings.simulate(FILE, times=[0.0, 1.0])
    with pytest.raises(ValueError, match=r"stand in parameters=\{name: value\}"):
        starlings.simulate(Chain, {"stiffness": 1.0}, times=[0.0])
    with pytest.raises(FileNotFoundError):
        starlings.simulate("nowhere.toml", study={"seed": 2})
    assert starlings.simulate(solver=Chain, parameters={"stiffness": 1.0}, times=[1.0]).state.shape == (12,)
