"""Writes heart.csv and measured.csv: a ventricle that ejects through a valve into an aorta with two outlets, all known.

The ventricle's pressure is given. The valve lets flow pass one way; behind it are the aorta's compliance and two RCR
outlets. The equations are written out here by hand and advanced by the classic Runge-Kutta method in steps of 0.1 ms;
before the record the beats repeat until they are periodic. Measured every 10 ms over six beats: aortic pressure (noise
2 mmHg), flow through the valve (5 mL/s) and flow into the lower body (3 mL/s).

Standard library only; the same seed always writes the same files:

    python3 make_data.py [SEED [FOLDER]]
"""

import csv
import math
import random
import sys
from pathlib import Path

BEAT, SYSTOLE, REST, PEAK = 0.8, 0.36, 8.0, 125.0  # s, s, mmHg, mmHg
OPEN, CLOSED, C_WALL = 0.06, 1.0e4, 0.45
UPPER, LOWER = (0.20, 0.35, 2.8), (0.09, 0.80, 1.5)  # Rp, C, Rd
NOISE = (2.0, 5.0, 3.0)
STEP, SAMPLE, BEATS, RUN_IN = 0.0001, 0.01, 6, 20


def ventricle(time: float) -> float:
    """Pressure in the ventricle in mmHg."""
    phase = time % BEAT
    return REST + (PEAK - REST) * math.sin(math.pi * phase / SYSTOLE) ** 2 if phase < SYSTOLE else REST


def flows(time: float, state: list[float]) -> list[float]:
    """Flow through the valve and into both outlets for a state (aorta, upper and lower chamber)."""
    drop = ventricle(time) - state[0]
    outlets = [(state[0] - state[1 + i]) / values[0] for i, values in enumerate((UPPER, LOWER))]
    return [drop / (OPEN if drop > 0.0 else CLOSED), *outlets]


def rate(time: float, state: list[float]) -> list[float]:
    """Time derivative of the state."""
    valve, upper, lower = flows(time, state)
    return [
        (valve - upper - lower) / C_WALL,
        (upper - state[1] / UPPER[2]) / UPPER[1],
        (lower - state[2] / LOWER[2]) / LOWER[1],
    ]


def advance(time: float, state: list[float]) -> list[float]:
    """One Runge-Kutta step."""
    go = lambda k, h: [x + h * v for x, v in zip(state, k)]
    a = rate(time, state)
    b = rate(time + STEP / 2, go(a, STEP / 2))
    c = rate(time + STEP / 2, go(b, STEP / 2))
    d = rate(time + STEP, go(c, STEP))
    return [x + STEP / 6 * (p + 2 * q + 2 * r + s) for x, p, q, r, s in zip(state, a, b, c, d)]


def write(path: Path, header: list[str], rows: list[list[float]]) -> None:
    """Writes a CSV file; four decimals are far below the noise."""
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.4f}" for value in row] for row in rows)


def main() -> None:
    """Simulates, observes, writes."""
    noise = random.Random(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).parent
    # Counted in whole steps, so that no time drifts.
    run_in, steps, every = (round(t / STEP) for t in (RUN_IN * BEAT, BEATS * BEAT, SAMPLE))
    state, rows = [80.0] * 3, []
    for step in range(-run_in, steps + 1):
        clock = (step + run_in) * STEP
        if step >= 0 and step % every == 0:
            valve, _, lower = flows(clock, state)
            seen = (state[0], valve, lower)
            rows.append([step * STEP, *(value + noise.gauss(0.0, sd) for value, sd in zip(seen, NOISE))])
        state = advance(clock, state)
    write(folder / "measured.csv", ["time", "p_aorta", "q_valve", "q_lower"], rows)
    stamps = [k * 0.005 for k in range(round(BEATS * BEAT / 0.005) + 1)]
    write(folder / "heart.csv", ["time", "heart"], [[t, ventricle(t + 10 * BEAT)] for t in stamps])


if __name__ == "__main__":
    main()
