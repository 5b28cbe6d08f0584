"""A real server process: how it starts, waits, is interrupted and ends."""

import os
import signal
import threading

import grpc
import numpy as np
import pytest

from decay import DECAY, request
from served import floats, numbers
from starlings import _solver_pb2 as pb


def test_a_solver_ends_when_its_lifeline_closes_even_in_a_run(serve, tmp_path):
    process = serve(
        """
        import time
        import starlings

        class Slow(starlings.Solver):
            parameters = {"k": ""}
            outputs = {"y": ""}
            def run(self, window):
                open(window.scratch + "/started", "w").close()
                while True:
                    time.sleep(0.01)

        starlings.serve(Slow)
        """
    )
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    ask = pb.RunRequest(
        parameters=floats(0.0),
        start=0.0,
        times=floats(1.0),
        outputs=["y"],
        observed=floats(np.nan),
        scratch=str(scratch),
    )
    call = process.stream(ask)
    wait_for(lambda: (scratch / "started").exists())
    process.child.stdin.close()
    assert process.child.wait(timeout=60) == 0
    with pytest.raises(grpc.RpcError):
        list(call)


def test_a_cancelled_run_stops_between_steps_and_the_next_one_is_served(serve, tmp_path):
    process = serve(
        """
        import time
        import starlings

        class Long(starlings.Solver):
            parameters = {"steps": ""}
            states = {"x": ""}
            outputs = {"y": ""}
            measures = {"y": "x"}
            dt = 1.0
            def step(self, t, dt, x, p, u):
                if p.steps > 2.0:
                    open(self.window.scratch + "/started", "w").close()
                    time.sleep(0.01)
                return x

        starlings.serve(Long)
        """
    )
    long = pb.RunRequest(
        parameters=floats(3.0),
        start=0.0,
        times=floats(1e6),
        outputs=["y"],
        observed=floats(np.nan),
        scratch=str(tmp_path),
    )
    call = process.stream(long)
    wait_for(lambda: (tmp_path / "started").exists())
    call.cancel()
    short = pb.RunRequest(
        parameters=floats(1.0), start=0.0, times=floats(1.0), outputs=["y"], observed=floats(np.nan)
    )
    # A million steps of ten milliseconds would outlast the time that `run` allows.
    assert process.run(short).WhichOneof("kind") == "finished"


def test_every_run_happens_in_the_thread_that_imported_the_solver(serve):
    process = serve(
        """
        import threading
        import starlings

        HOME = threading.get_ident()

        @starlings.solver(parameters={"k": ""}, outputs={"same": ""})
        def where(window):
            return [threading.get_ident() == HOME]

        starlings.serve(where)
        """
    )
    ask = pb.RunRequest(
        parameters=floats(1.0), start=0.0, times=floats(1.0), outputs=["same"], observed=floats(np.nan)
    )
    found = []
    callers = [threading.Thread(target=lambda: found.append(process.run(ask))) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert [numbers(reply.finished.outputs)[0] for reply in found] == [1.0] * 4


def test_a_large_state_travels_both_ways(serve):
    process = serve(
        """
        import starlings

        class Large(starlings.Solver):
            parameters = {"k": ""}
            states = [starlings.Quantity("field", size=1_000_000)]
            outputs = {"first": ""}
            def step(self, t, dt, x, p, u):
                return x + 1.0
            def output(self, t, x, p, u):
                return x[:1]

        starlings.serve(Large)
        """
    )
    state = np.arange(1_000_000, dtype="<f8")
    finished = process.run(
        pb.RunRequest(
            parameters=floats(1.0),
            start=0.0,
            times=floats(1.0),
            outputs=["first"],
            observed=floats(np.nan),
            state=state.tobytes(),
        )
    ).finished
    assert np.array_equal(numbers(finished.state), state + 1.0)


def test_progress_is_told_before_the_answer(serve):
    process = serve(
        """
        import time
        import starlings

        class Steady(starlings.Solver):
            parameters = {"k": ""}
            states = {"x": ""}
            outputs = {"y": ""}
            measures = {"y": "x"}
            def step(self, t, dt, x, p, u):
                time.sleep(0.3)
                return x

        starlings.serve(Steady)
        """
    )
    times = [1.0, 2.0, 3.0, 4.0]
    ask = pb.RunRequest(
        parameters=floats(1.0), start=0.0, times=floats(*times), outputs=["y"], observed=floats(*[np.nan] * 4)
    )
    replies = list(process.stream(ask, timeout=60))
    reached = [reply.progress.time for reply in replies[:-1]]
    assert reached and set(reached) <= set(times) and reached == sorted(reached)
    assert replies[-1].WhichOneof("kind") == "finished"


def test_a_solver_may_start_programs(serve):
    process = serve(
        """
        import subprocess
        import starlings

        @starlings.solver(parameters={"k": ""}, outputs={"worked": ""})
        def calls(window):
            # A function before the start makes Python fork, as it always does before 3.10.
            codes = [subprocess.run(["true"], preexec_fn=lambda: None).returncode for _ in range(100)]
            return [codes.count(0)]

        starlings.serve(calls)
        """
    )
    ask = pb.RunRequest(
        parameters=floats(1.0), start=0.0, times=floats(1.0), outputs=["worked"], observed=floats(np.nan)
    )
    assert numbers(process.run(ask).finished.outputs)[0] == 100.0


def test_a_declaration_that_is_wrong_names_the_file_of_the_solver(serve):
    process = serve(
        """
        import starlings

        @starlings.solver(parameters={"k": ""}, outputs=())
        def none(window):
            return []

        starlings.serve(none)
        """
    )
    assert process.child.wait(timeout=60) == 1
    said = "this solver cannot be served: `none` declares no outputs: nothing of it could be observed (some_solver.py:8)"
    assert process.stderr().strip() == said


def test_an_address_that_is_taken_is_told(serve):
    # Port reuse is off, so that a port in use is an error and never a second listener, which would get some of the runs.
    first = serve(DECAY, {"STARLINGS_SOLVER_ADDRESS": "127.0.0.1:0"})
    second = serve(DECAY, {"STARLINGS_SOLVER_ADDRESS": first.address})
    assert second.line == ""
    assert second.child.wait(timeout=60) == 1
    assert f"this solver cannot be served: cannot listen at {first.address}" in second.stderr()
    assert first.describe().name == "decay"


def test_a_socket_that_a_killed_solver_left_is_taken_over(serve):
    first = serve(DECAY)
    first.child.kill()
    first.child.wait(timeout=60)
    second = serve(DECAY)
    assert second.address == first.address and second.describe().name == "decay"


def test_a_solver_that_is_killed_leaves_its_caller_with_an_error(serve):
    process = serve(DECAY)
    process.describe()
    os.kill(process.child.pid, signal.SIGKILL)
    process.child.wait(timeout=60)
    with pytest.raises(grpc.RpcError):
        process.run(request())


def wait_for(holds):
    """Until it holds; the test's own time limit is a minute."""
    reached = threading.Event()
    for _ in range(6000):
        if holds():
            return
        reached.wait(0.01)
    raise AssertionError("waited a minute in vain")
