"""Writes inflow.csv and measured.csv: an aorta with a coarctation whose 14 parameters are known.

Ascending aorta (wall compliance C_wall) with three RCR branches; an inertance and a loss Kv q + Kq |q| q lead to the
descending aorta with a fourth RCR. The equations are written out here by hand and advanced by the classic Runge-Kutta
method in steps of half a millisecond; they share nothing with the model of the study. Before the record the beats
repeat until they are periodic.

Measured every 20 ms over eight beats: ascending-aorta pressure (noise 2 mmHg) and the four outlet flows (noise 2, 1, 1.5
and 4 mL/s). The inflow is stamped by a clock that runs 30 ms late, so the true shift is -0.03 s. The column `drop`,
p_asc - p_desc, is the truth without noise.

Standard library only; the same seed always writes the same files:

    python3 make_data.py [SEED [FOLDER]]
"""

import csv
import math
import random
import sys
from pathlib import Path

BEAT, EJECTION, PEAK = 0.8, 0.3, 349.0  # s, s, mL/s: about 5 L/min
OUTLETS = {  # Rp, C, Rd in mmHg s/mL and mL/mmHg; noise of the flow in mL/s
    "bca": (0.35, 0.25, 5.0, 2.0),
    "lcca": (0.90, 0.09, 12.0, 1.0),
    "lsa": (0.60, 0.14, 8.5, 1.5),
    "dao": (0.12, 0.80, 1.55, 4.0),
}
C_WALL, INERTANCE, KV, KQ = 0.35, 0.004, 0.02, 1.0e-3
SHIFT = -0.03
PRESSURE_NOISE = 2.0
STEP, SAMPLE, INFLOW_SAMPLE, BEATS, RUN_IN = 0.0005, 0.02, 0.01, 8, 20
NAMES = list(OUTLETS)
BRANCHES = [OUTLETS[name][:3] for name in NAMES]


def inflow(time: float) -> float:
    """Flow into the ascending aorta in mL/s."""
    phase = time % BEAT
    return PEAK * math.sin(math.pi * phase / EJECTION) if phase < EJECTION else 0.0


def flows(state: list[float]) -> list[float]:
    """Outlet flows of a state (p_asc, four chamber pressures, flow through the isthmus)."""
    upper = [(state[0] - state[1 + i]) / BRANCHES[i][0] for i in range(3)]
    return [*upper, state[5]]


def rate(time: float, state: list[float]) -> list[float]:
    """Time derivative of the state."""
    out = flows(state)
    wall = (inflow(time) - sum(out)) / C_WALL
    chambers = [(q - state[1 + i] / rd) / c for i, (q, (_, c, rd)) in enumerate(zip(out, BRANCHES))]
    descending = state[4] + BRANCHES[3][0] * state[5]
    loss = KV * state[5] + KQ * abs(state[5]) * state[5]
    return [wall, *chambers, (state[0] - loss - descending) / INERTANCE]


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
    state, rows = [80.0] * 5 + [0.0], []
    for step in range(-run_in, steps + 1):
        time = step * STEP
        if step >= 0 and step % every == 0:
            out = flows(state)
            drop = state[0] - (state[4] + BRANCHES[3][0] * state[5])
            noisy = [q + noise.gauss(0.0, OUTLETS[name][3]) for name, q in zip(NAMES, out)]
            rows.append([time, state[0] + noise.gauss(0.0, PRESSURE_NOISE), *noisy, drop])
        state = advance(time + run_in * STEP, state)
    write(folder / "measured.csv", ["time", "p_asc", *(f"q_{name}" for name in NAMES), "drop"], rows)
    stamps = [k * INFLOW_SAMPLE for k in range(-50, round((BEATS * BEAT + 0.5) / INFLOW_SAMPLE) + 1)]
    write(folder / "inflow.csv", ["time", "inflow"], [[t, inflow(t + SHIFT + 10 * BEAT)] for t in stamps])


if __name__ == "__main__":
    main()
