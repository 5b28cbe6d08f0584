"""The two calls on a socket, and the one thread that computes.

gRPC's own threads only hand over: every run happens in the thread that calls `Server.work`, one after the other, in the order
of arrival. Next file to read: serve.py.
"""

from __future__ import annotations

import os
import queue
import time
from concurrent import futures
from typing import Any, Callable, Iterator, Optional

# Read when gRPC is loaded. With its handlers for forks, programs that a solver starts die now and then before they begin.
os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")

import grpc  # noqa: E402

from . import _solver_pb2 as pb  # noqa: E402
from . import wire  # noqa: E402
from .failures import BAD_REQUEST, BadRequest, Cancelled, Failed  # noqa: E402
from .job import Answer, Job  # noqa: E402
from .one_run import execute  # noqa: E402
from .solver import Served  # noqa: E402

#: What computes a job: the answer, or Failed, or Cancelled.
Runner = Callable[[Job, Callable[[], bool], Callable[[float], None]], Answer]

#: Seconds between two messages of progress at least.
_PROGRESS_EVERY = 0.5

#: States may have any size; large frames spare wake-ups.
OPTIONS = [
    ("grpc.max_receive_message_length", -1),
    ("grpc.max_send_message_length", -1),
    ("grpc.http2.max_frame_size", 16_777_215),
    ("grpc.so_reuseport", 0),
]


class _Call:
    """One call of Run: its request, its replies, and whether anybody still waits.

    gRPC holds what it deserialized and what it serializes for as long as the call lasts. It is therefore given this in the place of
    a request, which goes when it was read, and replies as bytes, so that a large state is in memory once and not in three forms.
    """

    def __init__(self, data: bytes) -> None:
        self._request: Any = pb.RunRequest.FromString(data)
        self.replies: queue.SimpleQueue[Optional[bytes]] = queue.SimpleQueue()
        self.over = False
        self._told = time.monotonic()

    def job(self) -> Job:
        """The job that is asked for; once. Raises BadRequest."""
        request, self._request = self._request, None
        return wire.job(request)

    def reply(self, message: Any) -> None:
        """Sends a message."""
        self.replies.put(message.SerializeToString())

    def end(self) -> None:
        """The call was answered, or given up."""
        self.over = True
        self.replies.put(None)

    def stopped(self) -> bool:
        return self.over

    def progress(self, reached: float) -> None:
        now = time.monotonic()
        if now - self._told >= _PROGRESS_EVERY:
            self._told = now
            self.reply(wire.progress(reached))


class Server:
    """Serves one solver at one address."""

    def __init__(self, served: Served, runner: Optional[Runner] = None) -> None:
        self._description = wire.description(served)
        self._runner: Runner = runner or (
            lambda job, stopped, progress: execute(served, job, stopped, progress)
        )
        self._calls: queue.SimpleQueue[Optional[_Call]] = queue.SimpleQueue()
        self._server = grpc.server(futures.ThreadPoolExecutor(max_workers=8), options=OPTIONS)
        handlers = {
            "Describe": grpc.unary_unary_rpc_method_handler(
                lambda request, context: self._description,
                request_deserializer=pb.DescribeRequest.FromString,
                response_serializer=pb.Description.SerializeToString,
            ),
            "Run": grpc.unary_stream_rpc_method_handler(
                self._run,
                request_deserializer=_Call,
                response_serializer=None,
            ),
        }
        service = grpc.method_handlers_generic_handler("starlings.solver.v1.Solver", handlers)
        self._server.add_generic_rpc_handlers((service,))

    def listen(self, address: str) -> str:
        """Listens at `unix:PATH` or `host:port` and returns where; port 0 becomes the port that was free.

        Raises OSError where nobody can listen.
        """
        try:
            port = self._server.add_insecure_port(address)
        except RuntimeError as error:
            raise OSError(f"cannot listen at {address}: {error}") from error
        if port == 0:
            raise OSError(f"cannot listen at {address}")
        self._server.start()
        if address.startswith("unix:"):
            return address
        return f"{address.rpartition(':')[0]}:{port}"

    def work(self) -> None:
        """Computes, for ever or until `stop`."""
        while True:
            call = self._calls.get()
            if call is None:
                return
            if not call.over:
                self._answer(call)
            call.end()

    def stop(self) -> None:
        """Ends `work` after the runs that have arrived, and listening."""
        self._calls.put(None)
        self._server.stop(None)

    def _run(self, call: _Call, context: Any) -> Iterator[bytes]:
        if not context.add_callback(call.end):
            return
        self._calls.put(call)
        while True:
            reply = call.replies.get()
            if reply is None:
                return
            yield reply

    def _answer(self, call: _Call) -> None:
        try:
            # Nothing of it has a name here: what a run needs no more is gone before the answer is made.
            call.reply(wire.finished(self._runner(call.job(), call.stopped, call.progress)))
        except Cancelled:
            return
        except BadRequest as error:
            call.reply(wire.failure(Failed(BAD_REQUEST, str(error))))
        except Failed as error:
            call.reply(wire.failure(error))
