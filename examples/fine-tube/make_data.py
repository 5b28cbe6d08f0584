"""Writes flow.csv and pressure.csv: the first wave in a tube of two regions, as the pressure at its inlet shows it.

The inflow begins at time zero, half a sine of 300 cm^3/s and 0.3 s. `starlings simulate` runs truth.toml, on 5000 rings, with the
stiffness below, from rest; the pressure at the inlet is kept every 4 ms for 80 ms, with Gaussian noise of 0.2 mmHg.

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
TRUTH = {"E1": 4e6, "E2": 7e6}
NOISE = 266.644
SEED = 1


def write(path: Path, header: list[str], rows: list[list[float]]) -> None:
    """Writes a CSV file."""
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.7g}" for value in row] for row in rows)


def simulate(binary: str) -> list[dict[str, str]]:
    """Runs the coarse tube at the times of a recording that is still empty."""
    write(HERE / "pressure.csv", ["time", "inlet_pressure"], [[i / 250, 0.0] for i in range(1, 21)])
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "truth.csv"
        values = [f"--set={name}={value}" for name, value in TRUTH.items()]
        subprocess.run([binary, "simulate", HERE / "truth.toml", *values, "-o", out], check=True)
        with open(out, newline="") as file:
            return list(csv.DictReader(file))


def main(binary: str) -> None:
    """Simulates, observes, writes."""
    flow = [[i / 1000, 300.0 * math.sin(math.pi * i / 300)] for i in range(0, 101, 2)]
    write(HERE / "flow.csv", ["time", "flow"], flow)
    noise = random.Random(SEED)
    rows = [[float(row["time"]), float(row["inlet_pressure"]) + noise.gauss(0.0, NOISE)] for row in simulate(binary)]
    write(HERE / "pressure.csv", ["time", "inlet_pressure"], rows)


if __name__ == "__main__":
    main(sys.argv[1])
