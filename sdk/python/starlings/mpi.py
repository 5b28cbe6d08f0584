"""Serves a solver that is itself an MPI program: rank 0 listens, and every rank runs every request.

    mpirun -n 2 python3 heat.py        with      starlings.mpi.serve(Heat)      as its last line

The solver's methods are called on all ranks with the same request, and use a communicator of their own, such as
`MPI.COMM_WORLD`. The outputs and the state of rank 0 count. Between requests the other ranks sleep. A run that nobody waits
for is not stopped half-way, since all ranks would have to stop at the same place: the worker ends the processes instead. When a
rank fails and the others do not within a few seconds, all are ended, since they would wait for it for ever.
"""

from __future__ import annotations

import os
import pickle
import sys
import time
from typing import Any, Callable, List, Optional, Type, Union

from .failures import Cancelled, DeclarationError, Failed
from .job import Answer, Job
from .places import caller
from .one_run import execute
from .serve import address_of, run
from .serve import serve as serve_alone
from .solver import Served, Solver

#: Seconds for which the other ranks may go on after one has failed.
_GRACE = 10.0
#: Longest sleep between two looks at the mailbox, seconds.
_NAP = 5e-4


def serve(solver: Union[Solver, Type[Solver]], argv: Optional[List[str]] = None) -> None:
    """As starlings.serve, on every rank of an MPI program."""
    from mpi4py import MPI

    world = MPI.COMM_WORLD
    address = address_of(os.environ)
    if world.size == 1 or address is None:
        if world.rank == 0:
            serve_alone(solver, argv)
        return
    try:
        served = Served(solver)
    except DeclarationError as error:
        raise SystemExit(f"this solver cannot be served: {error}{caller()}") from None
    # What the ranks tell each other never mixes with what the solver sends.
    ranks = _Ranks(world.Dup(), served)
    if world.rank == 0:
        run(served, address, ranks.lead, lambda: world.Abort(0))
        return
    os.dup2(2, 1)
    ranks.follow()


class _Ranks:
    """The ranks of one solver."""

    def __init__(self, comm: Any, served: Served) -> None:
        self._comm = comm
        self._served = served

    def lead(self, job: Job, stopped: Callable[[], bool], progress: Callable[[float], None]) -> Answer:
        """Runs a job on all ranks, on rank 0."""
        if stopped():
            raise Cancelled
        data = pickle.dumps(job)
        sent = [self._comm.isend(data, dest=rank) for rank in range(1, self._comm.size)]
        for request in sent:
            self._wait(request)
        answer = self._run(job, progress)
        if isinstance(answer, Failed):
            raise answer
        return answer

    def follow(self) -> None:
        """Runs what rank 0 sends, for ever."""
        while True:
            nap = 1e-5
            while not self._comm.Iprobe(source=0):
                time.sleep(nap)
                nap = min(2.0 * nap, _NAP)
            self._run(pickle.loads(self._comm.recv(source=0)), lambda reached: None)

    def _run(self, job: Job, progress: Callable[[float], None]) -> Union[Answer, Failed]:
        """This rank's part, and then all ranks meet. A failure of any rank is one of all."""
        outcome: Union[Answer, Failed]
        try:
            outcome = execute(self._served, job, lambda: False, progress)
        except Failed as error:
            outcome = error
        failed = outcome if isinstance(outcome, Failed) else None
        mine = None if failed is None else (failed.kind, failed.text, failed.time)
        meeting = self._comm.Ibarrier()
        self._wait(meeting, None if failed is None else _GRACE)
        told = next((f for f in self._comm.allgather(mine) if f is not None), None)
        return outcome if told is None else Failed(*told)

    def _wait(self, request: Any, patience: Optional[float] = None) -> None:
        """Waits without spinning; after `patience` seconds all ranks are ended."""
        begin, nap = time.monotonic(), 1e-5
        while not request.Test():
            if patience is not None and time.monotonic() - begin > patience:
                print("a rank failed and the others went on: all are ended", file=sys.stderr, flush=True)
                self._comm.Abort(1)
            time.sleep(nap)
            nap = min(2.0 * nap, _NAP)
