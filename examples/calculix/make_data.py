"""Writes bench.csv: a bending test of a beam whose three Young's moduli are known, with noise on the dial gauges.

The deflections without noise are those that CalculiX 2.20 gives for beam.inp.tmpl with Young's moduli of 70, 45 and 30 GPa
from the root to the tip, on mesh.inp; they stand below so that this script needs no CalculiX. Added is Gaussian noise of
0.05 mm.

Standard library only; the seed is fixed, so the script always writes the same file:

    python3 make_data.py
"""

import csv
import random
from pathlib import Path

NOISE = 0.05  # mm
SEED = 1

# Time in s, force in N, deflection in mm at 100, 200 and 300 mm from the clamp.
BEAM = [
    (1.0, 5.1, 0.444005, 1.747022, 3.683121),
    (2.0, 9.8, 0.8532286, 3.356982, 7.076723),
    (3.0, 15.2, 1.32312, 5.205016, 10.97077),
    (4.0, 20.0, 1.74026, 6.844731, 14.42398),
    (5.0, 24.7, 2.147957, 8.446262, 17.79448),
    (6.0, 30.1, 2.615141, 10.27984, 21.64989),
    (7.0, 35.2, 3.054855, 12.00368, 25.27047),
    (8.0, 39.9, 3.458524, 13.58427, 28.58613),
]


def main() -> None:
    """Adds the noise, gauge by gauge within each row, and writes."""
    noise = random.Random(SEED)
    with open(Path(__file__).with_name("bench.csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", "force", "u100", "u200", "u300"])
        for time, force, *deflections in BEAM:
            gauges = [f"{u + noise.gauss(0.0, NOISE):.4f}" for u in deflections]
            out.writerow([time, force, *gauges])


if __name__ == "__main__":
    main()
