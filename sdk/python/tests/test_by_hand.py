"""A solver that somebody starts, and what the README shows."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import starlings

PACKAGE = Path(__file__).resolve().parent.parent
SOLVER = """
import starlings

class Beam(starlings.Solver):
    "A beam that bends."
    parameters = [starlings.Quantity("E", "Pa", role="stiffness", lo=0.0, default=2e11, says="Young's modulus.")]
    states = [starlings.Quantity("d", "m", size=3, role="displacement")]
    outputs = {"tip": "m"}

    def step(self, t, dt, x, p, u):
        return x

    def output(self, t, x, p, u):
        return x[-1:]

starlings.serve(Beam)
"""


def start(tmp_path, *arguments, source=SOLVER, **environment):
    """How a script ends."""
    script = tmp_path / "beam.py"
    script.write_text(source)
    plain = {name: value for name, value in os.environ.items() if not name.startswith("STARLINGS_")}
    return subprocess.run(
        [sys.executable, str(script), *arguments],
        env=dict(plain, PYTHONPATH=str(PACKAGE), **environment),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_describe_prints_what_the_solver_declares(tmp_path):
    done = start(tmp_path, "--describe")
    assert done.returncode == 0
    assert done.stdout == (
        "beam: A beam that bends.\n\n"
        "parameters:\n  E  Pa  stiffness; 0 to inf; default 2e+11; Young's modulus.\n\n"
        "states:\n  d[3]  m  displacement\n\n"
        "outputs:\n  tip  m\n\n"
        "inputs: none\n\n"
        "restart:       yes\ndeterministic: yes\nobservers:     none\nhosts terms:   none\n"
    )


def test_started_by_hand_it_says_how_to_use_it(tmp_path):
    done = start(tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert 'kind = "solver"\ncommand = ["python3", "beam.py"]' in done.stderr
    assert 'name = "E"\nunit = "Pa"' in done.stderr


@pytest.mark.parametrize(
    ("environment", "words"),
    [
        ({"STARLINGS_SOLVER_ADDRESS": "nowhere"}, "expected host:port such as 127.0.0.1:0"),
        ({"STARLINGS_SOLVER_ADDRESS": "127.0.0.1:70000"}, "expected host:port such as 127.0.0.1:0"),
        ({"STARLINGS_SOLVER_SOCKET": "/tmp/" + "s" * 120}, "more than 107 bytes"),
        ({"STARLINGS_SOLVER_SOCKET": "/no/such/folder/s.sock"}, "cannot listen at unix:/no/such/folder/s.sock"),
    ],
)
def test_an_address_that_is_none_is_told_in_a_line(tmp_path, environment, words):
    done = start(tmp_path, **environment)
    assert (done.returncode, done.stdout) == (1, "")
    assert words in done.stderr and "Traceback" not in done.stderr


def test_a_declaration_that_does_not_fit_is_told_in_a_line(tmp_path):
    done = start(tmp_path, "--describe", source=SOLVER.replace('{"tip": "m"}', '["tip", "tip"]'))
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "this solver cannot be served: outputs name `tip` twice (beam.py:16)\n"


def blocks():
    return re.findall(r"```python\n(.*?)```", (PACKAGE / "README.md").read_text(), re.DOTALL)


def test_the_first_solver_of_the_readme_runs_as_it_says():
    names = {"__name__": "readme", "np": np}
    exec(next(block for block in blocks() if "class Oscillator" in block), names)  # the repository's own text
    exec(next(block for block in blocks() if "starlings.simulate" in block), names)
    # Released at 0.1 m with the spring of 40 N/m: the first quarter of a period of 0.99 s is over after 0.25 s.
    position = names["run"].outputs["position"]
    assert position[0] == 0.1 and 0.2 < np.argmax(position < 0.0) * 0.01 < 0.3


def test_the_function_of_the_readme_is_a_solver():
    names = {"__name__": "readme", "np": np, "starlings": starlings}
    exec(next(block for block in blocks() if "def decay" in block), names)
    run = starlings.simulate(names["decay"], parameters={"rate": 2.0, "size": 3.0}, times=[0.5])
    assert run.outputs["height"][0] == 3.0 * np.exp(-1.0)


def test_the_examples_solver_is_the_first_of_the_readme():
    example = (PACKAGE.parents[1] / "examples" / "solver-python" / "oscillator.py").read_text()
    # But for its first lines, which say what it is.
    assert next(block for block in blocks() if "class Oscillator" in block).split("@starlings", 1)[1] == example.split("@starlings", 1)[1]
