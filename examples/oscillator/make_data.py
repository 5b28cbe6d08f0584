"""Writes force.csv and position.csv: a mass on a spring with viscous damping, driven by a known force.

Truth: m = 1 kg, k = 40 N/m, c = 0.8 N s/m, x(0) = 0.1 m, v(0) = 0. The force is a sum of two sines, sampled every
10 ms and linear between the samples. The equation is integrated by the classical Runge-Kutta method with 50 steps per
sample. The position is measured every 20 ms with Gaussian noise of 3 % of its root mean square.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

MASS, STIFFNESS, DAMPING = 1.0, 40.0, 0.8
START = (0.1, 0.0)
SAMPLE, SAMPLES, SUBSTEPS, SAMPLES_PER_READING = 0.01, 1200, 50, 2
NOISE_SHARE = 0.03
SEED = 1


def force_sample(index: int) -> float:
    """Drive in N at sample `index`."""
    time = index * SAMPLE
    return 2.0 * math.sin(2.0 * math.pi * 0.7 * time) + 1.0 * math.sin(2.0 * math.pi * 1.3 * time + 0.4)


def rate(state: tuple[float, float], force: float) -> tuple[float, float]:
    """Newton's law: m dv/dt = -k x - c v + F."""
    x, v = state
    return v, (-STIFFNESS * x - DAMPING * v + force) / MASS


def shifted(state: tuple[float, float], slope: tuple[float, float], step: float) -> tuple[float, float]:
    """The state moved along a slope."""
    return state[0] + step * slope[0], state[1] + step * slope[1]


def advance(state: tuple[float, float], index: int) -> tuple[float, float]:
    """One sample later, in classical Runge-Kutta steps; the force is linear over the sample."""
    first, last = force_sample(index), force_sample(index + 1)
    step = SAMPLE / SUBSTEPS
    for sub in range(SUBSTEPS):
        begin = first + (last - first) * sub / SUBSTEPS
        end = first + (last - first) * (sub + 1) / SUBSTEPS
        middle = 0.5 * (begin + end)
        k1 = rate(state, begin)
        k2 = rate(shifted(state, k1, step / 2), middle)
        k3 = rate(shifted(state, k2, step / 2), middle)
        k4 = rate(shifted(state, k3, step), end)
        slope = tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4))
        state = shifted(state, slope, step)
    return state


def write(name: str, header: list[str], rows: list[tuple[float, float]]) -> None:
    """Writes a CSV file beside this script, numbers in full precision."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows((repr(time), repr(value)) for time, value in rows)


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    state, path = START, []
    for index in range(SAMPLES + 1):
        path.append(state[0])
        state = advance(state, index)
    noise = NOISE_SHARE * math.sqrt(sum(x * x for x in path) / len(path))
    readings = range(0, SAMPLES + 1, SAMPLES_PER_READING)
    write("force.csv", ["time", "force"], [(i / 100, force_sample(i)) for i in range(SAMPLES + 1)])
    write("position.csv", ["time", "position"], [(i / 100, path[i] + generator.gauss(0.0, noise)) for i in readings])
    print(f"noise: {noise:.6f} m")


if __name__ == "__main__":
    main()
