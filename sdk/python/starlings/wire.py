"""Between the messages of solver.proto and arrays. Nothing else touches the messages.

Next file to read: service.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _solver_pb2 as pb
from .failures import BadRequest, Failed
from .job import Answer, Job
from .quantity import Layout
from .solver import Served
from .values import Array, Signal

#: Number of the protocol that this package speaks.
PROTOCOL = 2

_FLOAT = np.dtype("<f8")


def description(served: Served) -> Any:
    """What the solver is, as a message."""
    return pb.Description(
        protocol=PROTOCOL,
        name=served.name,
        says=served.says,
        states=_quantities(served.states),
        parameters=_quantities(served.parameters),
        outputs=_quantities(served.outputs),
        inputs=_quantities(served.inputs),
        restart=served.restart,
        deterministic=served.solver.deterministic,
        observers=served.kinds,
        hosts=served.hosts,
        measures=[pb.Measure(output=o, state=s) for o, s in served.measures.items()],
    )


def _quantities(layout: Layout) -> Any:
    return [
        pb.Quantity(
            name=q.name,
            unit=q.unit,
            size=q.size,
            role=q.role,
            lo=q.lo,
            hi=q.hi,
            default_value=q.default,
            says=q.says,
        )
        for q in layout.quantities
    ]


def numbers(data: bytes, what: str) -> Array:
    """Bytes as numbers, without a copy. Raises BadRequest where they are not a whole count of them."""
    if len(data) % _FLOAT.itemsize:
        raise BadRequest(f"{what}: {len(data)} bytes are no whole count of 64-bit numbers")
    return np.frombuffer(data, dtype=_FLOAT)


def job(request: Any) -> Job:
    """The job of a request. Raises BadRequest."""
    if not request.HasField("start"):
        raise BadRequest("a request without start")
    signals = []
    for i, signal in enumerate(request.inputs):
        what = f"input {i + 1}"
        signals.append(Signal(numbers(signal.times, what), numbers(signal.values, what)))
    return Job(
        parameters=numbers(request.parameters, "parameters"),
        times=numbers(request.times, "times"),
        start=request.start,
        outputs=list(request.outputs),
        state=numbers(request.state, "state") if request.HasField("state") else None,
        observed=numbers(request.observed, "observed"),
        initial={named.name: named.value for named in request.initial},
        observer=request.observer.kind,
        gain=request.observer.gain,
        signals=signals,
        terms=[(term.state, term.expression) for term in request.terms],
        constants={named.name: named.value for named in request.constants},
        scratch=request.scratch,
        particle=request.particle,
        record=request.record,
        traceparent=request.traceparent,
    )


def finished(answer: Answer) -> Any:
    """A prediction as a message."""
    # Set in place: a message given to another message's constructor is copied.
    reply = pb.RunReply()
    reply.finished.outputs = _bytes(answer.outputs)
    reply.finished.state = _bytes(answer.state)
    return reply


def failure(failed: Failed) -> Any:
    """A failure as a message."""
    kind = pb.Failure.Kind.Value(failed.kind)
    return pb.RunReply(failure=pb.Failure(kind=kind, text=failed.text, time=failed.time))


def progress(time: float) -> Any:
    """How far a run has come, as a message."""
    return pb.RunReply(progress=pb.Progress(time=time))


def _bytes(values: Array) -> bytes:
    return np.ascontiguousarray(values, dtype=_FLOAT).tobytes()
