"""`study`: a study of a function and arrays, without a file written by hand.

Next file to read: pickled.py, for how the function reaches the workers.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from .failures import DeclarationError
from .pickled import TIMES, WINDOW, arguments, pack
from .plain import plain
from .prior import Prior, Priors, entries
from .quantity import is_name
from .recording import Recording, by_name, take
from .solver import Served, Solver
from .study_file import Study

#: File in which a function or a class travels.
PACKED = "model.pkl"

#: What names a component of a field in a column of a model that has one.
_FIELD = re.compile(r"\[\d+\]$")

#: Standard deviation of a measurement: one for all, or by column; "auto" is found from the data.
Noise = Union[float, str, Mapping[str, Union[float, str]]]


def study(
    model: Union[Callable[..., Any], type, str, Mapping[str, Any]],
    data: Any,
    priors: Priors,
    *,
    noise: Noise = "auto",
    name: Optional[str] = None,
    says: str = "",
    seed: int = 1,
    time: Optional[str] = None,
    time_unit: str = "s",
    train: Optional[Tuple[float, float]] = None,
    held_out: Sequence[str] = (),
    inputs: Optional[Mapping[str, str]] = None,
    outputs: Optional[Mapping[str, str]] = None,
    units: Optional[Mapping[str, str]] = None,
    **sections: Any,
) -> Study:
    """A study of a model, recordings and priors.

    `model`: a function; a class of `starlings.solver`; the kind of a built-in model; or the table `[model]` of a study file. A
    function takes by name the times `t`, [n_times], parameters as numbers and inputs, [n_times], and returns the outputs at those
    times: [n_times], [n_times][n_outputs] in the order of the columns, or a table of names.

    `data`: a pandas.DataFrame or a table of names with an array each; or several, in a list or by name. Dates become seconds.
    A gap is NaN. `time` names the column of the time where it is not "time", "t" or the index.

    `priors`: `starlings.Prior` by parameter. `noise`: standard deviation of the measurements, for all or by column; "auto"
    estimates it. `train`: the span that is fitted, of every record; the rest, and records in `held_out`, are predicted only.

    `inputs` and `outputs`: name in the model to column, where they differ; without them an input is a column that has the
    name of an input of the model (of a function: of an argument), and every other column is an output. `units`: labels by
    output or input. `sections`: further sections of a study file, as `estimator={"points": "star"}`.
    """
    recordings = {key: take(table, key, time) for key, table in by_name(data).items()}
    if not recordings:
        raise DeclarationError("no recordings: give at least one in `data`")
    columns = next(iter(recordings.values())).measured
    ins, outs = _columns_of(model, columns, priors, inputs, outputs)
    _check_noise(noise, outs)
    labels = dict(units or {})
    table, files = _model(model, priors, {key: labels.get(key, "1") for key in ins}, {key: labels.get(key, "1") for key in outs})
    made: Dict[str, Any] = {
        "study": {"name": name or _name_of(model), "says": says, "seed": seed, "time_unit": time_unit},
        "model": table,
        "parameters": entries(priors),
        "records": [],
    }
    for key, recording in recordings.items():
        record = _record(key, recording, ins, outs, noise)
        if train is not None:
            record["train"] = [float(edge) for edge in train]
        if key in held_out:
            record["use"] = "held-out"
        made["records"].append(record)
        files[f"{key}.csv"] = recording.csv().encode()
    unknown = [key for key in held_out if key not in recordings]
    if unknown:
        raise DeclarationError(f"`held_out` names `{unknown[0]}`; there are {', '.join(recordings)}")
    return Study(plain(made), None, files).changed(**sections)


def _columns_of(
    model: Any,
    columns: Sequence[str],
    priors: Priors,
    inputs: Optional[Mapping[str, str]],
    outputs: Optional[Mapping[str, str]],
) -> Tuple[Dict[str, str], Dict[str, str]]:
    """Columns by input and by output of the model."""
    known = _known(model)
    if inputs is None:
        takes = known[0] if known else _arguments_of(model)
        inputs = {key: key for key in takes if key in columns and key not in priors}
    if outputs is None:
        outputs = {key: key for key in columns if key not in inputs.values() and (known is None or key in known[1])}
    for of, named in (("inputs", inputs), ("outputs", outputs)):
        absent = [column for column in named.values() if column not in columns]
        if absent:
            raise DeclarationError(f"`{of}` names the column `{absent[0]}`; there are {', '.join(columns)}")
    if not outputs:
        raise DeclarationError(
            f"no column is an output of the model: columns are {', '.join(columns)}"
            + (f", outputs are {', '.join(known[1])}" if known else "")
            + "; say which is which with outputs={output: column}"
        )
    _check_names(outputs, _is_function(model))
    if _is_function(model):
        _check_arguments(model, priors, inputs)
    return dict(inputs), dict(outputs)


def _known(model: Any) -> Optional[Tuple[List[str], List[str]]]:
    """Inputs and outputs of a model that declares them."""
    if inspect.isclass(model) and issubclass(model, Solver):
        served = Served(model)
        return served.inputs.names(), served.outputs.names()
    if isinstance(model, Mapping) and "outputs" in model:
        return [entry["name"] for entry in model.get("inputs", [])], [entry["name"] for entry in model["outputs"]]
    return None


def _arguments_of(model: Any) -> List[str]:
    if not _is_function(model):
        return []
    needed, optional = arguments(model)
    return needed + optional


def _is_function(model: Any) -> bool:
    return callable(model) and not inspect.isclass(model)


def _check_arguments(function: Callable[..., Any], priors: Priors, inputs: Mapping[str, str]) -> None:
    needed, optional = arguments(function)
    meant = {*priors, *inputs, *TIMES, WINDOW}
    stray = [name for name in needed if name not in meant]
    if stray:
        raise DeclarationError(
            f"`{function.__name__}` takes `{stray[0]}`, which is no parameter with a prior ({', '.join(priors)}), no column of the "
            f"data and none of {', '.join(TIMES)}: give it a prior, or a default"
        )
    takes_all = WINDOW in needed
    unused = [name for name in priors if name not in needed + optional and not takes_all and ":" not in name]
    if unused:
        raise DeclarationError(f"`{function.__name__}` takes no `{unused[0]}`, which has a prior: nothing would depend on it")


def _model(
    model: Any, priors: Priors, inputs: Mapping[str, str], outputs: Mapping[str, str]
) -> Tuple[Dict[str, Any], Dict[str, bytes]]:
    """The table `[model]`, and the files that it needs."""
    if isinstance(model, str):
        return {"kind": model}, {}
    if isinstance(model, Mapping):
        return dict(model), {}
    if _is_function(model):
        labels = {entry["name"]: entry["unit"] for entry in entries(priors)}
        packed = pack(model, parameters=labels, inputs=inputs, outputs=outputs)
    elif inspect.isclass(model) and issubclass(model, Solver):
        packed = pack(model)
    else:
        raise DeclarationError(
            f"the model is {model!r}: give a function, a class of starlings.solver, the kind of a built-in model or the table [model]"
        )
    command = [sys.executable or "python3", "-m", "starlings.pickled", PACKED]
    table: Dict[str, Any] = {"kind": "solver", "command": command}
    here = Path(__file__).resolve().parent.parent
    if "site-packages" not in here.parts and "dist-packages" not in here.parts:
        # Used from where it is written, not installed: a new process would not find it.
        table["environment"] = {"PYTHONPATH": str(here)}
    return table, {PACKED: packed}


def _name_of(model: Any) -> str:
    name = model if isinstance(model, str) else getattr(model, "__name__", "study")
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in name).strip("-").lower() or "study"


def _record(
    key: str, recording: Recording, inputs: Mapping[str, str], outputs: Mapping[str, str], noise: Noise
) -> Dict[str, Any]:
    missing = [column for column in [*inputs.values(), *outputs.values()] if column not in recording.columns]
    if missing:
        raise DeclarationError(f"record `{key}` has no column `{missing[0]}`, which the first record has")
    if os.sep in key or "/" in key:
        raise DeclarationError(f"the name `{key}` of a record holds a slash: it names a file")
    channels = [
        {"column": column, "output": output, "noise": _noise_of(noise, output, column)} for output, column in outputs.items()
    ]
    record: Dict[str, Any] = {"name": key, "file": f"{key}.csv", "time": recording.time, "channels": channels}
    if inputs:
        record["inputs"] = dict(inputs)
    return record


def _check_noise(noise: Noise, outputs: Mapping[str, str]) -> None:
    if not isinstance(noise, Mapping):
        return
    known = dict.fromkeys([*outputs, *outputs.values()])
    stray = [name for name in noise if name not in known]
    if stray:
        raise DeclarationError(f"`noise` names `{stray[0]}`, which is no column that is measured; there are {', '.join(known)}")


def _check_names(outputs: Mapping[str, str], of_function: bool) -> None:
    """Refuses names that no output can have: of a function whole ones, of other models those of components of fields too."""
    odd = [key for key in outputs if not is_name(key if of_function else _FIELD.sub("", key))]
    if not odd:
        return
    rest = "".join(f', "{key}": "{column}"' for key, column in outputs.items() if key not in odd)
    raise DeclarationError(
        f"`{odd[0]}` cannot be the name of an output, which is a word of letters, digits and `_`: say which output the column is with "
        f'outputs={{"{_word(odd[0])}": "{outputs[odd[0]]}"{rest}}}, without the columns that are none'
    )


def _word(column: str) -> str:
    """A name like a column's: "Temp [°C]" is called temp."""
    words = re.findall(r"[a-z]\w*", column.lower(), re.ASCII)
    return words[0] if words and is_name(words[0]) else "y"


def _noise_of(noise: Noise, output: str, column: str) -> Union[float, str]:
    if isinstance(noise, Mapping):
        found = noise.get(output, noise.get(column, "auto"))
    else:
        found = noise
    return found if isinstance(found, str) else float(found)


__all__ = ["Prior", "study"]
