"""Writes telemetry.csv and scenarios.csv: a gimballed nozzle that is struck while its actuator holds it.

Truth: J = 4000 kg m^2, B = 4e4 N m s, K = 4e6 N m, arm 1.2 m; the actuator follows F = -(6e5 phi + 1e4 phi')/1.2 with a lag of
20 ms; the torque is 1.25 times the first scenario. Equations are integrated by the classical Runge-Kutta method in 20 steps per
sample of 2 ms, the torque linear between samples. Angle and force are recorded with Gaussian noise of 1 % of their peaks.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

J, B, K, ARM = 4000.0, 4e4, 4e6, 1.2
KP, KD, LAG = 6e5, 1e4, 0.02
STEP, SAMPLES, SUBSTEPS = 0.002, 751, 20
SEVERITY, NOISE, SEED = 1.25, 0.01, 1


def blow(start: float, peak: float, rise: float, frequency: float, decay: float) -> list[float]:
    """A blow that rings with a mode of the structure, N m."""
    torque = []
    for index in range(SAMPLES):
        s = index * STEP - start
        shape = math.exp(-s / decay) - math.exp(-s / rise) if s > 0 else 0.0
        torque.append(peak * shape * math.cos(2 * math.pi * frequency * s))
    return torque


SCENARIOS = {
    "blow": blow(0.1, 3e4, 0.004, 8.0, 0.1),
    "ring": blow(0.1, 6e4, 0.004, 14.0, 0.06),
    "push": blow(0.1, 2e4, 0.004, 0.0, 0.25),
}


def rate(state: list[float], torque: float) -> list[float]:
    """Angle, its rate, the actuator's force."""
    phi, speed, force = state
    command = -(KP * phi + KD * speed) / ARM
    return [speed, (ARM * force + torque - B * speed - K * phi) / J, (command - force) / LAG]


def moved(state: list[float], slope: list[float], step: float) -> list[float]:
    """The state moved along a slope."""
    return [x + step * dx for x, dx in zip(state, slope)]


def advance(state: list[float], first: float, last: float) -> list[float]:
    """One sample later."""
    h = STEP / SUBSTEPS
    for sub in range(SUBSTEPS):
        begin = first + (last - first) * sub / SUBSTEPS
        end = first + (last - first) * (sub + 1) / SUBSTEPS
        k1 = rate(state, begin)
        k2 = rate(moved(state, k1, h / 2), 0.5 * (begin + end))
        k3 = rate(moved(state, k2, h / 2), 0.5 * (begin + end))
        k4 = rate(moved(state, k3, h), end)
        state = moved(state, [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4)], h)
    return state


def write(name: str, header: list[str], rows: list[list[float]]) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{row[0]:.3f}", *(f"{value + 0.0:.6g}" for value in row[1:])] for row in rows)


def main() -> None:
    """Simulates, observes, writes."""
    torque = [SEVERITY * value for value in SCENARIOS["blow"]]
    path = [[0.0, 0.0, 0.0]]
    for first, last in zip(torque, torque[1:]):
        path.append(advance(path[-1], first, last))
    noise = [NOISE * max(abs(state[i]) for state in path) for i in (0, 2)]
    generator = random.Random(SEED)
    rows = [
        [i * STEP, state[0] + generator.gauss(0.0, noise[0]), state[2] + generator.gauss(0.0, noise[1])]
        for i, state in enumerate(path)
    ]
    write("telemetry.csv", ["time", "angle", "force"], rows)
    courses = zip(*SCENARIOS.values())
    write("scenarios.csv", ["time", *SCENARIOS], [[i * STEP, *values] for i, values in enumerate(courses)])
    print(f"noise: {noise[0]:.4g} rad, {noise[1]:.4g} N")


if __name__ == "__main__":
    main()
