"""Writes force.csv and position.csv: a mass on a spring with viscous damping, driven by a known force.

Truth: k = 40 N/m, c = 0.8 N s/m, x(0) = 0.1 m, v(0) = 0, mass 1 kg. The force is a sum of two sines, sampled every 20 ms and
linear between the samples. The equation is integrated in steps of 0.2 ms, a fiftieth of the solver's. The position is measured
every 20 ms for 6 s with Gaussian noise of 2 mm.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

STIFFNESS, DAMPING, START = 40.0, 0.8, (0.1, 0.0)
SAMPLE, SAMPLES, SUBSTEPS = 0.02, 300, 100
NOISE, SEED = 0.002, 2


def force(index: int) -> float:
    """Drive in N at sample `index`."""
    time = index * SAMPLE
    return 2.0 * math.sin(2.0 * math.pi * 0.7 * time) + math.sin(2.0 * math.pi * 1.3 * time + 0.4)


def advance(x: float, v: float, index: int) -> tuple:
    """One sample later, by the midpoint rule in small steps; the force is linear over the sample."""
    first, rise, step = force(index), force(index + 1) - force(index), SAMPLE / SUBSTEPS
    for sub in range(SUBSTEPS):
        begin, middle = first + rise * sub / SUBSTEPS, first + rise * (sub + 0.5) / SUBSTEPS
        half_x = x + 0.5 * step * v
        half_v = v + 0.5 * step * (-STIFFNESS * x - DAMPING * v + begin)
        x, v = x + step * half_v, v + step * (-STIFFNESS * half_x - DAMPING * half_v + middle)
    return x, v


def write(name: str, header: list, rows: list) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows((f"{time:.2f}", f"{value:.9g}") for time, value in rows)


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    (x, v), seen = START, []
    for index in range(SAMPLES + 1):
        seen.append((index * SAMPLE, x + generator.gauss(0.0, NOISE)))
        x, v = advance(x, v, index)
    write("position.csv", ["time", "position"], seen)
    write("force.csv", ["time", "force"], [(index * SAMPLE, force(index)) for index in range(SAMPLES + 1)])


if __name__ == "__main__":
    main()
