"""Heat in a rod, a part of it per MPI rank: du/dt = kappa d2u/dx2 - loss u, heated at the left end.

u is the temperature above that of the room. Cells of 1 cm, explicit steps of at most 0.25 s; before every step neighbours tell
each other their outermost cells. All ranks get the same request; each keeps its own cells, and what is observed is gathered.
"""

import numpy as np
import starlings
import starlings.mpi
from mpi4py import MPI
from starlings import Quantity

CELLS, WIDTH, STEP = 20, 0.01, 0.25
SENSORS = [2, 7, 12, 17]
COMM = MPI.COMM_WORLD
LEFT = COMM.rank - 1 if COMM.rank > 0 else MPI.PROC_NULL
RIGHT = COMM.rank + 1 if COMM.rank < COMM.size - 1 else MPI.PROC_NULL


class Rod(starlings.Solver):
    """Heat in a rod, in parallel."""

    parameters = [
        Quantity("kappa", "m^2/s", lo=0.0, says="Diffusivity."),
        Quantity("loss", "1/s", lo=0.0, says="Rate at which the rod cools through its side."),
    ]
    states = [Quantity("u", "K", size=CELLS, role="temperature")]
    outputs = [Quantity("sensors", "K", size=len(SENSORS), role="temperature")]
    inputs = [Quantity("heater", "K m/s", says="Flux into the left end over the volumetric heat capacity.")]

    def run(self, window):
        mine = np.array_split(np.arange(CELLS), COMM.size)[COMM.rank]
        u, previous, rows = window.state[mine], window.start, []
        for time in window.times:
            for t, h in window.steps(previous, time, STEP):
                u = advance(u, h, window.p, window.inputs.at(t + 0.5 * h).heater)
            whole = np.concatenate(COMM.allgather(u))
            rows.append(whole[SENSORS])
            previous = time
        return np.array(rows), whole


def advance(u, h, p, heater):
    """This rank's cells one step later."""
    if p.kappa * h / WIDTH**2 > 0.5:
        raise ArithmeticError(f"steps of {h:g} s are unstable for kappa = {p.kappa:g} m^2/s")
    # Without a neighbour the cell beyond the end is as warm as the last one: no flux.
    beyond = np.array([u[0], u[-1]])
    COMM.Sendrecv(u[-1:], dest=RIGHT, recvbuf=beyond[:1], source=LEFT)
    COMM.Sendrecv(u[:1].copy(), dest=LEFT, recvbuf=beyond[1:], source=RIGHT)
    padded = np.concatenate([beyond[:1], u, beyond[1:]])
    change = p.kappa * np.diff(padded, 2) / WIDTH**2 - p.loss * u
    if COMM.rank == 0:
        change[0] += heater / WIDTH
    return u + h * change


if __name__ == "__main__":
    starlings.mpi.serve(Rod)
