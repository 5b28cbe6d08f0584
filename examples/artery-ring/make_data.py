"""Writes pressure.csv and markers.csv: a pulsating ring of an artery, of which markers on the inner wall are followed.

Truth: E_1 = 4e6, E_2 = 1e7, E_3 = 6e6 dyn/cm^2. The pressure rises 53 000 dyn/cm^2 (40 mmHg) above its lowest for 0.3 s of a
beat of 0.8 s. The simulation starts at rest one beat before the recording, which begins at the height of a beat, so that the
gel has crept and the ring moves. Its mesh is twice as fine and its steps a quarter of the solver's. The markers are read every
10 ms with Gaussian noise of 3 % of their largest amplitude; the pressure has no noise.

The seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
from pathlib import Path

import numpy as np
import starlings

from ring import Ring

TRUTH = {"E_1": 4.0e6, "E_2": 1.0e7, "E_3": 6.0e6}
BEAT, EJECTION, RISE = 0.8, 0.3, 53_000.0
START, LENGTH, READING, SAMPLE = 0.92, 1.6, 0.01, 0.005
NOISE_SHARE = 0.03
SEED = 1


def pressure(time: np.ndarray) -> np.ndarray:
    """Pressure above the lowest, dyn/cm^2."""
    phase = time % BEAT
    return RISE * np.where(phase < EJECTION, np.sin(np.pi * phase / EJECTION) ** 2, 0.0)


class AtRest(Ring):
    """The truth starts undeformed."""

    def initial(self, p):
        return None


def write(name: str, header: list, table: np.ndarray) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        # Ten digits are more than two machines agree on after a thousand steps, and less than anybody measures.
        out.writerows([f"{value:.10g}" for value in row] for row in table)


def main() -> None:
    """Simulates, observes, writes."""
    samples = np.arange(round((START + LENGTH) / SAMPLE) + 1) * SAMPLE
    readings = np.arange(round(LENGTH / READING) + 1) * READING
    truth = AtRest(around=48, through=2, dt=0.00125)
    run = starlings.simulate(
        truth, parameters=TRUTH, times=START + readings, inputs={"pressure": (samples, pressure(samples))}
    )
    wall = run.outputs["wall"]
    noise = NOISE_SHARE * np.ptp(wall, axis=0).max()
    seen = wall + noise * np.random.RandomState(SEED).standard_normal(wall.shape)
    kept = samples[samples >= START - 1e-9]
    write("pressure.csv", ["time", "pressure"], np.column_stack([kept - START, pressure(kept)]))
    write(
        "markers.csv",
        ["time", *(f"wall[{i}]" for i in range(wall.shape[1]))],
        np.column_stack([readings, seen]),
    )
    print(f"noise: {noise:.6f} cm")


if __name__ == "__main__":
    main()
