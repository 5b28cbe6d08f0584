"""`serve`: what the last line of a solver's file calls.

Next file to read: service.py.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from typing import Callable, List, Mapping, Optional, Type, Union

from .describe import help_text, table
from .failures import DeclarationError
from .places import caller
from .service import Runner, Server
from .solver import Served, Solver

#: Environment: path of the Unix socket, or host:port; and whether to end when standard input closes.
SOCKET, ADDRESS, LIFELINE = "STARLINGS_SOLVER_SOCKET", "STARLINGS_SOLVER_ADDRESS", "STARLINGS_LIFELINE"

#: Longest path of a Unix socket on Linux; other systems allow less.
_LONGEST_PATH = 107


def serve(solver: Union[Solver, Type[Solver]], argv: Optional[List[str]] = None) -> None:
    """Serves the solver where the environment says, until the process is ended.

    `STARLINGS_SOLVER_SOCKET` is the path of a Unix socket, `STARLINGS_SOLVER_ADDRESS` a `host:port` (port 0: any that is
    free). When ready, the one line `starlings-solver ready ADDRESS` is printed on standard output; whatever the solver prints
    goes to standard error. With `STARLINGS_LIFELINE` the process ends when standard input closes. With neither address the
    solver was started by hand: `--describe` prints what it declares, and anything else says how to use it.
    """
    try:
        served = Served(solver)
    except DeclarationError as error:
        raise SystemExit(f"this solver cannot be served: {error}{caller()}") from None
    arguments = sys.argv[1:] if argv is None else argv
    if "--describe" in arguments:
        print(table(served))
        return
    address = address_of(os.environ)
    if address is None:
        print(help_text(served, sys.argv[0]), file=sys.stderr)
        raise SystemExit(2)
    run(served, address)


def run(
    served: Served,
    address: str,
    runner: Optional[Runner] = None,
    end: Callable[[], None] = lambda: os._exit(0),
) -> None:
    """Serves at an address with the computing in this thread. `end` is what happens when the lifeline closes."""
    say = _own_output()
    _keep_memory()
    server = Server(served, runner)
    try:
        reached = server.listen(address)
    except OSError as error:
        raise SystemExit(f"this solver cannot be served: {error}") from None
    if os.environ.get(LIFELINE):
        threading.Thread(target=_wait_for_end, args=(_own_input(), end), daemon=True).start()
    say(f"starlings-solver ready {reached}\n")
    try:
        server.work()
    except KeyboardInterrupt:
        os._exit(130)


def address_of(environment: Mapping[str, str]) -> Optional[str]:
    """Where to listen; None where the environment does not say."""
    path = environment.get(SOCKET)
    if path:
        if len(os.fsencode(path)) > _LONGEST_PATH:
            raise SystemExit(
                f"{SOCKET} has more than {_LONGEST_PATH} bytes, which no Unix socket can have: {path}"
            )
        return f"unix:{path}"
    address = environment.get(ADDRESS)
    if not address:
        return None
    host, colon, port = address.rpartition(":")
    if not (host and colon and port.isdecimal() and int(port) < 65536):
        raise SystemExit(f"{ADDRESS} is {address!r}, expected host:port such as 127.0.0.1:0")
    return address


def _own_output() -> Callable[[str], None]:
    """Keeps standard output for the one line; what anything prints there, C and Fortran included, goes to standard error."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)

    def say(line: str) -> None:
        os.write(kept, line.encode())

    return say


def _own_input() -> int:
    """Keeps the lifeline for what waits for its end: a solver, and programs that it starts, find an empty standard input."""
    kept = os.dup(0)
    empty = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty, 0)
    os.close(empty)
    return kept


def _keep_memory() -> None:
    """Tells the allocator of glibc to keep memory that is freed: a large state would otherwise be mapped anew in every run."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError, TypeError):
        return
    trim_threshold, mmap_threshold, arenas = -1, -3, -8
    mallopt(mmap_threshold, 32 << 20)
    mallopt(trim_threshold, 256 << 20)
    mallopt(arenas, 1)


def _wait_for_end(lifeline: int, end: Callable[[], None]) -> None:
    try:
        while os.read(lifeline, 65536):
            pass
    finally:
        end()
