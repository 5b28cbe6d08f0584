"""Writes burst.csv and waves.csv: a sandwich plate struck by a burst, with stiffness lost in a patch.

The force is 100 N sin(wt/3.5) sin(wt) for 175 us, w = 2 pi 10 kHz. `starlings simulate` runs study.toml with the damage below at the times of a
recording that is still empty; Gaussian noise of 1 % of the root mean square over all sensors is added.

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

TRUTH = {"eps": 0.12, "xd": 0.52, "yd": 0.71}
OMEGA, WINDOW, SENSORS, SAMPLES, STEP = 2 * math.pi * 1e4, 3.5, 6, 751, 4e-6
PEAK, NOISE, SEED = 100.0, 0.01, 1
CHANNELS = [f"displacement[{i}]" for i in range(SENSORS)]


def force(time: float) -> float:
    """Burst in N."""
    if time > WINDOW * math.pi / OMEGA:
        return 0.0
    return PEAK * math.sin(OMEGA * time / WINDOW) * math.sin(OMEGA * time)


def simulated(binary: str) -> list[dict[str, str]]:
    """Runs the damaged plate."""
    twin.write(HERE / "waves.csv", ["time", *CHANNELS], [[i * STEP, *[0.0] * SENSORS] for i in range(SAMPLES)])
    return twin.simulate(binary, HERE / "study.toml", TRUTH)


def main(binary: str) -> None:
    """Simulates, observes, writes."""
    twin.write(HERE / "burst.csv", ["time", "force"], [*([i * 2e-6, force(i * 2e-6)] for i in range(91)), [0.003, 0.0]])
    clean = [[float(row["time"]), *(float(row[name]) for name in CHANNELS)] for row in simulated(binary)]
    rows, noise = twin.noisy(clean, NOISE, SEED)
    twin.write(HERE / "waves.csv", ["time", *CHANNELS], rows)
    print(f"noise: {noise:.4g} m")


if __name__ == "__main__":
    main(sys.argv[1])
