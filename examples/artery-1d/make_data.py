"""Writes flow.csv and legs.csv: three beats of an aorta with two iliac arteries, on a fine grid.

The inflow is half a sine of 300 cm^3/s that lasts 0.3 s in each beat of 0.8 s. `starlings simulate` runs truth.toml with
the values below, the network at rest at time zero; every 10 ms its inlet pressure and the flows into the legs are kept,
with Gaussian noise of 2 mmHg and 3 cm^3/s.

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

TRUTH = {"E_aorta": 4e6, "E_left": 1.2e7, "R_d_left_leg": 3000.0, "R_d_right_leg": 4500.0, "p0": 103991.16}
NOISE = {"inlet_pressure": 2.0 * 1333.22, "outflow_left_leg": 3.0, "outflow_right_leg": 3.0}
SEED = 1


def flow_at(millisecond: int) -> float:
    """Inflow in cm^3/s."""
    phase = (millisecond % 800) / 1000
    return 300.0 * math.sin(math.pi * phase / 0.3) if phase < 0.3 else 0.0


def simulated(binary: str) -> list[dict[str, str]]:
    """Runs the fine network at the times of a recording that is still empty."""
    twin.write(HERE / "legs.csv", ["time", *NOISE], [[i / 100, *[0.0] * len(NOISE)] for i in range(241)])
    return twin.simulate(binary, HERE / "truth.toml", TRUTH)


def main(binary: str) -> None:
    """Simulates, observes, writes."""
    twin.write(HERE / "flow.csv", ["time", "flow"], [[i / 1000, flow_at(i)] for i in range(0, 2401, 5)])
    noise = random.Random(SEED)
    rows = [
        [float(row["time"]), *(float(row[name]) + noise.gauss(0.0, sd) for name, sd in NOISE.items())]
        for row in simulated(binary)
    ]
    twin.write(HERE / "legs.csv", ["time", *NOISE], rows)


if __name__ == "__main__":
    main(sys.argv[1])
