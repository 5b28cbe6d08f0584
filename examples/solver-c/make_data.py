"""Writes bath.csv: a steel plate that cools in a bath, with known conductivity and known heat transfer at its surface.

Truth: k = 45 W/(m K) and h = 1200 W/(m^2 K), a plate of 40 mm at 850 degC in a bath of 20 degC, heat capacity
3.6 MJ/(m^3 K). The temperatures are the series solution of the cooling plate (H. S. Carslaw and J. C. Jaeger, Conduction of
Heat in Solids, 1959, section 3.11), which knows no cells, plus Gaussian noise of 3 K.

Standard library only; the seed is fixed, so the script always writes the same file:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

K, H, HALF, RHO_C, PLATE, BATH = 45.0, 1200.0, 0.02, 3.6e6, 850.0, 20.0
TERMS = 12
NOISE = 3.0  # K
SEED = 1


def roots(biot: float) -> list[float]:
    """The first solutions of z tan(z) = Bi, one per branch of the tangent, by bisection."""
    found = []
    for n in range(TERMS):
        low, high = n * math.pi, (n + 0.5) * math.pi
        for _ in range(200):
            z = 0.5 * (low + high)
            if z * math.sin(z) < biot * math.cos(z) if n % 2 == 0 else z * math.sin(z) > biot * math.cos(z):
                low = z
            else:
                high = z
        found.append(0.5 * (low + high))
    return found


def temperature(time: float, place: float, zeros: list[float]) -> float:
    """In degC, `place` from 0 in the middle to 1 at the surface."""
    fourier = K * time / (RHO_C * HALF * HALF)
    total = 0.0
    for z in zeros:
        weight = 4.0 * math.sin(z) / (2.0 * z + math.sin(2.0 * z))
        total += weight * math.exp(-z * z * fourier) * math.cos(z * place)
    return BATH + (PLATE - BATH) * total


def main() -> None:
    """Two thermocouples, a reading every two seconds."""
    noise = random.Random(SEED)
    zeros = roots(H * HALF / K)
    with open(Path(__file__).with_name("bath.csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", "centre", "surface"])
        for n in range(1, 61):
            time = 2.0 * n
            readings = [temperature(time, place, zeros) + noise.gauss(0.0, NOISE) for place in (0.0, 1.0)]
            out.writerow([time, *(f"{reading:.3f}" for reading in readings)])


if __name__ == "__main__":
    main()
