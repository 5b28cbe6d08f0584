"""Studies made in Python: of functions and arrays, of files, changed."""

import numpy as np
import pytest

import starlings
from starlings.pickled import pack, unpack

TABLE = {"t": [0.0, 1.0, 2.0], "power": [1.0, 1.0, 0.0], "T": [20.0, 21.0, 22.0]}
PRIORS = {"capacity": starlings.Prior(30.0, factor=2, unit="J/K"), "loss": starlings.Prior(1.0, sd=0.5)}


def tank(t, power, capacity, loss, room=20.0):
    """Temperature of a tank.

    At the times t."""
    return room + np.cumsum(power) / capacity - loss * t


def study(**changes):
    return starlings.study(**{"model": tank, "data": TABLE, "priors": PRIORS, **changes})


def test_a_function_and_a_table_are_a_study():
    made = study(noise=0.1, train=(0, 1), units={"T": "degC"}, estimator={"max_iterations": 5})
    assert made.name == "tank"
    assert made.sections["parameters"][1] == {
        "name": "loss",
        "unit": "1",
        "prior": {"median": 1.0, "transform": "linear", "sd": 0.5},
    }
    (record,) = made.sections["records"]
    assert record["inputs"] == {"power": "power"}
    assert record["channels"] == [{"column": "T", "output": "T", "noise": 0.1}]
    assert record["train"] == [0.0, 1.0]
    assert made.sections["estimator"] == {"max_iterations": 5}
    assert made.files["data.csv"].startswith(b"t,power,T\n0.0,1.0,20.0\n")


def test_a_column_of_any_name_is_measured_where_its_output_is_named():
    made = study(data={**TABLE, "Temp [°C]": TABLE["T"]}, outputs={"temp": "Temp [°C]"}, noise={"Temp [°C]": 0.1})
    assert made.sections["records"][0]["channels"] == [{"column": "Temp [°C]", "output": "temp", "noise": 0.1}]


def test_the_function_arrives_whole_and_is_run_as_a_solver():
    solver = unpack(study().files["model.pkl"])
    assert solver.__doc__.startswith("Temperature of a tank")
    found = starlings.simulate(
        solver, parameters={"capacity": 10.0, "loss": 0.5}, times=[1.0, 2.0], inputs={"power": ([0, 2], [2.0, 4.0])}
    )
    assert np.allclose(found.outputs["T"], tank(np.array([1.0, 2.0]), np.array([3.0, 4.0]), 10.0, 0.5))


def test_a_class_of_a_solver_travels_too():
    @starlings.solver(parameters={"k": "1/s"}, states={"x": "m"}, outputs={"x": "m"}, measures={"x": "x"}, dt=0.1)
    class Decay:
        def rate(self, t, x, p, u):
            return [-p.k * x[0]]

    made = starlings.study(Decay, {"t": [0, 1], "x": [1, 0.5]}, {"k": starlings.Prior(1, factor=2)})
    assert made.name == "decay"
    assert starlings.Solver in unpack(made.files["model.pkl"]).__mro__


def test_what_cannot_be_carried_says_what_to_do():
    lock = __import__("threading").Lock()

    def locked(t, k):
        with lock:
            return k * t

    with pytest.raises(starlings.DeclarationError, match=r"`locked` cannot be carried .* starlings\.serve"):
        pack(locked, parameters={"k": "1"}, inputs={}, outputs={"y": "1"})


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"priors": {"capacity": starlings.Prior(1, factor=2)}}, "`tank` takes `loss`, which is no parameter with a prior"),
        ({"priors": {**PRIORS, "mass": starlings.Prior(1, factor=2)}}, "takes no `mass`"),
        ({"priors": {**PRIORS, "loss": 3.0}}, r"write starlings.Prior\(3.0, factor=2\)"),
        ({"priors": {**PRIORS, "loss": starlings.Prior(3.0)}}, "`loss` needs either `factor` or `sd`"),
        ({"priors": {**PRIORS, "loss": starlings.Prior(3.0, lo=0, factor=2)}}, "one bound"),
        ({"outputs": {"T": "temperature"}}, "names the column `temperature`; there are power, T"),
        ({"held_out": ["monday"]}, "`held_out` names `monday`; there are data"),
        ({"model": lambda *all: all}, r"takes `\*all`: name its arguments"),
        ({"noise": {"Q": 0.3}}, "`noise` names `Q`, which is no column that is measured; there are T$"),
        ({"noise": {"power": 0.3}}, "`noise` names `power`, which is no column that is measured; there are T$"),
        (
            {"data": {**TABLE, "Temp [°C]": TABLE["T"]}},
            r'`Temp \[°C\]` cannot be the name of an output, .* with outputs=\{"temp": "Temp \[°C\]", "T": "T"\}, without',
        ),
        ({"outputs": {"T (K)": "T"}}, r'`T \(K\)` cannot be the name of an output, .* outputs=\{"y": "T"\}'),
        ({"model": 3}, "the model is 3: give a function"),
        ({"data": []}, "no recordings"),
        ({"data": {"a/b": TABLE}}, "holds a slash"),
        ({"data": {"a": TABLE, "b": {"t": [0], "T": [1]}}}, "record `b` has no column `power`"),
    ],
)
def test_what_makes_no_study_is_said(changes, says):
    with pytest.raises(starlings.DeclarationError, match=says):
        study(**changes)


def test_a_study_is_changed_by_names_and_keeps_its_comments(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text('# mine\n[study]\nname = "a"\n\n[[parameters]]\nname = "k"\nunit = "1"\nprior = { median = 1.0, factor = 2 }\n')
    read = starlings.Study.read(file)
    changed = read.changed(study={"seed": 7}, parameters={"k": {"prior": {"median": 2.0}}}, estimator={"kind": "batch"})
    assert read.text() == file.read_text()
    again = starlings.Study.read(changed.save(tmp_path / "new"))
    assert "# mine" in again.text()
    assert again.sections["parameters"][0]["prior"] == {"median": 2.0, "factor": 2}
    assert (again.sections["study"]["seed"], again.sections["estimator"]["kind"]) == (7, "batch")
    with pytest.raises(starlings.StudyError, match="no entry of `parameters` is named `q`; there are k"):
        read.changed(parameters={"q": {"unit": "m"}})
    assert read.changed(parameters={"k": None}).sections["parameters"] == []


def test_what_is_no_toml_is_said_with_its_line(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text("[study]\nname = \n")
    with pytest.raises(starlings.StudyError, match="line 2"):
        starlings.Study.read(file)
