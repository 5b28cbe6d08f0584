"""A mass of 1 kg on a spring with viscous damping, driven by a measured force: dv/dt = -k x - c v + F."""

import starlings


@starlings.solver(
    parameters={"k": "N/m", "c": "N s/m"},
    states={"x": "m", "v": "m/s"},
    outputs={"position": "m"},
    inputs={"force": "N"},
    measures={"position": "x"},
    dt=0.01,
)
class Oscillator:
    def rate(self, t, x, p, u):
        return [x[1], -p.k * x[0] - p.c * x[1] + u.force]


if __name__ == "__main__":
    starlings.serve(Oscillator)
