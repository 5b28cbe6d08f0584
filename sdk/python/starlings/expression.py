"""The language of expressions of a study file: parsed into closures, never evaluated as Python.

`+ - * / ^` with the usual precedence (`-x^2` is `-(x^2)`, `2^3^2` is 512), comparisons, `if(cond, a, b)`, `sin cos tan exp
log sqrt abs sign min max tanh step` (`step(0)` is 1), `pi`, `t`, and of an input `delay(u, tau)` and `ddt(u)`. Numbers behave
as IEEE 754 says: 1/0 is infinite and the square root of -1 is no number, where Python's own would raise. Parsing is by
operator precedence (Pratt 1973). Next file to read: terms.py.
"""

from __future__ import annotations

import math
import re
from typing import Any, Callable, List, Mapping, Optional, Tuple

from .arithmetic import ONE, TWO, whole_power
from .scope import Code, Scope

_MAX_DEPTH = 200
_MAX_LENGTH = 4000


class ExpressionError(ValueError):
    """An expression is wrong: `message`, and the `column` from 1."""

    def __init__(self, text: str, column: int, message: str) -> None:
        super().__init__(f"`{text}`, column {column}: {message}")
        self.column = column
        self.message = message


class _Table(Scope):
    """Names with fixed values; the frame is the time."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self._values = values

    def name(self, name: str) -> Optional[Code]:
        if name not in self._values:
            return None
        value = float(self._values[name])
        return lambda _: value


class Expression:
    """A parsed expression. `names` are those that a scope has to know."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._tree = _Parser(text).whole()
        self.names: List[str] = []
        _collect(self._tree, self.names)

    def compile(self, scope: Scope) -> Code:
        """The expression as a function of a frame. Raises ExpressionError for a name that the scope does not know."""
        return _compile(self.text, self._tree, scope)

    def __call__(self, t: float = 0.0, **values: float) -> float:
        """The value at time `t` where names have these values."""
        return self.compile(_Table(values))(t)


_ARGUMENTS = {**{name: 1 for name in ONE}, "min": 2, "max": 2, "if": 3, "delay": 2, "ddt": 1}
#: Left and right binding powers.
_BINDING = {
    **{o: (1, 2) for o in ("<", "<=", ">", ">=", "==", "!=")},
    "+": (3, 4),
    "-": (3, 4),
    "*": (5, 6),
    "/": (5, 6),
    "^": (9, 8),
}
_UNARY = 7
_NUMBER = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_WORD = re.compile(r"[^\W\d]\w*")
_OPERATOR = re.compile(r"<=|>=|==|!=|[-+*/^<>]")

#: A part of an expression: what it is, its column, and its own fields.
_Node = Tuple[Any, ...]


