"""A real server process over a real socket: what it answers."""

import re
from pathlib import Path

import numpy as np
import pytest

from decay import DECAY, request
from served import floats, numbers
from starlings import _solver_pb2 as pb


def test_a_solver_says_what_it_is(serve):
    said = serve(DECAY).describe()
    assert (said.protocol, said.name, said.says) == (2, "decay", "A height that falls.")
    assert [(q.name, q.unit) for q in said.parameters] == [("rate", "1/s")]
    assert [(q.name, q.unit, q.size) for q in said.states] == [("x", "m", 1)]
    assert [q.name for q in said.inputs] == ["rise"]
    assert said.restart and said.deterministic
    assert list(said.observers) == ["nudging"] and list(said.hosts) == ["x"]
    assert [(m.output, m.state) for m in said.measures] == [("height", "x")]
    assert not said.parameters[0].HasField("default_value") and not said.parameters[0].HasField("lo")


def test_a_run_comes_back_over_a_unix_socket(serve):
    process = serve(DECAY)
    assert process.line == f"starlings-solver ready unix:{process.socket}\n"
    finished = process.run(request()).finished
    # Fifty steps of a fourth-order method: the error is (rate dt)^5/120 per step, about 1e-12 in all.
    assert np.allclose(numbers(finished.outputs), np.exp([-0.25, -0.5]), rtol=1e-11, atol=0)
    assert numbers(finished.state)[0] == numbers(finished.outputs)[1]


def test_a_solver_listens_at_a_port_that_is_free(serve):
    process = serve(DECAY, {"STARLINGS_SOLVER_ADDRESS": "127.0.0.1:0"})
    assert re.fullmatch(r"starlings-solver ready 127\.0\.0\.1:[1-9][0-9]*\n", process.line)
    assert process.describe().name == "decay"


def test_a_restart_gives_the_bits_of_one_run(serve):
    process = serve(DECAY)
    driven = [pb.Signal(times=floats(0.0, 0.33, 1.0), values=floats(0.0, 2.0, -1.0))]
    times = np.linspace(0.1, 1.0, 10)
    whole = process.run(request(times=floats(*times), observed=floats(*[np.nan] * 10), inputs=driven)).finished
    state, start, pieces = None, 0.0, []
    for part in (times[:3], times[3:4], times[4:]):
        observed = floats(*[np.nan] * len(part))
        ask = request(times=floats(*part), start=start, observed=observed, inputs=driven)
        if state is not None:
            ask.state = state
        finished = process.run(ask).finished
        pieces.append(finished.outputs)
        state, start = finished.state, part[-1]
    assert b"".join(pieces) == whole.outputs
    assert state == whole.state


def test_a_scalar_state_can_be_asked_for_as_if_it_were_an_output(serve):
    process = serve(DECAY)
    finished = process.run(request(outputs=["height", "x"], observed=floats(*[np.nan] * 4))).finished
    table = numbers(finished.outputs).reshape(2, 2)
    assert np.array_equal(table[:, 0], table[:, 1])
    nudged = process.run(
        request(
            outputs=["x"],
            times=floats(0.5),
            observed=floats(5.0),
            observer=pb.Observer(kind="nudging", gain=1e6),
        )
    ).finished
    # At such a gain the state is the datum; what was predicted before stays.
    assert numbers(nudged.state)[0] == pytest.approx(5.0, rel=1e-15)
    assert numbers(nudged.outputs)[0] == table[0, 1]


def test_equal_requests_give_equal_bytes(serve):
    process = serve(DECAY)
    assert process.run(request()) == process.run(request())


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"parameters": floats(1.0, 2.0)}, "parameters: expected 1 numbers (rate), got 2"),
        ({"parameters": b"123"}, "parameters: 3 bytes are no whole count of 64-bit numbers"),
        ({"state": floats(1.0, 2.0)}, "state: expected 1 numbers (x), got 2"),
        ({"outputs": ["heigth"]}, "no output `heigth`; there are height"),
        ({"observed": floats(1.0)}, "observed values: expected 2 times of 1 (height), got 1"),
        ({"times": floats(0.5, 0.5)}, "observation times must increase from the start of the window"),
        ({"times": b"", "observed": b""}, "a window without observation times"),
        ({"inputs": []}, "input signals: expected 1 (rise), got 0"),
        ({"start": None}, "a request without start"),
        ({"observer": pb.Observer(kind="sdf", gain=1.0)}, "`decay` hosts no observer `sdf`; it hosts nudging"),
        (
            {"terms": [pb.Term(state="y", expression="1")]},
            "a term for the state `y`, which hosts none; states that do: x",
        ),
        (
            {"terms": [pb.Term(state="x", expression="2*nobody")]},
            "the term of `x`: `2*nobody`, column 3: nothing is named `nobody`",
        ),
    ],
)
def test_what_does_not_fit_is_told_in_a_sentence(serve, changes, said):
    failure = serve(DECAY).run(request(**changes)).failure
    assert (failure.kind, failure.text) == (pb.Failure.BAD_REQUEST, said)


