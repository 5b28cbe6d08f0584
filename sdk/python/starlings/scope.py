"""What the names of an expression stand for. Next file to read: expression.py."""

from __future__ import annotations

from typing import Any, Callable, Optional

#: What a compiled part is called with: a frame of the caller's own; see `Scope`.
Code = Callable[[Any], float]


class Scope:
    """What the names of an expression stand for. Every method gives a closure over the frame, or None."""

    def name(self, name: str) -> Optional[Code]:
        """The value of a name."""
        return None

    def time(self) -> Code:
        """The value of `t`."""
        return lambda frame: float(frame)

    def delayed(self, name: str) -> Optional[Callable[[Any, float], float]]:
        """The value of an input at an earlier time, from frame and delay."""
        return None

    def slope(self, name: str) -> Optional[Code]:
        """The time derivative of an input."""
        return None
