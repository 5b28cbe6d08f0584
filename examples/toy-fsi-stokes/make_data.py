"""Writes vessel.csv: the free vibration of a vessel filled with a viscous fluid, seen along its wall.

Truth: L = 10 cm, R = 1 cm, h = 0.15 cm, E = 4e6 dyn/cm^2, nu = 0.5, rho_s = 1.1 g/cm^3, rho_f = 1.06 g/cm^3, k_T = 5/6 and
mu = 0.05 g/cm/s. The wall starts from 0.12 cm times sin(pi x/L) + 1/2 sin(2 pi x/L) + 1/4 sin(3 pi x/L), the fluid from rest.

Each of the three modes is a wall amplitude and twenty profiles of the flow across the channel, integrated by Gauss's
quadrature, and moves by the classical Runge-Kutta method with 50 steps per reading. Displacements are measured every
millisecond at x = j L/41 with Gaussian noise of 0.005 cm, velocities with 1.5 cm/s.

Standard library only; the seed is fixed, so the script always writes the same file:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

LENGTH, RADIUS, THICKNESS, YOUNG, POISSON = 10.0, 1.0, 0.15, 4e6, 0.5
SOLID, FLUID, SHEAR_CORRECTION, VISCOSITY = 1.1, 1.06, 5.0 / 6.0, 0.05
MASS = SOLID * THICKNESS
RING = YOUNG * THICKNESS / ((1.0 - POISSON**2) * RADIUS**2)
SHEAR = SHEAR_CORRECTION * YOUNG / (2.0 * (1.0 + POISSON)) * THICKNESS
BUMP = (0.12, 0.06, 0.03)
NODES, PROFILES, PANELS = 40, 20, 60
STEP, READINGS, SUBSTEPS = 1e-3, 61, 50
NOISE = (0.005, 1.5)
SEED = 1
# Gauss's five points and weights on (-1, 1).
GAUSS = [(0.0, 128 / 225)] + [
    (sign * math.sqrt(5 + side * 2 * math.sqrt(10 / 7)) / 3, (322 - side * 13 * math.sqrt(70)) / 900)
    for side in (-1, 1)
    for sign in (-1, 1)
]


def legendre(top: int, x: float) -> tuple[list[float], list[float]]:
    """Legendre's polynomials up to degree `top` and their derivatives."""
    value, slope = [1.0, x], [0.0, 1.0]
    for k in range(1, top):
        value.append(((2 * k + 1) * x * value[k] - k * value[k - 1]) / (k + 1))
        slope.append((2 * k + 1) * value[k] + slope[k - 1])
    return value, slope


def profiles(eta: float) -> tuple[list[float], list[float], list[float]]:
    """Axial velocities, their slopes, and their integrals from the axis, at y = eta R."""
    p, dp = legendre(2 * PROFILES + 1, eta)

    def integral(m: int) -> float:
        return (p[m + 1] - (p[m - 1] if m else 0.0)) / (2 * m + 1)

    axial = [p[2 * j] - p[2 * j + 2] for j in range(PROFILES)]
    slopes = [dp[2 * j] - dp[2 * j + 2] for j in range(PROFILES)]
    return axial, slopes, [integral(2 * j) - integral(2 * j + 2) for j in range(PROFILES)]


def solve(matrix: list[list[float]], right: list[list[float]]) -> list[list[float]]:
    """Gaussian elimination without exchange of rows, for a positive definite matrix."""
    rows = [list(a) + list(b) for a, b in zip(matrix, right)]
    n = len(rows)
    for i in range(n):
        rows[i] = [a / rows[i][i] for a in rows[i]]
        for k in range(n):
            if k != i:
                rows[k] = [a - rows[k][i] * b for a, b in zip(rows[k], rows[i])]
    return [row[n:] for row in rows]


def mode(kappa: float) -> tuple[list[list[float]], list[float]]:
    """Rates of (amplitude, coefficients) at a wave number, and the wall's velocity over the coefficients."""
    mass = [[0.0] * PROFILES for _ in range(PROFILES)]
    loss = [[0.0] * PROFILES for _ in range(PROFILES)]
    for panel in range(PANELS):
        for point, weight in GAUSS:
            axial, slopes, across = profiles((panel + 0.5 + 0.5 * point) / PANELS)
            weight *= 0.5 * RADIUS / PANELS
            for i in range(PROFILES):
                shear_i = slopes[i] / RADIUS + kappa**2 * RADIUS * across[i]
                for j in range(PROFILES):
                    shear_j = slopes[j] / RADIUS + kappa**2 * RADIUS * across[j]
                    both = axial[i] * axial[j]
                    mass[i][j] += weight * FLUID * (both + (kappa * RADIUS) ** 2 * across[i] * across[j])
                    loss[i][j] += weight * VISCOSITY * (4 * kappa**2 * both + shear_i * shear_j)
    wall = [kappa * RADIUS * value for value in profiles(1.0)[2]]
    for i in range(PROFILES):
        for j in range(PROFILES):
            mass[i][j] += MASS * wall[i] * wall[j]
    stiffness = RING + SHEAR * kappa**2
    pull = solve(mass, [[stiffness * wall[i], *loss[i]] for i in range(PROFILES)])
    return [[0.0, *wall]] + [[-value for value in row] for row in pull], wall


def amplitudes(height: float, kappa: float) -> list[tuple[float, float]]:
    """Amplitude and speed of a mode at every reading."""
    rates, wall = mode(kappa)
    x, h, readings = [height] + [0.0] * PROFILES, STEP / SUBSTEPS, []

    def rate(x: list[float]) -> list[float]:
        return [sum(map(float.__mul__, row, x)) for row in rates]

    def moved(x: list[float], direction: list[float], step: float) -> list[float]:
        return [a + step * b for a, b in zip(x, direction)]

    for _ in range(READINGS):
        readings.append((x[0], sum(w * c for w, c in zip(wall, x[1:]))))
        for _ in range(SUBSTEPS):
            k1 = rate(x)
            k2 = rate(moved(x, k1, h / 2))
            k3 = rate(moved(x, k2, h / 2))
            k4 = rate(moved(x, k3, h))
            x = [a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4)]
    return readings


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    modes = [amplitudes(height, (i + 1) * math.pi / LENGTH) for i, height in enumerate(BUMP)]
    names = [f"{field}[{j}]" for field in ("displacement", "velocity") for j in range(NODES)]
    with open(Path(__file__).with_name("vessel.csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", *names])
        for k in range(READINGS):
            row = [f"{k * STEP:.3f}"]
            for field, digits in ((0, 4), (1, 2)):
                for j in range(NODES):
                    shapes = (math.sin((i + 1) * math.pi * (j + 1) / (NODES + 1)) for i in range(len(modes)))
                    value = sum(shape * mode[k][field] for shape, mode in zip(shapes, modes))
                    row.append(f"{value + generator.gauss(0.0, NOISE[field]):.{digits}f}")
            out.writerow(row)


if __name__ == "__main__":
    main()
