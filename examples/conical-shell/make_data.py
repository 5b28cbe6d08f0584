"""Writes tap.csv and ringing.csv: a conical shell that is tapped at its free edge.

The force is a half sine of 20 N and 4 ms. `starlings simulate` runs study.toml with the values below at the times
of a recording that is still empty; Gaussian noise of 2 % of the root mean square over both sensors is added.

Standard library and the project's own binary; the seed is fixed, so the script always writes the same files:

    python3 make_data.py ../../target/release/starlings
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
sys.dont_write_bytecode = True

import twin  # noqa: E402  stands beside the examples

TRUTH = {"E": 104e9, "h": 0.0021, "delta": 3.0}
SENSORS, SAMPLES, STEP = 2, 401, 0.001
NOISE, SEED = 0.02, 1
CHANNELS = [f"displacement[{i}]" for i in range(SENSORS)]


def simulated(binary: str) -> list[dict[str, str]]:
    """Runs the shell."""
    twin.write(HERE / "ringing.csv", ["time", *CHANNELS], [[i * STEP, *[0.0] * SENSORS] for i in range(SAMPLES)])
    return twin.simulate(binary, HERE / "study.toml", TRUTH)


def main(binary: str) -> None:
    """Simulates, observes, writes."""
    taps = [[i * 2e-4, 20.0 * math.sin(math.pi * i / 20)] for i in range(20)]
    twin.write(HERE / "tap.csv", ["time", "force"], [*taps, [0.004, 0.0], [0.4, 0.0]])
    clean = [[float(row["time"]), *(float(row[name]) for name in CHANNELS)] for row in simulated(binary)]
    rows, noise = twin.noisy(clean, NOISE, SEED)
    twin.write(HERE / "ringing.csv", ["time", *CHANNELS], rows)
    print(f"noise: {noise:.4g} m")


if __name__ == "__main__":
    main(sys.argv[1])
