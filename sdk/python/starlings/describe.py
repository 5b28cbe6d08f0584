"""What a solver declares, as text for people."""

from __future__ import annotations

import os
from typing import List

from .quantity import Layout
from .solver import Served


def table(served: Served) -> str:
    """Everything that the solver declares."""
    lines = [served.name + (f": {served.says}" if served.says else "")]
    for layout in (served.parameters, served.states, served.outputs, served.inputs):
        lines += ["", f"{layout.what}:" if len(layout) else f"{layout.what}: none"]
        lines += _rows(layout)
    lines.append("")
    lines.append(
        "restart:       " + ("yes" if served.restart else 'no: whole records only (estimator kind = "batch")')
    )
    lines.append("deterministic: " + ("yes" if served.solver.deterministic else "no"))
    lines.append("observers:     " + (", ".join(served.kinds) or "none"))
    lines.append("hosts terms:   " + (", ".join(served.hosts) or "none"))
    if served.measures:
        told = ", ".join(f"{output} shows {state}" for output, state in served.measures.items())
        lines.append(f"measures:      {told}")
    return "\n".join(lines)


def _rows(layout: Layout) -> List[str]:
    rows = []
    for q in layout.quantities:
        name = q.name if q.size == 1 else f"{q.name}[{q.size}]"
        notes = [q.role] if q.role else []
        if q.lo is not None or q.hi is not None:
            notes.append(
                f"{'-inf' if q.lo is None else f'{q.lo:g}'} to {'inf' if q.hi is None else f'{q.hi:g}'}"
            )
        if q.default is not None:
            notes.append(f"default {q.default:g}")
        if q.says:
            notes.append(q.says)
        rows.append((name, q.unit or "-", "; ".join(notes)))
    first = max((len(row[0]) for row in rows), default=0)
    second = max((len(row[1]) for row in rows), default=0)
    return [f"  {a:<{first}}  {b:<{second}}  {c}".rstrip() for a, b, c in rows]


def help_text(served: Served, file: str) -> str:
    """What to do with a solver that was started by hand."""
    script = os.path.basename(file) or "solver.py"
    priors = "\n".join(
        f'[[parameters]]\nname = "{q.name}"\nunit = "{q.unit}"\n'
        'prior = { transform = "log", median = 1.0, factor = 2.0 }   # your guess and its uncertainty\n'
        for q in served.parameters.quantities
    )
    return (
        f"`{served.name}` is a solver for Starlings, which starts it by itself. In a study file:\n\n"
        f'[model]\nkind = "solver"\ncommand = ["python3", "{script}"]\n\n{priors}\n'
        f"python3 {script} --describe   prints what the solver declares."
    )
