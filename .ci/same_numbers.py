"""Compares two CSV files: the same header and shape, the same texts, numbers equal to one unit of their last digit.

Not byte for byte: sine and exponential may differ in the last digit from one C library to the next, and a number that is
written with few digits may then be rounded the other way.
"""

import csv
import sys
from decimal import Decimal, InvalidOperation


def rows(path: str) -> list[list[str]]:
    """All rows of a CSV file as text."""
    with open(path, newline="") as file:
        return list(csv.reader(file))


def same(made: str, kept: str) -> bool:
    """Whether two cells hold the same text, or numbers one unit of the last digit apart at most (1e-12 relative if less)."""
    if made == kept:
        return True
    try:
        a, b = Decimal(made), Decimal(kept)
    except InvalidOperation:
        return False
    digit = Decimal(1).scaleb(b.as_tuple().exponent)
    return abs(a - b) <= max(digit, abs(b) * Decimal("1e-12"), Decimal("1e-12"))


def main() -> int:
    """Prints the first difference; 0 when there is none."""
    first, second = rows(sys.argv[1]), rows(sys.argv[2])
    if first[0] != second[0] or len(first) != len(second):
        print(f"{sys.argv[2]}: header or number of rows differs from what the script writes", file=sys.stderr)
        return 1
    for number, (made, kept) in enumerate(zip(first[1:], second[1:]), start=2):
        for a, b in zip(made, kept, strict=True):
            if not same(a, b):
                print(f"{sys.argv[2]}, line {number}: {b}, the script writes {a}", file=sys.stderr)
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
