"""What the scripts share that make an example's data with the project's own binary: a CSV file, a simulated recording."""

import csv
import math
import random
import subprocess
import tempfile
from pathlib import Path


def write(path: Path, header: list[str], rows: list[list[float]], digits: int = 6) -> None:
    """Writes a CSV file of so many significant digits."""
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([f"{value:.{digits}g}" for value in row] for row in rows)


def simulate(binary: str, study: Path, truth: dict[str, float]) -> list[dict[str, str]]:
    """Runs a study with the true values, at the times of its recording."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "truth.csv"
        values = [f"--set={name}={value}" for name, value in truth.items()]
        subprocess.run([binary, "simulate", study, *values, "-o", out], check=True)
        with open(out, newline="") as file:
            return list(csv.DictReader(file))


def noisy(clean: list[list[float]], share: float, seed: int) -> tuple[list[list[float]], float]:
    """Rows with Gaussian noise of a share of the root mean square over all columns but the first, and its standard deviation."""
    values = [value for row in clean for value in row[1:]]
    noise = share * math.sqrt(sum(value * value for value in values) / len(values))
    generator = random.Random(seed)
    return [[row[0], *(value + generator.gauss(0.0, noise) for value in row[1:])] for row in clean], noise