BROKEN = """
    import sys
    import numpy as np
    import starlings

    class Stop(BaseException):
        pass

    class Broken(starlings.Solver):
        parameters = {"how": ""}
        states = [starlings.Quantity("wall", "m", size=2)]
        outputs = {"y": ""}
        dt = 1.0
        def step(self, t, dt, x, p, u):
            print("noise on standard output")
            if p.how == 1.0:
                return 1 / 0
            if p.how == 2.0:
                return [0.0, np.nan]
            if p.how == 3.0:
                return [1.0, 2.0, 3.0]
            if p.how == 4.0:
                raise starlings.NotFinite("pressure", t)
            if p.how == 6.0:
                sys.exit(3)
            if p.how == 7.0:
                input("how far? ")
            if p.how == 8.0:
                raise Stop("enough")
            return x
        def output(self, t, x, p, u):
            return [np.inf if p.how == 5.0 else 0.0]

    starlings.serve(Broken)
"""


@pytest.mark.parametrize(
    ("how", "kind", "text", "time"),
    [
        (1.0, pb.Failure.SOLVER, "ZeroDivisionError: division by zero (some_solver.py:17)", None),
        (2.0, pb.Failure.NOT_FINITE, "state `wall[1]`", 1.0),
        (
            3.0,
            pb.Failure.SOLVER,
            "ValueError: step returned the states: expected 2 numbers (wall[2]), got 3",
            None,
        ),
        (4.0, pb.Failure.NOT_FINITE, "pressure", 0.0),
        (5.0, pb.Failure.NOT_FINITE, "output `y`", 1.0),
        (6.0, pb.Failure.SOLVER, "SystemExit: 3 (some_solver.py:25): the model ended the process by sys.exit; raise", None),
        (7.0, pb.Failure.SOLVER, "EOFError: EOF when reading a line (some_solver.py:27)", None),
        (8.0, pb.Failure.SOLVER, "Stop: enough (some_solver.py:29)", None),
    ],
)
def test_a_failure_is_told_and_the_next_run_goes_on(serve, how, kind, text, time):
    process = serve(BROKEN)

    def ask(value):
        return process.run(
            pb.RunRequest(
                parameters=floats(value), start=0.0, times=floats(1.0), outputs=["y"], observed=floats(np.nan)
            )
        )

    failure = ask(how).failure
    assert failure.kind == kind
    assert failure.text.startswith(text)
    # What was returned wrongly is placed where it was returned; several lines return here, so it is that of the method.
    assert how != 3.0 or failure.text.endswith("(some_solver.py:14)"), failure.text
    assert "\n" not in failure.text
    assert (failure.time if failure.HasField("time") else None) == time
    assert ask(0.0).WhichOneof("kind") == "finished"
    assert ("Traceback" in process.stderr()) == (kind == pb.Failure.SOLVER)
    code, rest = process.close()
    assert (code, rest) == (0, "")
    assert "noise on standard output" in process.stderr()


FIELD = """
import numpy as np
import starlings

class Field(starlings.Solver):
    parameters = {"rate": "1/s"}
    states = [starlings.Quantity("x", size=8_000_000)]
    outputs = {"height": "m"}
    dt = 0.1

    def initial(self, p):
        return np.ones(8_000_000)

    def step(self, t, dt, x, p, u):
        return x * (1.0 - p.rate * dt)

    def output(self, t, x, p, u):
        return [x[0]]

starlings.serve(Field)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is read from /proc")
def test_a_large_state_is_in_memory_a_few_times_and_not_after_the_run(serve):
    process = serve(FIELD)

    def megabytes(name):
        status = Path(f"/proc/{process.child.pid}/status").read_text()
        return int(re.search(rf"{name}:\s+(\d+) kB", status).group(1)) / 1000

    process.describe()
    before, size = megabytes("VmRSS"), 64
    ask = request(times=floats(0.2), observed=floats(np.nan), inputs=[])
    for _ in range(4):
        ended = process.run(ask).finished
        assert len(ended.state) == size * 1_000_000
        ask.state = ended.state
    # The states that the run has, first, last and next; what gRPC received and sent of the messages is free, but in the allocator.
    assert megabytes("VmHWM") < before + 5.5 * size
    assert megabytes("VmRSS") < before + 2.5 * size
