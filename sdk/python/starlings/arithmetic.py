"""Numbers as IEEE 754 has them, where Python's own functions would raise; the functions of the language of expressions.

Next file to read: expression.py.
"""

from __future__ import annotations

import math
from typing import Callable, Dict


def divide(a: float, b: float) -> float:
    """a/b; infinite or not a number where b is zero."""
    try:
        return a / b
    except ZeroDivisionError:
        if a == 0.0 or a != a:
            return math.nan
        return math.copysign(math.inf, a) * math.copysign(1.0, b)


def _power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except OverflowError:
        return -math.inf if a < 0.0 and b % 2.0 == 1.0 else math.inf
    except ValueError:
        if a != 0.0:
            return math.nan
        # Zero to a negative power.
        return math.copysign(math.inf, a) if b % 2.0 == 1.0 else math.inf


def whole_power(a: float, n: int) -> float:
    """a to the n by repeated squaring."""
    base, left, result = a, abs(n), 1.0
    while left:
        if left & 1:
            result *= base
        base *= base
        left >>= 1
    return divide(1.0, result) if n < 0 else result


def _safe(function: Callable[[float], float]) -> Callable[[float], float]:
    def call(a: float) -> float:
        try:
            return function(a)
        except ValueError:
            return math.nan
        except OverflowError:
            return math.inf

    return call


def _log(a: float) -> float:
    return -math.inf if a == 0.0 else math.log(a)


def _sign(a: float) -> float:
    return 1.0 if a > 0.0 else -1.0 if a < 0.0 else a


def _step(a: float) -> float:
    return 1.0 if a >= 0.0 else 0.0 if a < 0.0 else math.nan


#: Functions of one argument.
ONE: Dict[str, Callable[[float], float]] = {
    "sin": _safe(math.sin),
    "cos": _safe(math.cos),
    "tan": _safe(math.tan),
    "exp": _safe(math.exp),
    "log": _safe(_log),
    "sqrt": _safe(math.sqrt),
    "abs": abs,
    "sign": _sign,
    "tanh": math.tanh,
    "step": _step,
}
#: Operators and functions of two arguments.
TWO: Dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": divide,
    "^": _power,
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "==": lambda a, b: float(a == b),
    "!=": lambda a, b: float(a != b),
    "min": lambda a, b: b if b < a else a,
    "max": lambda a, b: b if b > a else a,
}
