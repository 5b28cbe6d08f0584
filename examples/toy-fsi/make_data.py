"""Writes uniform.csv, varying.csv and half.csv: the free vibration of a vessel filled with fluid, seen along its wall.

Truth: L = 10 cm, R = 1 cm, h = 0.15 cm, E = 4e6 dyn/cm^2, nu = 0.5, rho_s = 1.1 g/cm^3, rho_f = 1.0 g/cm^3, k_T = 5/6. The
wall starts from 0.12 cm times sin(pi x/L) + 1/2 sin(2 pi x/L) + 1/4 sin(3 pi x/L).

uniform.csv: three cosines in time, at x = j L/41. varying.csv: a wall of the thickness h (1 + 0.5 sin(pi x/L)) by finite
elements, 40 along and 8 across, at x = j L/40; the classical Runge-Kutta method with 40 steps per reading. half.csv: its
readings at x <= L/2. Displacements are measured every millisecond with Gaussian noise of 0.0005 cm, velocities with 1.5 cm/s.

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

LENGTH, RADIUS, THICKNESS, YOUNG, POISSON = 10.0, 1.0, 0.15, 4e6, 0.5
SOLID, FLUID, SHEAR_CORRECTION = 1.1, 1.0, 5.0 / 6.0
MASS = SOLID * THICKNESS
RING = YOUNG * THICKNESS / ((1.0 - POISSON**2) * RADIUS**2)
SHEAR = SHEAR_CORRECTION * YOUNG / (2.0 * (1.0 + POISSON)) * THICKNESS
BUMP = (0.12, 0.06, 0.03)
STEP, READINGS, SUBSTEPS = 1e-3, 61, 40
NOISE = (0.0005, 1.5)
SEED = 1

Matrix = list[list[float]]


def bump(xi: float) -> float:
    """The displacement at the start, at xi = x/L."""
    return sum(height * math.sin((i + 1) * math.pi * xi) for i, height in enumerate(BUMP))


def cosines(nodes: int) -> list[list[float]]:
    """Displacements and velocities of a uniform wall, one row per reading."""
    rows = []
    for k in range(READINGS):
        displacement, velocity = [0.0] * nodes, [0.0] * nodes
        for i, height in enumerate(BUMP):
            kappa = (i + 1) * math.pi / LENGTH
            added = FLUID / (kappa * math.tanh(kappa * RADIUS))
            omega = math.sqrt((RING + SHEAR * kappa**2) / (MASS + added))
            for j in range(nodes):
                shape = height * math.sin((i + 1) * math.pi * (j + 1) / (nodes + 1))
                displacement[j] += shape * math.cos(omega * STEP * k)
                velocity[j] -= shape * omega * math.sin(omega * STEP * k)
        rows.append(displacement + velocity)
    return rows


def assemble(cells: int, wave: float) -> tuple[Matrix, Matrix]:
    """Mass and stiffness of a wall of linear elements between its two ends."""
    n, dx = cells - 1, LENGTH / cells
    mass, stiffness = [[0.0] * n for _ in range(n)], [[0.0] * n for _ in range(n)]
    for e in range(cells):
        thickness = 1.0 + wave * math.sin(math.pi * (e + 0.5) / cells)
        for i in (e - 1, e):
            for j in (e - 1, e):
                if 0 <= i < n and 0 <= j < n:
                    product, slope = (2 * dx / 6, 1 / dx) if i == j else (dx / 6, -1 / dx)
                    mass[i][j] += MASS * thickness * product
                    stiffness[i][j] += thickness * (RING * product + SHEAR * slope)
    return mass, stiffness


def solve(matrix: Matrix, right: Matrix) -> Matrix:
    """Gaussian elimination without exchange of rows, for a positive definite matrix."""
    rows = [list(a) + list(b) for a, b in zip(matrix, right)]
    n = len(rows)
    for i in range(n):
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            if factor != 0.0:
                rows[k][i:] = [a - factor * b for a, b in zip(rows[k][i:], rows[i][i:])]
    for i in reversed(range(n)):
        rows[i] = [a / rows[i][i] for a in rows[i]]
        for k in range(i):
            rows[k] = [a - rows[k][i] * b for a, b in zip(rows[k], rows[i])]
    return [row[n:] for row in rows]


def added_mass(along: int, across: int) -> Matrix:
    """rho_f Mw Kp^-1 Mw by bilinear elements of the pressure, assembled and solved as a whole."""
    dx, dy = LENGTH / along, RADIUS / across
    product, slope = ((1 / 3, 1 / 6), (1 / 6, 1 / 3)), ((1.0, -1.0), (-1.0, 1.0))
    stride, n = across + 1, along - 1
    pressure = [[0.0] * (n * stride) for _ in range(n * stride)]
    corners = [(p, q) for p in (0, 1) for q in (0, 1)]
    for i in range(along):
        for j in range(across):
            for p, q in corners:
                for r, s in corners:
                    if 0 < i + p < along and 0 < i + r < along:
                        entry = slope[p][r] / dx * product[q][s] * dy + product[p][r] * dx * slope[q][s] / dy
                        pressure[(i + p - 1) * stride + j + q][(i + r - 1) * stride + j + s] += entry
    wall = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for k in range(max(i - 1, 0), min(i + 2, n)):
            wall[i][k] = 2 * dx / 3 if i == k else dx / 6
    flux = [[0.0] * n for _ in range(n * stride)]
    for i in range(n):
        flux[i * stride + across] = [FLUID * value for value in wall[i]]
    response = solve(pressure, flux)
    on_wall = [response[i * stride + across] for i in range(n)]
    return [[sum(wall[i][k] * on_wall[k][j] for k in range(n)) for j in range(n)] for i in range(n)]


def elements(cells: tuple[int, int], wave: float) -> list[list[float]]:
    """Displacements and velocities of a wall of varying thickness, one row per reading."""
    mass, stiffness = assemble(cells[0], wave)
    added = added_mass(*cells)
    total = [[a + b for a, b in zip(p, q)] for p, q in zip(mass, added)]
    n = cells[0] - 1
    operator = [[-value for value in row] for row in solve(total, stiffness)]
    d, v, rows, h = [bump((j + 1) / cells[0]) for j in range(n)], [0.0] * n, [], STEP / SUBSTEPS

    def acceleration(x: list[float]) -> list[float]:
        return [sum(map(float.__mul__, row, x)) for row in operator]

    def moved(x: list[float], rate: list[float], step: float) -> list[float]:
        return [a + step * b for a, b in zip(x, rate)]

    for _ in range(READINGS):
        rows.append(d + v)
        for _ in range(SUBSTEPS):
            v1, a1 = v, acceleration(d)
            v2, a2 = moved(v, a1, h / 2), acceleration(moved(d, v1, h / 2))
            v3, a3 = moved(v, a2, h / 2), acceleration(moved(d, v2, h / 2))
            v4, a4 = moved(v, a3, h), acceleration(moved(d, v3, h))
            d = [x + h / 6 * (p + 2 * q + 2 * r + s) for x, p, q, r, s in zip(d, v1, v2, v3, v4)]
            v = [x + h / 6 * (p + 2 * q + 2 * r + s) for x, p, q, r, s in zip(v, a1, a2, a3, a4)]
    return rows


def read_off(rows: list[list[float]], generator: random.Random) -> list[list[str]]:
    """Noisy readings, the displacements of all nodes before their velocities."""
    n = len(rows[0]) // 2
    readings = []
    for row in rows:
        noisy = [value + generator.gauss(0.0, NOISE[i >= n]) for i, value in enumerate(row)]
        readings.append([f"{value:.5f}" if i < n else f"{value:.2f}" for i, value in enumerate(noisy)])
    return readings


def write(name: str, readings: list[list[str]], seen: int) -> None:
    """Writes the readings of the first nodes beside this script, the first row at the start."""
    n = len(readings[0]) // 2
    columns = [*range(seen), *range(n, n + seen)]
    names = [f"{'displacement' if i < n else 'velocity'}[{i % n}]" for i in columns]
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", *names])
        for k, row in enumerate(readings):
            out.writerow([f"{k * STEP:.3f}", *(row[i] for i in columns)])


def main() -> None:
    """Simulates, observes, writes."""
    generator = random.Random(SEED)
    write("uniform.csv", read_off(cosines(40), generator), 40)
    varying = read_off(elements((40, 8), 0.5), generator)
    write("varying.csv", varying, 39)
    write("half.csv", varying, 20)


if __name__ == "__main__":
    main()
