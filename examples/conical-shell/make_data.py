"""Writes tap.csv and ringing.csv: a conical shell that is tapped at its free edge.

The force is a half sine of 20 N and 4 ms. `starlings simulate` runs study.toml with the values below at the times
of a recording that is still empty; Gaussian noise of 2 % of the root mean square over both sensors is added.

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
TRUTH = {"E": 104e9, "h": 0.0021, "delta": 3.0}
SENSORS, SAMPLES, STEP = 2, 401, 0.001
NOISE, SEED = 0.02, 1
CHANNELS = [f"displacement[{i}]" for i in range(SENSORS)]


def write(path: Path, header: list[str], rows: list[list[float]]) -> None:
    """Writes a CSV file."""
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.6g}" for value in row] for row in rows)


def simulate(binary: str) -> list[dict[str, str]]:
    """Runs the shell."""
    write(HERE / "ringing.csv", ["time", *CHANNELS], [[i * STEP, *[0.0] * SENSORS] for i in range(SAMPLES)])
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "truth.csv"
        values = [f"--set={name}={value}" for name, value in TRUTH.items()]
        subprocess.run([binary, "simulate", HERE / "study.toml", *values, "-o", out], check=True)
        with open(out, newline="") as file:
            return list(csv.DictReader(file))


def main(binary: str) -> None:
    """Simulates, observes, writes."""
    taps = [[i * 2e-4, 20.0 * math.sin(math.pi * i / 20)] for i in range(20)]
    write(HERE / "tap.csv", ["time", "force"], [*taps, [0.004, 0.0], [0.4, 0.0]])
    clean = [[float(row["time"]), *(float(row[name]) for name in CHANNELS)] for row in simulate(binary)]
    values = [value for row in clean for value in row[1:]]
    noise = NOISE * math.sqrt(sum(value * value for value in values) / len(values))
    generator = random.Random(SEED)
    write(
        HERE / "ringing.csv",
        ["time", *CHANNELS],
        [[row[0], *(value + generator.gauss(0.0, noise) for value in row[1:])] for row in clean],
    )
    print(f"noise: {noise:.4g} m")


if __name__ == "__main__":
    main(sys.argv[1])
