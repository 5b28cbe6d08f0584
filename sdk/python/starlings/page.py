"""Pages inside a notebook."""

from __future__ import annotations

import html
from pathlib import Path

#: Height of a page in a notebook; it scrolls inside.
_HEIGHT = "640px"


def frame(file: Path) -> str:
    """A page that stands by itself, set into another one with nothing shared between the two."""
    if not file.is_file():
        return f"<p>{html.escape(str(file))} is not there</p>"
    return of_text(file.read_text(encoding="utf-8"))


def of_text(text: str) -> str:
    """The same of its text."""
    # Without allow-downloads no figure could be saved from a notebook.
    sandbox = "allow-scripts allow-popups allow-downloads"
    style = f"width:100%;height:{_HEIGHT};border:1px solid #ccc"
    return f'<iframe srcdoc="{html.escape(text, quote=True)}" style="{style}" sandbox="{sandbox}"></iframe>'
