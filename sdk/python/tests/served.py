"""A solver in a process of its own, called as the worker calls it."""

import os
import subprocess
import sys
from pathlib import Path

# Before gRPC: it must know that programs are started beside it.
import starlings  # noqa: F401
from starlings import _solver_pb2 as pb

import grpc  # isort: skip
import numpy as np  # isort: skip

PACKAGE = Path(__file__).resolve().parent.parent
UNLIMITED = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]


def floats(*values):
    """Numbers as the wire has them."""
    return np.array(values, dtype="<f8").tobytes()


def numbers(data):
    """The other way."""
    return np.frombuffer(data, dtype="<f8")


class Process:
    """A served solver; `address` is what its one line said."""

    def __init__(self, script, folder, environment=None, arguments=()):
        self.socket = str(Path(folder) / "solver.sock")
        chosen = {"STARLINGS_SOLVER_SOCKET": self.socket} if environment is None else environment
        path = os.pathsep.join([str(PACKAGE), os.environ.get("PYTHONPATH", "")])
        self.child = subprocess.Popen(
            [sys.executable, str(script), *arguments],
            env=dict(os.environ, PYTHONPATH=path, STARLINGS_LIFELINE="1", **chosen),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=open(Path(folder) / "stderr.txt", "wb"),
            text=True,
        )
        self.folder = Path(folder)
        self.line = self.child.stdout.readline()
        self.address = self.line.split()[-1] if self.line else ""
        self.channel = grpc.insecure_channel(self.address, options=UNLIMITED)
        self._describe = self.channel.unary_unary(
            "/starlings.solver.v1.Solver/Describe",
            request_serializer=pb.DescribeRequest.SerializeToString,
            response_deserializer=pb.Description.FromString,
        )
        self.stream = self.channel.unary_stream(
            "/starlings.solver.v1.Solver/Run",
            request_serializer=pb.RunRequest.SerializeToString,
            response_deserializer=pb.RunReply.FromString,
        )

    def describe(self):
        return self._describe(pb.DescribeRequest(protocol=2), timeout=60)

    def run(self, request):
        """The last reply."""
        return list(self.stream(request, timeout=60))[-1]

    def stderr(self):
        return (self.folder / "stderr.txt").read_text()

    def close(self):
        """Closes the lifeline; returns how the process ended and what else it printed on standard output."""
        self.channel.close()
        self.child.stdin.close()
        code = self.child.wait(timeout=60)
        rest = self.child.stdout.read()
        self.child.stdout.close()
        return code, rest
