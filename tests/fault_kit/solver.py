"""The solver of solver.c with the Python package, alone or on two MPI ranks: a decay, and a fault at a run told in advance."""

import fcntl
import math
import os
import shutil
import signal
import sys
import time

import starlings
from starlings import Quantity

FOLDER = os.environ["FAULT_DIR"]
SOCKET = os.environ.get("STARLINGS_SOLVER_SOCKET", "")
COMM = None
if os.environ.get("FAULT_MPI"):
    import starlings.mpi
    from mpi4py import MPI

    COMM = MPI.COMM_WORLD


def count():
    """The number of this run among those of all programs."""
    with open(os.open(os.path.join(FOLDER, "count"), os.O_RDWR | os.O_CREAT, 0o600), "r+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        n = int(file.read() or 0) + 1
        file.seek(0)
        file.write(f"{n}\n")
        file.flush()
    return n


def state(pid):
    """The state of a process, as the system names it."""
    with open(f"/proc/{pid}/stat") as file:
        return file.read().rsplit(") ", 1)[1][0]


def pause():
    """Stops this process; a child lets it go on."""
    own = os.getpid()
    if os.fork() == 0:
        while state(own) != "T":
            pass
        os.kill(own, signal.SIGCONT)
        os._exit(0)
    os.kill(own, signal.SIGSTOP)


def change_program(text):
    """Puts another text in the place of this file, or none, and ends this process."""
    if text is None:
        os.unlink(__file__)
    else:
        with open(__file__ + ".new", "w") as file:
            file.write(text)
        os.rename(__file__ + ".new", __file__)
    os.kill(os.getpid(), signal.SIGKILL)


def meet(kind):
    """The fault."""
    if kind == "scratch":
        shutil.rmtree(os.path.dirname(os.path.dirname(SOCKET)), ignore_errors=True)
        os.kill(os.getpid(), signal.SIGKILL)
    elif kind == "socket":
        os.unlink(SOCKET)
        os.kill(os.getpid(), signal.SIGKILL)
    elif kind == "full":
        with open("/dev/full", "w") as file:
            file.write("1")
    elif kind == "licence":
        raise RuntimeError("licence server refused: no free seat")
    elif kind == "replaced":
        change_program("raise SystemExit('this is another program: cannot read its mesh')\n")
    elif kind == "removed":
        change_program(None)
    elif kind == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    elif kind == "stopped":
        os.kill(os.getpid(), signal.SIGSTOP)
    elif kind == "paused":
        pause()
    elif kind == "worker-killed":
        os.kill(os.getppid(), signal.SIGKILL)
    elif kind == "worker-stopped":
        os.kill(os.getppid(), signal.SIGSTOP)


def linger(p):
    """Takes so much longer, as solver.c does."""
    pause = os.environ.get("FAULT_PAUSE")
    if pause:
        path = os.path.join(FOLDER, f"running.{os.getpid()}")
        with open(path, "w") as file:
            file.write(f"{p.k!r} {p.a!r}\n")
        time.sleep(1e-3 * float(pause))
        os.unlink(path)


class Decay(starlings.Solver):
    """y = a exp(-k t)."""

    parameters = [Quantity("k", "1/s", lo=0.0), Quantity("a", "V")]
    outputs = [Quantity("y", "V")]

    def run(self, window):
        rank = COMM.rank if COMM else 0
        n = count() if rank == 0 else 0
        if COMM:
            n = COMM.bcast(n)
        try:
            with open(os.path.join(FOLDER, "plan")) as file:
                kind, first, last = file.read().split()
        except FileNotFoundError:
            kind, first, last = "none", 0, 0
        # Every other rank is met by every other moment.
        if int(first) <= n <= int(last) and rank == (n % COMM.size if COMM else 0):
            meet(kind)
        p = window.p
        linger(p)
        return [p.a * math.exp(-p.k * t) for t in window.times]


if __name__ == "__main__":
    sys.stdout.flush()
    (starlings.mpi if COMM else starlings).serve(Decay)