class _Parser:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.depth = 0

    def whole(self) -> _Node:
        if len(self.text) > _MAX_LENGTH:
            raise self.error(f"longer than {_MAX_LENGTH} characters", _MAX_LENGTH)
        node = self.expression(0)
        if self.peek():
            raise self.unexpected("an operator or the end")
        return node

    def error(self, message: str, at: Optional[int] = None) -> ExpressionError:
        shown = self.text if len(self.text) <= 80 else self.text[:77] + "..."
        return ExpressionError(shown, (self.at if at is None else at) + 1, message)

    def peek(self) -> str:
        """The next character that is not white space; empty at the end."""
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        return self.text[self.at : self.at + 1]

    def unexpected(self, expected: str) -> ExpressionError:
        found = self.peek()
        word = re.compile(r"\w+").match(self.text, self.at)
        hint = ""
        if expected.startswith("an operator") and (word or found == "("):
            hint = " (a product needs `*`)"
        elif found == "*" and self.text[self.at - 1 : self.at] == "*":
            hint = " (a power is written `^`)"
        elif found == "=":
            hint = " (equality is written `==`)"
        told = f"`{word.group() if word else found}`" if found else "the end"
        return self.error(f"expected {expected}, found {told}{hint}")

    def expression(self, floor: int) -> _Node:
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            raise self.error(f"nested more than {_MAX_DEPTH} deep")
        left = self.prefix()
        compared = False
        while self.peek():
            found = _OPERATOR.match(self.text, self.at)
            if not found:
                break
            operator = found.group()
            before, after = _BINDING[operator]
            if before < floor:
                break
            if before == 1:
                if compared:
                    raise self.error("comparisons do not chain: put one of them in parentheses")
                compared = True
            self.at = found.end()
            left = ("pair", operator, left, self.expression(after))
        self.depth -= 1
        return left

    def prefix(self) -> _Node:
        c = self.peek()
        if c in ("-", "+"):
            self.at += 1
            inside = self.expression(_UNARY)
            return ("negative", inside) if c == "-" else inside
        if c == "(":
            self.at += 1
            inside = self.expression(0)
            self.close("an operator or `)`")
            return inside
        number = _NUMBER.match(self.text, self.at)
        if number:
            value = float(number.group())
            if math.isinf(value):
                raise self.error(f"`{number.group()}` is too large a number")
            self.at = number.end()
            return ("number", value)
        word = _WORD.match(self.text, self.at)
        if not word:
            raise self.unexpected("a number, a name, a function or `(`")
        return self.word(word.group())

    def word(self, name: str) -> _Node:
        column = self.at
        self.at += len(name)
        if self.peek() == "(":
            self.at += 1
            return self.call(name, column)
        if name == "t":
            return ("time",)
        if name == "pi":
            return ("number", math.pi)
        if name in _ARGUMENTS:
            raise self.error(f"`{name}` is a function: expected `{name}(...)`", column)
        return ("name", name, column)

    def call(self, name: str, column: int) -> _Node:
        count = _ARGUMENTS.get(name)
        if count is None:
            known = ", ".join(_ARGUMENTS)
            raise self.error(f"no function named `{name}`; there are {known}", column)
        found: List[_Node] = []
        while True:
            found.append(self.expression(0))
            last = len(found) == count
            c = self.peek()
            if c == "," and not last:
                self.at += 1
            elif c == ")" and last:
                self.at += 1
                break
            elif c in (",", ")"):
                raise self.error(f"`{name}` takes {count} argument{'s' if count > 1 else ''}")
            else:
                raise self.unexpected("an operator or " + ("`)`" if last else "`,`"))
        if name in ("delay", "ddt") and found[0][0] != "name":
            raise self.error(f"`{name}` needs the name of an input", column)
        return ("call", name, *found)

    def close(self, expected: str) -> None:
        if self.peek() != ")":
            raise self.unexpected(expected)
        self.at += 1


def _collect(node: _Node, names: List[str]) -> None:
    """Adds every name below, in the order of first use."""
    if node[0] == "name" and node[1] not in names:
        names.append(node[1])
    for part in node[1:]:
        if isinstance(part, tuple):
            _collect(part, names)


def _whole(node: _Node) -> Optional[int]:
    """The whole number that stands here, for powers by squaring."""
    if node[0] == "negative":
        inside = _whole(node[1])
        return None if inside is None else -inside
    if node[0] == "number" and node[1] == int(node[1]) and abs(node[1]) <= 64:
        return int(node[1])
    return None


def _compile(text: str, node: _Node, scope: Scope) -> Code:
    kind = node[0]
    if kind == "number":
        value: float = node[1]
        return lambda _: value
    if kind == "time":
        return scope.time()
    if kind == "name":
        found = scope.name(node[1])
        if found is None:
            raise ExpressionError(text, node[2] + 1, f"nothing is named `{node[1]}`")
        return found
    if kind == "negative":
        inside = _compile(text, node[1], scope)
        return lambda frame: -inside(frame)
    if kind == "pair":
        return _compile_pair(text, node, scope)
    return _compile_call(text, node, scope)


def _compile_pair(text: str, node: _Node, scope: Scope) -> Code:
    _, operator, left, right = node
    a = _compile(text, left, scope)
    n = _whole(right) if operator == "^" else None
    if n is not None:
        whole = n
        return lambda frame: whole_power(a(frame), whole)
    b, operation = _compile(text, right, scope), TWO[operator]
    return lambda frame: operation(a(frame), b(frame))


def _compile_call(text: str, node: _Node, scope: Scope) -> Code:
    name = node[1]
    if name == "delay":
        of, tau = scope.delayed(node[2][1]), _compile(text, node[3], scope)
        if of is None:
            raise ExpressionError(text, node[2][2] + 1, f"`delay` of `{node[2][1]}`, which is no input")
        delayed = of
        return lambda frame: delayed(frame, tau(frame))
    if name == "ddt":
        slope = scope.slope(node[2][1])
        if slope is None:
            raise ExpressionError(text, node[2][2] + 1, f"`ddt` of `{node[2][1]}`, which is no input")
        return slope
    parts = [_compile(text, part, scope) for part in node[2:]]
    if name == "if":
        condition, yes, no = parts
        # A condition that is no number is not true.
        return lambda frame: yes(frame) if abs(condition(frame)) > 0.0 else no(frame)
    if len(parts) == 1:
        one, a = ONE[name], parts[0]
        return lambda frame: one(a(frame))
    two, left, right = TWO[name], parts[0], parts[1]
    return lambda frame: two(left(frame), right(frame))
