"""Writes flow.csv, rest.csv, profiles.csv and points.csv: two beats of a tapered vessel that slides along its axis.

The inflow is half a sine of 300 cm^3/s that lasts 0.3 s in each beat of 0.8 s. `starlings simulate` runs truth.toml, ten
centimetres of vessel in 40 cells, its Young's modulus as below. Every 20 ms an image is registered: ten points of the wall
are followed, which slide along the axis with the pulse by up to 1.3 centimetres as the whole vessel does. Where they are
then are the profiles; noise of 0.1 mm is added along the radius. points.csv are the same ten points, their radial
displacement since the vessel was without load: what is left when they are taken for the same material in the same place.

Standard library and the project's own binary; the seed is fixed, so the script always writes the same files:

    python3 make_data.py ../../target/release/starlings
"""

import csv
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
YOUNG = 4.5e6
LENGTH, RADII, CELLS, FINE = 10.0, (1.2, 0.8), 10, 40
TAPER = (RADII[0] - RADII[1]) / LENGTH
SLIDE = 6.6  # cm per cm of mean displacement
NOISE = 0.01  # cm
SEED = 1


def flow_at(millisecond: int) -> float:
    """Inflow in cm^3/s."""
    phase = (millisecond % 800) / 1000
    return 300.0 * math.sin(math.pi * phase / 0.3) if phase < 0.3 else 0.0


def radius_at_rest(z: float) -> float:
    """Radius without load in cm."""
    return RADII[0] - TAPER * z


def write(name: str, header: list[str], rows: list[list[float]]) -> None:
    """Writes a CSV file."""
    with open(HERE / name, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.6g}" for value in row] for row in rows)


def simulate(binary: str) -> list[dict[str, str]]:
    """Runs the fine vessel at the times of a recording that is still empty."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "truth.csv"
        truth = HERE / "truth.toml"
        subprocess.run([binary, "simulate", truth, f"--set=E1={YOUNG}", "-o", out], check=True)
        with open(out, newline="") as file:
            return list(csv.DictReader(file))


def at(z: float, values: list[float]) -> float:
    """Linear between the centres of the fine cells, and on beyond them."""
    place = z / LENGTH * FINE - 0.5
    left = min(max(math.floor(place), 0), FINE - 2)
    return values[left] + (place - left) * (values[left + 1] - values[left])


def main(binary: str) -> None:
    """Simulates, registers, writes."""
    times = range(0, 1601, 20)
    write("flow.csv", ["time", "flow"], [[i / 1000, flow_at(i)] for i in times])
    nodes = [LENGTH * (i + 0.5) / CELLS for i in range(CELLS)]
    write("rest.csv", ["z", "r", "nz", "nr"], [[z, radius_at_rest(z), 0.0, 1.0] for z in nodes])
    noise = random.Random(SEED)
    profiles, points = [], []
    for row in simulate(binary):
        time = float(row["time"])
        eta = [float(row[f"displacement[{i}]"]) for i in range(FINE)]
        slide = SLIDE * sum(eta) / FINE
        points.append([time])
        for z in nodes:
            now = z + slide
            r = radius_at_rest(now) + at(now, eta) + noise.gauss(0.0, NOISE)
            profiles.append([time, now, r])
            points[-1].append(r - radius_at_rest(z))
    write("profiles.csv", ["time", "z", "r"], profiles)
    write("points.csv", ["time", *(f"displacement[{i}]" for i in range(CELLS))], points)


if __name__ == "__main__":
    main(sys.argv[1])
