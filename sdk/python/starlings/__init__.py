"""Write a solver for Starlings in Python.

    import starlings

    @starlings.solver(parameters={"k": "N/m"}, states={"x": "m", "v": "m/s"}, outputs={"position": "m"},
                      measures={"position": "x"}, dt=0.01)
    class Spring:
        def rate(self, t, x, p, u):
            return [x[1], -p.k * x[0]]

    starlings.serve(Spring)

A solver says what it has and does one thing: `rate`, `step` or `run` (`Solver`). `serve` is the last line of its file,
`simulate` tries it without a study, `Observer` gives it a correction towards data, `read_run` reads results.
"""

from .expression import Expression, ExpressionError
from .failures import DeclarationError, Failed, NotFinite, OutsideDomain, Unavailable
from .matrices import extension
from .observers import Correction, Observer
from .quantity import Quantity
from .run_folder import Run, read_run
from .serve import serve
from .simulate import Simulated, simulate
from .solver import Solver, solver
from .values import Inputs, Signal, StepInputs, Values
from .window import Window

__all__ = [
    "Correction",
    "DeclarationError",
    "Expression",
    "ExpressionError",
    "Failed",
    "Inputs",
    "NotFinite",
    "Observer",
    "OutsideDomain",
    "Quantity",
    "Run",
    "Signal",
    "Simulated",
    "Solver",
    "StepInputs",
    "Unavailable",
    "Values",
    "Window",
    "extension",
    "read_run",
    "serve",
    "simulate",
    "solver",
]

__version__ = "0.1.0"
