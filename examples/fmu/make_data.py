"""Writes pump.csv and levels.csv: two tanks in a row, filled by a pump whose flow is known.

Truth: k1 = 12, k2 = 9 cm^2.5/s, levels 14 cm and 7 cm at the start, cross-sections of 154 cm^2, Torricelli's law. The pump's
flow is sampled every 10 s and linear between. The equations are integrated by the classical Runge-Kutta method in steps of
0.1 s. Both levels are read every 5 s for 300 s with Gaussian noise of 0.1 cm.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

K1, K2, START, AREA = 12.0, 9.0, (14.0, 7.0), 154.0
SAMPLE, READING, LENGTH, STEP = 10, 5, 300, 0.1
NOISE, SEED = 0.1, 3


def flow(index: int) -> float:
    """The pump in cm^3/s at sample `index`."""
    return 45.0 + 25.0 * math.sin(2.0 * math.pi * index * SAMPLE / 120.0)


def pump(time: float) -> float:
    """Linear between the samples."""
    index = min(int(time / SAMPLE), LENGTH // SAMPLE - 1)
    return flow(index) + (flow(index + 1) - flow(index)) * (time / SAMPLE - index)


def rate(time: float, levels: tuple) -> tuple:
    """Rates of both levels."""
    first, second = K1 * math.sqrt(levels[0]), K2 * math.sqrt(levels[1])
    return (pump(time) - first) / AREA, (first - second) / AREA


def moved(levels: tuple, slope: tuple, step: float) -> tuple:
    """The levels moved along a slope."""
    return levels[0] + step * slope[0], levels[1] + step * slope[1]


def advance(time: float, levels: tuple) -> tuple:
    """One step later."""
    a = rate(time, levels)
    b = rate(time + STEP / 2, moved(levels, a, STEP / 2))
    c = rate(time + STEP / 2, moved(levels, b, STEP / 2))
    d = rate(time + STEP, moved(levels, c, STEP))
    slope = tuple((w + 2 * x + 2 * y + z) / 6 for w, x, y, z in zip(a, b, c, d))
    return moved(levels, slope, STEP)


def write(name: str, header: list, rows: list) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.9g}" for value in row] for row in rows)


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    levels, seen, per_reading = START, [], round(READING / STEP)
    for index in range(LENGTH // READING + 1):
        seen.append((index * READING, *(level + generator.gauss(0.0, NOISE) for level in levels)))
        for sub in range(per_reading):
            levels = advance(index * READING + sub * STEP, levels)
    write("levels.csv", ["time", "level1", "level2"], seen)
    write("pump.csv", ["time", "pump"], [(i * SAMPLE, flow(i)) for i in range(LENGTH // SAMPLE + 1)])


if __name__ == "__main__":
    main()
