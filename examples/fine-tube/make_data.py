"""Writes flow.csv and pressure.csv: the first wave in a tube of two regions, as the pressure at its inlet shows it.

The inflow begins at time zero, half a sine of 300 cm^3/s and 0.3 s. `starlings simulate` runs truth.toml, on 5000 rings, with the
stiffness below, from rest; the pressure at the inlet is kept every 4 ms for 80 ms, with Gaussian noise of 0.2 mmHg.

Standard library and the project's own binary; the seed is fixed, so the script always writes the same files:

    python3 make_data.py ../../target/release/starlings
"""

import math
import random
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
sys.dont_write_bytecode = True

import twin  # noqa: E402  stands beside the examples

TRUTH = {"E1": 4e6, "E2": 7e6}
NOISE = 266.644
SEED = 1
DIGITS = 7


def simulated(binary: str) -> list[dict[str, str]]:
    """Runs the coarse tube at the times of a recording that is still empty."""
    twin.write(HERE / "pressure.csv", ["time", "inlet_pressure"], [[i / 250, 0.0] for i in range(1, 21)], DIGITS)
    return twin.simulate(binary, HERE / "truth.toml", TRUTH)


def main(binary: str) -> None:
    """Simulates, observes, writes."""
    flow = [[i / 1000, 300.0 * math.sin(math.pi * i / 300)] for i in range(0, 101, 2)]
    twin.write(HERE / "flow.csv", ["time", "flow"], flow, DIGITS)
    noise = random.Random(SEED)
    rows = [[float(row["time"]), float(row["inlet_pressure"]) + noise.gauss(0.0, NOISE)] for row in simulated(binary)]
    twin.write(HERE / "pressure.csv", ["time", "inlet_pressure"], rows, DIGITS)


if __name__ == "__main__":
    main(sys.argv[1])
