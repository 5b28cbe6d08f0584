"""Writes flow.csv and vessel.csv: two beats of a heart into a vessel that ends in a Windkessel.

Truth: L = 10 cm, R = 1 cm, h = 0.15 cm, E = 4e6 dyn/cm^2, nu = 0.5, rho_s = 1.1 g/cm^3, rho_f = 1.06 g/cm^3, k_T = 5/6;
R_p = 150 and R_d = 2200 dyn s/cm^5, C = 8e-4 cm^5/dyn; everything at rest at 70 mmHg, with the wall inflated. The inflow
is 300 sin(pi t/0.3 s) cm^3/s for the first 0.3 s of every 0.8 s, sampled every 10 ms and linear between.

Twenty quarter-wave modes by the classical Runge-Kutta method with 100 steps per sample. Readings every 10 ms at
x = (j - 1/2) L/20 with Gaussian noise: displacement 0.002 cm, velocity 0.1 cm/s, outlet pressure 2 mmHg.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

LENGTH, RADIUS, THICKNESS, YOUNG, POISSON = 10.0, 1.0, 0.15, 4e6, 0.5
SOLID, FLUID, SHEAR_CORRECTION = 1.1, 1.06, 5.0 / 6.0
PROXIMAL, DISTAL, COMPLIANCE = 150.0, 2200.0, 8e-4
MMHG = 1333.22
START = 70.0 * MMHG
N, STEP, SAMPLES, SUBSTEPS = 20, 0.01, 161, 100
NOISE = {"displacement": 0.002, "velocity": 0.1, "pressure": 2.0 * MMHG}
SEED = 1

DEPTH = 2.0 * math.pi * RADIUS
KAPPA = [(i + 0.5) * math.pi / LENGTH for i in range(N)]
RING = YOUNG * THICKNESS / ((1.0 - POISSON**2) * RADIUS**2)
SHEAR = SHEAR_CORRECTION * YOUNG / (2.0 * (1.0 + POISSON)) * THICKNESS
MASS = [DEPTH * (SOLID * THICKNESS + FLUID / (k * math.tanh(k * RADIUS))) for k in KAPPA]
STIFFNESS = [DEPTH * (RING + SHEAR * k * k) for k in KAPPA]
SCALE = math.sqrt(2.0 / LENGTH)
VOLUME = [DEPTH * SCALE * math.sin(k * LENGTH) / k for k in KAPPA]
ENTRY = [FLUID / RADIUS * SCALE / k**2 for k in KAPPA]


def inflow(sample: int) -> float:
    """Flow in cm^3/s at a sample."""
    time = (sample * STEP) % 0.8
    return max(300.0 * math.sin(math.pi * time / 0.3), 0.0) if time < 0.3 - 1e-9 else 0.0


def outlet(state: list[float], flow: float) -> tuple[float, float]:
    """Flow into the Windkessel and pressure before it."""
    leaving = flow - sum(s * w for s, w in zip(VOLUME, state[N:]))
    return leaving, state[-1] + PROXIMAL * leaving


def rate(state: list[float], flow: float, slope: float) -> list[float]:
    """Rates of amplitudes, their speeds and the stored pressure."""
    leaving, pressure = outlet(state, flow)
    speeds = [
        (s * pressure + f * slope - k * a) / m
        for s, f, k, a, m in zip(VOLUME, ENTRY, STIFFNESS, state, MASS)
    ]
    return [*state[N : 2 * N], *speeds, (leaving - state[-1] / DISTAL) / COMPLIANCE]


def advance(state: list[float], sample: int) -> list[float]:
    """One sample later."""
    h = STEP / SUBSTEPS
    slope = (inflow(sample + 1) - inflow(sample)) / STEP

    def moved(direction: list[float], step: float) -> list[float]:
        return [x + step * r for x, r in zip(state, direction)]

    for i in range(SUBSTEPS):
        flow = inflow(sample) + slope * h * i
        k1 = rate(state, flow, slope)
        k2 = rate(moved(k1, h / 2), flow + slope * h / 2, slope)
        k3 = rate(moved(k2, h / 2), flow + slope * h / 2, slope)
        k4 = rate(moved(k3, h), flow + slope * h, slope)
        state = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4)]
    return state


def at_nodes(amplitudes: list[float]) -> list[float]:
    """Values at the nodes."""
    places = [(j + 0.5) * LENGTH / N for j in range(N)]
    return [SCALE * sum(a * math.cos(k * x) for a, k in zip(amplitudes, KAPPA)) for x in places]


def write(name: str, header: list[str], rows: list[list[str]]) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows(rows)


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    state = [s * START / k for s, k in zip(VOLUME, STIFFNESS)] + [0.0] * N + [START]
    readings = []
    for sample in range(SAMPLES):
        noisy = {
            "displacement": at_nodes(state[:N]),
            "velocity": at_nodes(state[N : 2 * N]),
            "pressure": [outlet(state, inflow(sample))[1]],
        }
        for field, digits in (("displacement", 4), ("velocity", 3), ("pressure", 0)):
            noisy[field] = [f"{v + generator.gauss(0.0, NOISE[field]):.{digits}f}" for v in noisy[field]]
        readings.append([f"{sample * STEP:.2f}", *noisy["displacement"], *noisy["velocity"], *noisy["pressure"]])
        state = advance(state, sample)
    names = [f"{field}[{j}]" for field in ("displacement", "velocity") for j in range(N)]
    write("vessel.csv", ["time", *names, "pressure"], readings)
    write("flow.csv", ["time", "flow"], [[f"{i * STEP:.2f}", repr(inflow(i))] for i in range(SAMPLES)])


if __name__ == "__main__":
    main()
