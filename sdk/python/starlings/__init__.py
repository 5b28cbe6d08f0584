"""Estimate what a simulation does not know, and say what it is missing, from Python.

    import starlings

    def cooling(t, start, rate):
        return start * np.exp(-rate * t)

    study = starlings.study(cooling, frame, {"start": starlings.Prior(80, factor=2), "rate": starlings.Prior(0.1, factor=3)})
    starlings.run(study)

`run`, `check`, `explain`, `identify`, `infer`, `diagnose` and `simulate` take a study: a `Study`, the path of a study file, or
its sections as tables. A solver with a state of its own, or one that a study file names, is written so:

    @starlings.solver(parameters={"k": "N/m"}, states={"x": "m", "v": "m/s"}, outputs={"position": "m"},
                      measures={"position": "x"}, dt=0.01)
    class Spring:
        def rate(self, t, x, p, u):
            return [x[1], -p.k * x[0]]

    starlings.serve(Spring)

A solver says what it has and does one thing: `rate`, `step` or `run` (`Solver`). `serve` is the last line of its file,
`simulate` tries it without a study too, `Observer` gives it a correction towards data. `read_run` reads results.
"""

from .answers import Checked, Diagnosis, Explanation, Identification, Inference
from .build import study
from .commands import check, diagnose, explain, identify, infer, run, twin
from .expression import Expression, ExpressionError
from .failures import DeclarationError, Failed, NotFinite, OutsideDomain, Unavailable
from .forecasts import Forecast
from .matrices import extension
from .observers import Correction, Observer
from .prior import Prior
from .program import RunError, StudyError
from .quantity import Quantity
from .read import read
from .recording import RecordingError
from .run_folder import Run, read_run
from .serve import serve
from .simulate import Simulated, simulate
from .solver import Solver, solver
from .study_file import Study
from .values import Inputs, Signal, StepInputs, Values
from .window import Window

__all__ = [
    "Checked",
    "Correction",
    "DeclarationError",
    "Diagnosis",
    "Explanation",
    "Expression",
    "ExpressionError",
    "Failed",
    "Forecast",
    "Identification",
    "Inference",
    "Inputs",
    "NotFinite",
    "Observer",
    "OutsideDomain",
    "Prior",
    "Quantity",
    "RecordingError",
    "Run",
    "RunError",
    "Signal",
    "Simulated",
    "Solver",
    "StepInputs",
    "Study",
    "StudyError",
    "Unavailable",
    "Values",
    "Window",
    "check",
    "diagnose",
    "explain",
    "extension",
    "identify",
    "infer",
    "read",
    "read_run",
    "run",
    "serve",
    "simulate",
    "solver",
    "study",
    "twin",
]

__version__ = "0.1.0"
