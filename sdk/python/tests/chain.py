"""A chain of masses on springs, some of them observed."""

import numpy as np

import starlings
from starlings import Observer, Quantity

N = 6
#: A chain of masses: springs between neighbours and to a wall on the left, the last one free.
STIFFNESS = 40.0 * (2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
STIFFNESS[-1, -1] = 40.0
MASS = np.diag(np.linspace(1.0, 2.0, N))
DOFS = [1, 4]


class Chain(starlings.Solver):
    """Masses on springs by the implicit midpoint rule; two of them are observed."""

    parameters = {"stiffness": ""}
    states = [
        Quantity("d", "m", size=N, role="displacement"),
        Quantity("v", "m/s", size=N, role="velocity"),
    ]
    outputs = [
        Quantity("seen", "m", size=2, role="displacement"),
        Quantity("speed", "m/s", size=2, role="velocity"),
    ]
    dt = 0.02

    def __init__(self):
        self.observers = [
            Observer.sdf(lambda p: p.stiffness * STIFFNESS, observed_dofs=DOFS),
            Observer.dvf(MASS, observed_dofs=DOFS),
        ]

    def initial(self, p):
        return {"d": np.linspace(0.1, 0.6, N), "v": np.zeros(N)}

    def step(self, t, dt, x, p, u):
        d, v = x[:N], x[N:]
        k = p.stiffness * STIFFNESS
        middle = np.linalg.solve(MASS + dt**2 / 4 * k, MASS @ v - dt / 2 * k @ d)
        return np.concatenate([d + dt * middle, 2 * middle - v])

    def output(self, t, x, p, u):
        return {"seen": x[DOFS], "speed": x[N:][DOFS]}


TIMES = np.linspace(0.1, 3.0, 30)


def run(observer="none", gain=0.0, **more):
    chosen = dict(parameters={"stiffness": 1.0}, times=TIMES, observer=observer, gain=gain)
    chosen.update(more)
    return starlings.simulate(Chain, **chosen)


TRUTH = run()
OBSERVED = {"seen": TRUTH.outputs["seen"], "speed": TRUTH.outputs["speed"]}
WRONG = np.concatenate([np.full(N, 0.2), np.zeros(N)])
