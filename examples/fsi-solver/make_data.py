"""Writes flow.csv, profiles.csv, rest.csv and velocities.csv: a pulsating vessel whose wall is imaged every 10 ms.

Truth: E1 to E5 are 5e6 dyn/cm^2 times 2 to the power of 0.5, 1.5, -0.5, 0 and -1. The vessel starts at rest under 80 mmHg one beat
before the recording, so that waves run in it when the recording begins and its pressure is another one. Mesh and steps are
several times finer than the solver's. A profile has a point at each wall element of the solver and one past either end, with
Gaussian noise along the radius of a tenth of the largest pulsatile amplitude; the velocities of the wall's elements have noise of a
tenth of the largest speed. The inflow, a half sine of 300 cm^3/s that lasts
0.3 s in each beat of 0.8 s, has no noise.

The seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
from pathlib import Path

import numpy as np
import starlings

from vessel import LENGTH, RADIUS, Vessel

TRUTH = {f"E{i + 1}": 5.0e6 * 2.0**octave for i, octave in enumerate((0.5, 1.5, -0.5, 0.0, -1.0))} | {"p0": 106657.6}
BEAT, EJECTION, PEAK = 0.8, 0.3, 300.0
BEATS, IMAGE, SAMPLE = 2, 0.01, 0.005
ELEMENTS, FINER = 50, 3
NOISE_SHARE, SEED = 0.1, 1


def inflow(time: np.ndarray) -> np.ndarray:
    """Flow into the vessel, cm^3/s."""
    phase = np.round(time % BEAT, 9) % BEAT
    return np.where(phase < EJECTION, PEAK * np.sin(np.pi * phase / EJECTION), 0.0)


def write(name: str, header: list, rows) -> None:
    """Writes a CSV file beside this script, with more digits than anybody measures."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.6g}" for value in row] for row in rows)


def main() -> None:
    """Simulates, observes, writes."""
    samples = np.arange(round((1 + BEATS) * BEAT / SAMPLE) + 1) * SAMPLE
    images = np.arange(round(BEATS * BEAT / IMAGE) + 1) * IMAGE
    truth = Vessel(along=FINER * ELEMENTS, across=10, dt=0.001)
    run = starlings.simulate(
        truth, parameters=TRUTH, times=BEAT + images, inputs={"flow": (samples, inflow(samples))}
    )
    wall, speed = (run.outputs[name][:, FINER // 2 :: FINER] for name in ("displacement", "velocity"))
    noise = NOISE_SHARE * np.ptp(wall, axis=0).max()
    shown = np.column_stack([wall[:, 0], wall, wall[:, -1]])
    errors = np.random.RandomState(SEED)
    radii = RADIUS + shown + noise * errors.standard_normal(shown.shape)
    speed_noise = NOISE_SHARE * np.abs(speed).max()
    speed = speed + speed_noise * errors.standard_normal(speed.shape)
    element = LENGTH / ELEMENTS
    places = element * (np.arange(ELEMENTS + 2) - 0.5)
    write("flow.csv", ["time", "flow"], np.column_stack([samples, inflow(samples)])[: round(BEATS * BEAT / SAMPLE) + 1])
    rows = ((time, z, r) for time, profile in zip(images, radii) for z, r in zip(places, profile))
    write("profiles.csv", ["time", "z", "r"], rows)
    write("rest.csv", ["z", "r"], ((z, RADIUS) for z in places[1:-1]))
    write("velocities.csv", ["time", *(f"velocity[{i}]" for i in range(ELEMENTS))], np.column_stack([images, speed]))
    print(f"noise: {noise:.7f} cm and {speed_noise:.6f} cm/s, pressure at the start: {run.outputs['pressure'][0].item():.0f} dyn/cm^2")


if __name__ == "__main__":
    main()
