"""Writes concentration.csv: concentrations of a drug in blood after 100 mg were swallowed.

Truth: absorption 1.2 1/h, elimination 0.15 1/h, volume 30 L. The two equations of gut and blood are integrated by the midpoint
rule in steps of 0.5 s, which the closed form of the server does not know of. Blood is taken every half hour for 12 h, with
Gaussian noise of 0.04 mg/L.

Standard library only; the seed is fixed, so the script always writes the same file:

    python3 make_data.py
"""

import csv
import random
from pathlib import Path

ABSORBED, ELIMINATED, VOLUME, DOSE = 1.2, 0.15, 30.0, 100.0
READING, READINGS, SUBSTEPS = 0.5, 24, 3600
NOISE, SEED = 0.04, 5


def advance(gut: float, blood: float) -> tuple:
    """Amounts in mg one reading later."""
    step = READING / SUBSTEPS
    for _ in range(SUBSTEPS):
        middle_gut = gut - 0.5 * step * ABSORBED * gut
        middle_blood = blood + 0.5 * step * (ABSORBED * gut - ELIMINATED * blood)
        gut -= step * ABSORBED * middle_gut
        blood += step * (ABSORBED * middle_gut - ELIMINATED * middle_blood)
    return gut, blood


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    gut, blood = DOSE, 0.0
    with open(Path(__file__).with_name("concentration.csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", "concentration"])
        for reading in range(READINGS + 1):
            seen = blood / VOLUME + generator.gauss(0.0, NOISE)
            out.writerow([f"{reading * READING:.9g}", f"{seen:.9g}"])
            gut, blood = advance(gut, blood)


if __name__ == "__main__":
    main()
