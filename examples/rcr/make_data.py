"""Writes flow.csv and pressure.csv: ten beats of a three-element Windkessel (RCR) with known parameters.

Truth, in cgs units: Zc = 150 and R = 1850 dyn s/cm^5, C = 1e-3 cm^5/dyn. The flow is a half sine of 300 cm^3/s that
lasts 0.3 s in each beat of 0.8 s. The distal pressure starts on its periodic orbit and is advanced by the exact
solution for the mean flow of each millisecond. The measured pressure is the inlet pressure every 10 ms plus Gaussian
noise of 2 mmHg.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

MMHG = 1333.22  # dyn/cm^2
ZC, R, C = 150.0, 1850.0, 1e-3
BEAT, EJECTION, PEAK = 0.8, 0.3, 300.0
STEPS_PER_BEAT, BEATS, STEPS_PER_SAMPLE = 800, 10, 10
STEP = BEAT / STEPS_PER_BEAT
NOISE = 2.0 * MMHG
SEED = 1


def flow_at(step: int) -> float:
    """Inflow in cm^3/s; the phase is counted in whole steps, so every beat is the same to the last bit."""
    phase = (step % STEPS_PER_BEAT) * BEAT / STEPS_PER_BEAT
    return PEAK * math.sin(math.pi * phase / EJECTION) if phase < EJECTION else 0.0


def advance(distal: float, step: int) -> float:
    """Distal pressure one step later: C dp/dt = Q - p/R with the step's mean flow."""
    decay = math.exp(-STEP / (R * C))
    return decay * distal + (1.0 - decay) * R * 0.5 * (flow_at(step) + flow_at(step + 1))


def periodic_start() -> float:
    """Distal pressure that returns to itself after one beat."""
    gained = 0.0
    for step in range(STEPS_PER_BEAT):
        gained = advance(gained, step)
    return gained / (1.0 - math.exp(-BEAT / (R * C)))


def write(name: str, header: list[str], rows: list[tuple[float, float]]) -> None:
    """Writes a CSV file beside this script, numbers in full precision."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows((repr(time), repr(value)) for time, value in rows)


def main() -> None:
    """Simulates, observes, writes."""
    noise = random.Random(SEED)
    steps = BEATS * STEPS_PER_BEAT
    flow, pressure = [], []
    distal = periodic_start()
    for step in range(steps + 1):
        time = step / 1000
        flow.append((time, flow_at(step)))
        if step % STEPS_PER_SAMPLE == 0:
            pressure.append((time, distal + ZC * flow_at(step) + noise.gauss(0.0, NOISE)))
        distal = advance(distal, step)
    write("flow.csv", ["time", "flow"], flow)
    write("pressure.csv", ["time", "pressure"], pressure)


if __name__ == "__main__":
    main()
