"""Quantities that a solver declares, and where their values stand in an array.

Next file to read: values.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Dict, Iterable, List, Mapping, Optional, Tuple, Union

from .failures import DeclarationError

#: Names that an expression gives another meaning.
_RESERVED = ("t", "pi")


@dataclass(frozen=True)
class Quantity:
    """A state, parameter, output or input of a solver.

    `unit` is a label such as "mmHg s/mL". `size` counts components; parameters and inputs have one. `role` is the physical
    meaning, such as "displacement", "velocity" or "pressure". `lo` and `hi` are what physics allows, `default` is the value
    where the study gives none (of a parameter only), all in `unit`. `says` is one plain sentence.
    """

    name: str
    unit: str = ""
    size: int = 1
    role: str = ""
    lo: Optional[float] = None
    hi: Optional[float] = None
    default: Optional[float] = None
    says: str = ""


#: How quantities may be declared: name to unit, name to quantity, or a list of names and quantities.
Quantities = Union[Mapping[str, Union[str, Quantity]], Iterable[Union[str, Quantity]]]


def quantities(what: str, declared: Quantities) -> Tuple[Quantity, ...]:
    """The quantities of one kind, checked; `what` is the kind, for messages.

    Raises DeclarationError for a name twice, a name that is no name, or a size below one.
    """
    if isinstance(declared, str) or not isinstance(declared, (Mapping, Iterable)):
        raise DeclarationError(f"{what} are a table of names and units or a list, not {declared!r}")
    found: List[Quantity] = []
    if isinstance(declared, Mapping):
        for name, value in declared.items():
            found.append(replace(value, name=name) if isinstance(value, Quantity) else Quantity(name, value))
    else:
        found = [q if isinstance(q, Quantity) else Quantity(q) for q in declared]
    seen = set()
    for q in found:
        _check(what, q)
        if q.name in seen:
            raise DeclarationError(f"{what} name `{q.name}` twice")
        seen.add(q.name)
    # A size may come as an integer of numpy, which messages do not take.
    return tuple(replace(q, size=int(q.size)) for q in found)


def is_name(name: object) -> bool:
    """Whether this can be the name of a quantity."""
    return isinstance(name, str) and name.replace("-", "_").replace(".", "_").isidentifier() and name not in _RESERVED


def _check(what: str, q: Quantity) -> None:
    if not is_name(q.name):
        raise DeclarationError(f"{what}: {q.name!r} cannot be a name; take a word of letters, digits and `_`")
    if not isinstance(q.unit, str):
        raise DeclarationError(f"{what}: the unit of `{q.name}` is {q.unit!r}, expected text")
    if not isinstance(q.size, Integral) or q.size < 1:
        raise DeclarationError(f"{what}: `{q.name}` has size {q.size!r}, expected a whole number from 1")
    if q.size > 1 and what in ("parameters", "inputs"):
        raise DeclarationError(f"{what}: `{q.name}` has {q.size} components; {what} are single numbers")
    if q.default is not None and what != "parameters":
        raise DeclarationError(f"{what}: `{q.name}` has a default; only parameters have one")
    if q.lo is not None and q.hi is not None and not q.lo < q.hi:
        raise DeclarationError(f"{what}: `{q.name}` lies between {q.lo} and {q.hi}, which is nowhere")
    if q.default is not None and not math.isfinite(q.default):
        raise DeclarationError(f"{what}: the default of `{q.name}` is {q.default}")


class Layout:
    """Where the components of a list of quantities stand in an array of `size` numbers."""

    def __init__(self, what: str, declared: Quantities) -> None:
        self.what = what
        self.quantities = quantities(what, declared)
        self.slices: Dict[str, slice] = {}
        at = 0
        for q in self.quantities:
            self.slices[q.name] = slice(at, at + q.size)
            at += q.size
        self.size = at
        #: Whether one of them has several components.
        self.has_fields = at > len(self.quantities)

    def __len__(self) -> int:
        return len(self.quantities)

    def __contains__(self, name: str) -> bool:
        return name in self.slices

    def of(self, name: str) -> Quantity:
        """The quantity of that name; KeyError where there is none."""
        for q in self.quantities:
            if q.name == name:
                return q
        raise KeyError(name)

    def names(self) -> List[str]:
        """Names in order."""
        return [q.name for q in self.quantities]

    def component(self, at: int) -> str:
        """Name of one component: `p`, or `wall[3]` of a field."""
        for q in self.quantities:
            part = self.slices[q.name]
            if part.start <= at < part.stop:
                return q.name if q.size == 1 else f"{q.name}[{at - part.start}]"
        raise IndexError(at)

    def find(self, name: str) -> Optional[range]:
        """Positions of a quantity, or of one component written `wall[3]`; None where there is none."""
        part = self.slices.get(name)
        if part is not None:
            return range(part.start, part.stop)
        field, bracket, index = name.partition("[")
        part = self.slices.get(field)
        if not bracket or part is None or not index.endswith("]") or not index[:-1].isdecimal():
            return None
        at = part.start + int(index[:-1])
        return range(at, at + 1) if at < part.stop else None

    def told(self) -> str:
        """The list for messages: `x, v, wall[40]`."""
        return ", ".join(q.name if q.size == 1 else f"{q.name}[{q.size}]" for q in self.quantities) or "none"
