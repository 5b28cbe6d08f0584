"""Measures what serving costs: the round trip of an empty run, and the throughput of a large state.

    python3 bench.py [--state-mb 8] [--runs 2000]

Starts a solver that does nothing in a process of its own, on a Unix socket, and calls it from this one. The client is Python
too, and its cost is in the figures. Linux only.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import grpc
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import starlings  # noqa: E402
from starlings import _solver_pb2 as pb  # noqa: E402
from starlings import wire  # noqa: E402
from starlings.run import execute  # noqa: E402
from starlings.service import OPTIONS  # noqa: E402
from starlings.solver import Served  # noqa: E402


def solver(size: int) -> starlings.Solver:
    """A state that stays as it is."""

    class Still(starlings.Solver):
        parameters = {"k": ""}
        states = [starlings.Quantity("x", size=size)]
        outputs = {"y": ""}

        def step(self, t, dt, x, p, u):
            return x

        def output(self, t, x, p, u):
            return [x[0]]

    return Still()


def request(state=None) -> pb.RunRequest:
    """One observation time, one output."""
    one = np.zeros(1).tobytes()
    return pb.RunRequest(
        parameters=one,
        start=0.0,
        times=np.ones(1).tobytes(),
        outputs=["y"],
        observed=one,
        state=None if state is None else state.tobytes(),
    )


def timed(call, runs: int) -> np.ndarray:
    """Seconds of each call."""
    seconds = np.empty(runs)
    for i in range(runs):
        begin = time.perf_counter()
        call()
        seconds[i] = time.perf_counter() - begin
    return seconds


def told(label: str, seconds: np.ndarray) -> None:
    p10, p50, p90 = np.percentile(seconds, [10, 50, 90]) * 1e3
    print(f"{label:<34} median {p50:8.3f} ms   10 % {p10:8.3f} ms   90 % {p90:8.3f} ms")


def spent(pid: int) -> float:
    """Processor time of a process so far, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(size: int, runs: int, folder: str) -> None:
    """Serves a state of `size` numbers and calls it."""
    path = os.path.join(folder, f"{size}.sock")
    environment = dict(os.environ, STARLINGS_SOLVER_SOCKET=path, STARLINGS_LIFELINE="1")
    child = subprocess.Popen(
        [sys.executable, __file__, "--serve", str(size)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    address = child.stdout.readline().split()[-1]
    channel = grpc.insecure_channel(address, options=OPTIONS)
    call = channel.unary_stream(
        "/starlings.solver.v1.Solver/Run",
        request_serializer=pb.RunRequest.SerializeToString,
        response_deserializer=pb.RunReply.FromString,
    )
    sent = request(np.zeros(size))
    for reply in call(sent):
        assert reply.WhichOneof("kind") == "finished", reply
    before = spent(child.pid)
    seconds = timed(lambda: list(call(sent)), runs)
    processor = (spent(child.pid) - before) / runs * 1e3
    served = Served(solver(size))
    inside = timed(lambda: wire.finished(execute(served, wire.job(sent))), runs)
    told(f"{size} numbers: round trip", seconds)
    told(f"{size} numbers: without gRPC", inside)
    print(f"{size} numbers: processor time of the server {processor:.3f} ms per run")
    if size > 1000:
        moved = 2 * 8 * size / np.median(seconds) / 1e9
        print(f"{size} numbers: {moved:.2f} GB/s, both ways together")
    child.stdin.close()
    child.wait()


def main() -> None:
    """Both measurements."""
    options = argparse.ArgumentParser()
    options.add_argument("--state-mb", type=float, default=8.0)
    options.add_argument("--runs", type=int, default=2000)
    options.add_argument("--serve", type=int)
    chosen = options.parse_args()
    if chosen.serve:
        starlings.serve(solver(chosen.serve), [])
        return
    with tempfile.TemporaryDirectory() as folder:
        measure(1, chosen.runs, folder)
        measure(int(chosen.state_mb * 1e6 / 8), max(20, chosen.runs // 40), folder)


if __name__ == "__main__":
    main()
