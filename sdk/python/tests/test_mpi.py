"""A solver of two MPI ranks. Needs mpi4py and mpiexec."""

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import grpc
import numpy as np
import pytest

import starlings
from served import floats, numbers
from starlings import _solver_pb2 as pb

pytest.importorskip("mpi4py")
LAUNCHER = shutil.which("mpiexec")
if LAUNCHER is None:
    pytest.skip("no mpiexec", allow_module_level=True)

SUM = """
    import numpy as np
    import starlings
    import starlings.mpi
    from mpi4py import MPI

    COMM = MPI.COMM_WORLD

    class Sum(starlings.Solver):
        "Adds what the ranks have."
        parameters = {"a": ""}
        states = {"x": ""}
        outputs = {"y": ""}

        def run(self, window):
            if window.p.a < 0.0:
                raise ValueError(f"a is {window.p.a}")
            if window.p.a > 100.0 and COMM.rank == 1:
                raise ValueError("rank 1 alone")
            total = COMM.allreduce(window.p.a * 10.0**COMM.rank)
            return np.full(window.times.size, total + window.state[0]), [total]

    if __name__ == "__main__":
        starlings.mpi._GRACE = 0.5
        starlings.mpi.serve(Sum)
"""


class Ranks:
    def __init__(self, folder, script=None):
        if script is None:
            script = folder / "sum.py"
            script.write_text(textwrap.dedent(SUM))
        # Open MPI refuses to run as root and to share cores unless it is told that this is meant.
        allowed = {
            "OMPI_ALLOW_RUN_AS_ROOT": "1",
            "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
            "OMPI_MCA_rmaps_base_oversubscribe": "1",
            "OMPI_MCA_mpi_yield_when_idle": "1",
        }
        package = str(Path(__file__).resolve().parent.parent)
        environment = dict(
            os.environ,
            STARLINGS_SOLVER_SOCKET=str(folder / "s.sock"),
            STARLINGS_LIFELINE="1",
            PYTHONPATH=os.pathsep.join([package, os.environ.get("PYTHONPATH", "")]),
            **allowed,
        )
        self.log = folder / "stderr.txt"
        self.child = subprocess.Popen(
            [LAUNCHER, "-n", "2", sys.executable, str(script)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=open(self.log, "wb"),
            text=True,
        )
        self.line = self.child.stdout.readline()
        channel = grpc.insecure_channel(self.line.split()[-1])
        self.stream = channel.unary_stream(
            "/starlings.solver.v1.Solver/Run",
            request_serializer=pb.RunRequest.SerializeToString,
            response_deserializer=pb.RunReply.FromString,
        )

    def run(self, a, state=None):
        request = pb.RunRequest(
            parameters=floats(a),
            start=0.0,
            times=floats(1.0),
            outputs=["y"],
            observed=floats(np.nan),
            state=state,
        )
        return list(self.stream(request, timeout=60))[-1]


@pytest.fixture
def ranks(tmp_path):
    started = Ranks(tmp_path)
    yield started
    if started.child.poll() is None:
        started.child.kill()
        started.child.wait()


def test_two_ranks_run_one_request(ranks):
    assert ranks.line.startswith("starlings-solver ready unix:")
    first = ranks.run(2.0).finished
    assert numbers(first.outputs)[0] == 22.0
    second = ranks.run(1.0, first.state).finished
    assert numbers(second.outputs)[0] == 33.0


def test_a_failure_on_all_ranks_is_told_and_the_next_run_goes_on(ranks):
    assert ranks.run(-1.0).failure.text == "ValueError: a is -1.0 (sum.py:17)"
    assert ranks.run(2.0).WhichOneof("kind") == "finished"


def test_a_failure_on_one_rank_while_the_other_waits_for_it_ends_both(ranks):
    with pytest.raises(grpc.RpcError):
        ranks.run(200.0)
    assert ranks.child.wait(timeout=60) != 0
    assert "ValueError: rank 1 alone" in ranks.log.read_text()
    assert "a rank failed and the others went on" in ranks.log.read_text()


def test_all_ranks_end_when_the_lifeline_closes(ranks):
    ranks.run(2.0)
    ranks.child.stdin.close()
    assert ranks.child.wait(timeout=60) == 0


def test_the_examples_rod_gives_the_same_bits_on_two_ranks_as_on_one(tmp_path):
    example = Path(__file__).resolve().parents[3] / "examples" / "mpi" / "rod.py"
    two = Ranks(tmp_path, example)
    try:
        times = np.arange(1.0, 11.0)
        drive = ([0.0, 10.0], [0.0, 0.02])
        request = pb.RunRequest(
            parameters=floats(9e-5, 0.004),
            start=0.0,
            times=floats(*times),
            outputs=["sensors"],
            observed=floats(*[np.nan] * 40),
            inputs=[pb.Signal(times=floats(*drive[0]), values=floats(*drive[1]))],
        )
        finished = list(two.stream(request, timeout=60))[-1].finished
    finally:
        two.child.kill()
        two.child.wait()
    names = {"__name__": "rod"}
    exec(example.read_text(), names)  # the repository's own text
    one = starlings.simulate(
        names["Rod"], parameters={"kappa": 9e-5, "loss": 0.004}, times=times, inputs={"heater": drive}
    )
    assert one.outputs["sensors"].tobytes() == finished.outputs
    assert one.state.tobytes() == finished.state
