"""A function, or a class of a solver, that a study was given in Python: kept in a file, and served from it.

`python -m starlings.pickled FILE` serves it: that is the command in the study. The function stands in the file whole, with
what it uses of notebooks, scripts and modules of its author; installed packages are imported where it runs.
"""

from __future__ import annotations

import inspect
import pickle
import sys
import sysconfig
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Sequence, Type

from .failures import DeclarationError
from .solver import Solver, solver
from .window import Window

#: Arguments that stand for the times of a run, and for the run itself.
TIMES = ("t", "time", "times")
WINDOW = "window"


def arguments(function: Callable[..., Any]) -> "tuple[List[str], List[str]]":
    """Names of the arguments of a function: those that it needs, and those with a default.

    Raises DeclarationError for a function that takes arguments without a name.
    """
    needed: List[str] = []
    optional: List[str] = []
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD, parameter.POSITIONAL_ONLY):
            raise DeclarationError(
                f"`{function.__name__}` takes `{parameter}`: name its arguments, each a parameter, an input or the times `t`"
            )
        (needed if parameter.default is parameter.empty else optional).append(parameter.name)
    return needed, optional


def of_function(
    function: Callable[..., Any],
    parameters: Mapping[str, str],
    inputs: Mapping[str, str],
    outputs: Mapping[str, str],
) -> Type[Solver]:
    """A solver of a function of times, parameters and inputs, by the names of its arguments.

    Times are [n_times]; parameters are numbers; inputs are [n_times], linear between their samples. It returns what `run` of
    a solver does: [n_times], [n_times][n_outputs], or a table of names.
    """
    needed, optional = arguments(function)
    wanted = [name for name in needed + optional if name in parameters or name in inputs or name in (*TIMES, WINDOW)]

    def run(window: Window) -> Any:
        given: Dict[str, Any] = {}
        for name in wanted:
            if name in parameters:
                given[name] = window.p[name]
            elif name in inputs:
                given[name] = _signal(window, name)
            else:
                given[name] = window if name == WINDOW else window.times
        return function(**given)

    run.__name__ = _plain(function.__name__)
    run.__doc__ = inspect.getdoc(function)
    return solver(parameters=dict(parameters), inputs=dict(inputs), outputs=dict(outputs))(run)


def _plain(name: str) -> str:
    return name if name.isidentifier() else "model"


def _signal(window: Window, name: str) -> Any:
    import numpy as np

    return np.array([window.inputs.at(t)[name] for t in window.times])


def pack(what: Any, **names: Mapping[str, str]) -> bytes:
    """A class of a solver, or a function with the names that `of_function` takes, as bytes that another process can serve.

    Raises DeclarationError where something in it cannot be carried.
    """
    import cloudpickle

    modules = _modules_of_its_author()
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        packed: bytes = cloudpickle.dumps({"path": _own_path(), "what": what, "names": names})
        return packed
    except Exception as error:
        name = getattr(what, "__name__", type(what).__name__).lower()
        raise DeclarationError(
            f"`{name}` cannot be carried to another process: {error}. Make what it needs (files, connections, locks) inside of it, "
            "or write it into a file of its own that ends in starlings.serve(...) and name that as the model: "
            '{"kind": "solver", "command": ["python3", "solver.py"]}'
        ) from error
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)


def _modules_of_its_author() -> List[Any]:
    """Imported modules that no package manager installed: another machine does not have them."""
    installed = [Path(sysconfig.get_path(kind)).resolve() for kind in ("stdlib", "platstdlib", "purelib", "platlib")]
    here = Path(__file__).resolve().parent
    found = []
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if not file or name == "__main__" or "." in name:
            continue
        path = Path(file).resolve()
        if here in path.parents or any(place in path.parents for place in installed) or "site-packages" in path.parts:
            continue
        if path.suffix == ".py":
            found.append(module)
    return found


def _own_path() -> List[str]:
    return [str(Path(entry).resolve()) for entry in sys.path if Path(entry or ".").is_dir()]


def unpack(packed: bytes) -> Any:
    """The solver that `pack` was given, or one of the function."""
    import cloudpickle  # noqa: F401  (what was packed needs it)

    held = pickle.loads(packed)
    sys.path.extend(entry for entry in held["path"] if entry not in sys.path)
    return of_function(held["what"], **held["names"]) if held["names"] else held["what"]


def main(argv: Sequence[str]) -> None:
    """Serves the solver in the file that is named first."""
    from .serve import serve

    file = Path(argv[1])
    # The rest of the arguments is the solver's own, as --describe.
    sys.argv = [str(file), *argv[2:]]
    serve(unpack(file.read_bytes()))


if __name__ == "__main__":
    main(sys.argv)
