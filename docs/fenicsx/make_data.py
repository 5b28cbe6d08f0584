"""Writes gauges.csv: the same physics on elements half as long, in steps a quarter as long, with noise.

Needs FEniCSx. E_root = 900 kPa, E_tip = 500 kPa; gauges every 20 ms, noise of 1 mm.
"""

import random
from pathlib import Path

import numpy as np
import starlings
from beam import GAUGES, Beam

TIMES = np.arange(0.0, 4.0 + 1e-9, 0.02)
# The tip is pushed up for a quarter of a second and again, harder, downwards.
FORCE = np.where((TIMES > 0.1) & (TIMES < 0.35), 4.0, 0.0) - np.where((TIMES > 1.5) & (TIMES < 1.75), 6.0, 0.0)

chance = random.Random(1)
truth = starlings.simulate(
    Beam(along=64, dt=0.00125), parameters={"E_root": 900.0, "E_tip": 500.0}, times=TIMES, inputs={"force": (TIMES, FORCE)}
)
names = [f"deflection[{i}]" for i in range(len(GAUGES))]
lines = [",".join(["time", "force", *names])]
for t, force, row in zip(TIMES, FORCE, truth.outputs["deflection"]):
    noisy = [f"{y + chance.gauss(0.0, 0.001):.5f}" for y in row]
    lines.append(",".join([f"{t:.2f}", f"{force:g}", *noisy]))
Path(__file__).with_name("gauges.csv").write_text("\n".join(lines) + "\n")
