"""Studies as tables of what Python has: numbers of numpy become numbers, what no file can say is refused by its key."""

from pathlib import Path

import numpy as np
import pytest

import starlings
from starlings.study_file import as_study

TABLES = {
    "study": {"name": "a", "seed": np.int64(3)},
    "model": {"kind": "equations", "constants": {"m": np.float32(0.5), "on": np.bool_(True)}},
    "parameters": [{"name": "k", "unit": "1", "prior": {"median": np.array(2.0), "range": np.array([1.0, 4.0])}}],
    "records": ({"name": "r", "file": Path("data.csv"), "train": (np.float64(0.1), 1)},),
}


def test_numbers_of_numpy_become_numbers():
    found = as_study(TABLES, {}).sections
    assert found == {
        "study": {"name": "a", "seed": 3},
        "model": {"kind": "equations", "constants": {"m": 0.5, "on": True}},
        "parameters": [{"name": "k", "unit": "1", "prior": {"median": 2.0, "range": [1.0, 4.0]}}],
        "records": [{"name": "r", "file": "data.csv", "train": [0.1, 1]}],
    }
    assert type(found["study"]["seed"]) is int and type(found["records"][0]["train"][0]) is float
    assert starlings.Study(TABLES).text() == as_study(TABLES, {}).text()


def test_overrides_of_a_file_take_them_too(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text('[study]\nname = "a"  # mine\nseed = 1\n')
    changed = starlings.Study.read(file).changed(
        study={"seed": np.int64(7)}, estimator={"gain": np.float64(0.5), "tolerance": None, "inner": {"x": None}}
    )
    assert "# mine" in changed.text()
    assert changed.sections["study"]["seed"] == 7
    assert changed.sections["estimator"].unwrap() == {"gain": 0.5, "inner": {}}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"model": {"constants": {"m": None}}}, r"`model\.constants\.m` is None.*: leave the key out"),
        ({"parameters": [{"name": "k", "prior": {"median": None}}]}, r"`parameters\.k\.prior\.median` is None"),
        ({"records": [{"train": [0, None]}]}, r"`records\[0\]\.train\[1\]` is None"),
        ({"study": {"seed": 1j}}, r"`study\.seed` is a complex, which a study file cannot say: give a number"),
        ({"study": {"seed": {1}}}, r"`study\.seed` is a set"),
        ({"study": {1: 2}}, r"`study` has the key 1, which is no text"),
    ],
)
def test_what_no_file_can_say_is_refused_by_its_key(changes, says):
    with pytest.raises(starlings.StudyError, match=says):
        as_study({**TABLES, **changes}, {})
    with pytest.raises(starlings.StudyError, match=says):
        starlings.Study({**TABLES, **changes}).text()
