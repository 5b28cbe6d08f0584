"""Compares two CSV files: the same header and shape, numbers equal to 1e-12 relative.

Not byte for byte: sine and exponential may differ in the last digit from one C library to the next.
"""

import csv
import math
import sys


def rows(path: str) -> list[list[str]]:
    """All rows of a CSV file as text."""
    with open(path, newline="") as file:
        return list(csv.reader(file))


def main() -> int:
    """Prints the first difference; 0 when there is none."""
    first, second = rows(sys.argv[1]), rows(sys.argv[2])
    if first[0] != second[0] or len(first) != len(second):
        print(f"{sys.argv[2]}: header or number of rows differs from what the script writes", file=sys.stderr)
        return 1
    for number, (made, kept) in enumerate(zip(first[1:], second[1:]), start=2):
        for a, b in zip(made, kept, strict=True):
            if not math.isclose(float(a), float(b), rel_tol=1e-12, abs_tol=1e-12):
                print(f"{sys.argv[2]}, line {number}: {b}, the script writes {a}", file=sys.stderr)
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
