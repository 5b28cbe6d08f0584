"""Writes heater.csv and sensors.csv: a rod that is heated at one end for a while.

Truth: kappa = 9e-5 m^2/s, loss = 0.004 1/s, at room temperature at first. The heater is a half sine of 60 s. The equation is
solved on cells of a fifth of the solver's width, in steps of 0.02 s; a sensor shows the mean over one centimetre. Four sensors
are read every 5 s for 150 s with Gaussian noise of 0.05 K.

Needs numpy; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
from pathlib import Path

import numpy as np

KAPPA, LOSS = 9.0e-5, 0.004
FINE, CELLS, WIDTH, STEP = 5, 20, 0.01, 0.02
SENSORS = [2, 7, 12, 17]
SAMPLE, READING, LENGTH = 2.5, 5.0, 150.0
NOISE, SEED = 0.05, 4


def heater(times: np.ndarray) -> np.ndarray:
    """Flux over heat capacity at the samples, K m/s."""
    return np.where(times < 60.0, 0.02 * np.sin(np.pi * times / 60.0), 0.0)


def write(name: str, header: list, rows: list) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.9g}" for value in row] for row in rows)


def main() -> None:
    """Simulates, observes, writes."""
    samples = np.arange(round(LENGTH / SAMPLE) + 1) * SAMPLE
    drive = heater(samples)
    random = np.random.RandomState(SEED)
    u, width, seen = np.zeros(FINE * CELLS), WIDTH / FINE, []
    per_reading = round(READING / STEP)
    for reading in range(round(LENGTH / READING) + 1):
        shown = u.reshape(CELLS, FINE).mean(axis=1)[SENSORS]
        seen.append([reading * READING, *(shown + NOISE * random.standard_normal(len(SENSORS)))])
        for sub in range(per_reading):
            time = reading * READING + (sub + 0.5) * STEP
            padded = np.concatenate([u[:1], u, u[-1:]])
            change = KAPPA * np.diff(padded, 2) / width**2 - LOSS * u
            change[0] += np.interp(time, samples, drive) / width
            u = u + STEP * change
    write("sensors.csv", ["time", *(f"sensors[{i}]" for i in range(len(SENSORS)))], seen)
    write("heater.csv", ["time", "heater"], list(zip(samples, drive)))


if __name__ == "__main__":
    main()
