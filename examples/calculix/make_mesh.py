"""Writes mesh.inp: a cantilever of 300 x 20 x 5 mm in twelve quadratic hexahedra, four in each of its three regions.

Standard library only; running it again writes the same file:

    python3 make_mesh.py
"""

from pathlib import Path

LENGTH, WIDTH, HEIGHT = 300.0, 20.0, 5.0
ELEMENTS = 12
REGIONS = ["ROOT", "MIDDLE", "TIP"]

# Corners, then the middles of the edges, of a 20-node hexahedron in half steps of an element along x, y and z.
NODES = [
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1),
]  # fmt: skip


def number(i: int, j: int, k: int) -> int:
    """Number of the node at these half steps; numbers grow along x, so lists of nodes stay in this order."""
    return 9 * i + 3 * j + k + 1


def listed(name: str, numbers: list[int]) -> list[str]:
    """A set of nodes, eight to a line."""
    lines = [", ".join(map(str, numbers[at : at + 8])) for at in range(0, len(numbers), 8)]
    return [f"*NSET, NSET={name}", *(line + "," for line in lines[:-1]), lines[-1]]


def main() -> None:
    """Writes the nodes that belong to elements, the elements by region, and the sets."""
    used = {(2 * e + di, dj, dk) for e in range(ELEMENTS) for di, dj, dk in NODES}
    lines = ["*NODE, NSET=ALL"]
    for i, j, k in sorted(used, key=lambda at: number(*at)):
        x, y, z = i * LENGTH / (2 * ELEMENTS), j * WIDTH / 2, k * HEIGHT / 2
        lines.append(f"{number(i, j, k)}, {x}, {y}, {z}")
    per_region = ELEMENTS // len(REGIONS)
    for element in range(ELEMENTS):
        if element % per_region == 0:
            lines.append(f"*ELEMENT, TYPE=C3D20, ELSET={REGIONS[element // per_region]}")
        nodes = [number(2 * element + di, dj, dk) for di, dj, dk in NODES]
        lines.append(", ".join(map(str, [element + 1, *nodes[:10]])) + ",")
        lines.append(", ".join(map(str, nodes[10:])))
    last = 2 * ELEMENTS
    lines += listed("CLAMP", [number(*at) for at in sorted(used) if at[0] == 0])
    # The force acts on the middle of the lower edge of the tip; the gauges stand at the ends of the regions.
    lines += listed("FORCE", [number(last, 1, 0)])
    step = 2 * per_region
    lines += listed("GAUGES", [number(step * (n + 1), 0, 0) for n in range(len(REGIONS))])
    Path(__file__).with_name("mesh.inp").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
