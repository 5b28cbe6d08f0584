"""What a solver returns, taken by its shape: nothing is reshaped, so nothing can end in the wrong place.

A table of outputs is [n_times][n_outputs], or [n_times] of a single output; a state is [n_state]. An array of whole numbers is
refused: numpy cuts off the decimals of whatever is put into one. Next file to read: one_run.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, List, Tuple

import numpy as np

from .failures import Misfit
from .quantity import Layout
from .values import Array, short

Shape = Tuple[int, ...]


def vector(method: str, told: str, values: Any, layout: Layout) -> Array:
    """One value of every component of the layout, [size]: a flat array or list, a table of names, or, where there are fields,
    a list with one entry per quantity. `told` begins the message of the Misfit that is raised, such as "step returned the
    states"."""
    if isinstance(values, dict):
        _check_names(method, told, values, layout)
        parts = [
            _flat(method, f"{told} `{q.name}`", values[q.name], q.size, q.name) for q in layout.quantities
        ]
        return np.concatenate(parts) if parts else np.zeros(0)
    if layout.has_fields and isinstance(values, (list, tuple)) and len(values) == len(layout) != layout.size:
        pairs = zip(values, layout.quantities)
        return np.concatenate([_flat(method, f"{told} `{q.name}`", v, q.size, q.name) for v, q in pairs])
    return _flat(method, told, values, layout.size, layout.told)


def table(method: str, values: Any, layout: Layout, n_times: int) -> Array:
    """Outputs of a whole window as [n_times][all components]: one array, or a table of names with an array of each. Raises
    Misfit."""
    told = f"{method} returned the outputs at {n_times} times"
    if isinstance(values, dict):
        _check_names(method, told, values, layout)
        columns = []
        for q in layout.quantities:
            one = f"{method} returned `{q.name}` at {n_times} times"
            columns.append(_rows(method, one, values[q.name], n_times, q.size, q.name))
        return np.hstack(columns)
    if isinstance(values, tuple):
        raise Misfit(method, f"{told}: {_tuple(values, layout, n_times)}")
    return _rows(method, told, values, n_times, layout.size, layout.told())


def _check_names(method: str, told: str, given: Any, layout: Layout) -> None:
    if set(given) == set(layout.names()):
        return
    if "y" in given and "nfev" in given and "y" not in layout:
        raise Misfit(
            method,
            f"{told}: the whole answer of SciPy's solve_ivp, expected {layout.told()}; `return sol.y.T` for all of its variables, "
            "with `t_eval=window.times`",
        )
    got = ", ".join(map(str, given)) or "none"
    raise Misfit(method, f"{method}: expected the {layout.what} {layout.told()}, got {got}")


def _flat(method: str, told: str, values: Any, size: int, names: Any) -> Array:
    # The usual case of a step that is made a million times.
    if type(values) is np.ndarray and values.dtype == np.float64 and values.shape == (size,):
        return values
    found = _numbers(method, told, values)
    if found.shape == (size,) or (size == 1 and found.ndim == 0):
        return found.reshape(size)
    names = names() if callable(names) else names
    if found.ndim <= 1:
        raise Misfit(method, f"{told}: expected {size} numbers ({names}), got {found.size}")
    text = f"{told}: expected one row of {size} numbers ({names}), got an array of shape {found.shape}"
    if found.size == size and found.shape[0] == size:
        text += "; its entries are arrays of one number: take the `[0]` of each"
    elif found.size == size:
        text += "; `.ravel()` makes one row of it where that is the order"
    raise Misfit(method, text)


def _rows(method: str, told: str, values: Any, n_times: int, size: int, names: str) -> Array:
    found = _numbers(method, told, values)
    if found.shape == (n_times, size) or (size == 1 and found.shape == (n_times,)):
        return found.reshape(n_times, size)
    raise Misfit(method, f"{told}: {_misfit(found.shape, n_times, size, names)}")


def _misfit(shape: Shape, n_times: int, size: int, names: str) -> str:
    """What is wrong with a shape, and what to do."""
    expected = f"expected an array of shape ({n_times}, {size}), a row per time ({names})"
    if not shape:
        return f"expected {n_times} numbers ({names}), one per time, got a single number without a list around it"
    if size == 1 and len(shape) == 1:
        return f"expected {n_times} numbers ({names}), got {shape[0]}{_off_by_one(shape[0], n_times)}"
    if len(shape) == 2 and shape[1] == n_times and shape[0] != n_times:
        if shape[0] == size:
            return f"the array of shape {shape} is transposed, {expected}: return its `.T`, of SciPy's solve_ivp `return sol.y.T`"
        return (
            f"the array of shape {shape} is transposed and has {shape[0]} rows, {expected}: take the rows that are outputs and return "
            "their `.T`, of SciPy's solve_ivp such as `return sol.y[:1].T`"
        )
    got = f"{expected}, got shape {shape}"
    if len(shape) == 1 and shape[0] == size * n_times:
        return f"{got}; `.reshape({n_times}, {size})` where all outputs of the first time come first"
    if len(shape) == 1 and shape[0] == n_times:
        return f"{got}: one value per time is one output of {size}"
    if len(shape) == 2 and shape[1] == size:
        return f"{got}{_off_by_one(shape[0], n_times)}"
    if len(shape) == 2 and shape[0] == n_times:
        return f"{got}: {shape[1]} columns for {size} outputs"
    return got


def _off_by_one(got: int, n_times: int) -> str:
    if got != n_times + 1:
        return ""
    return "; one too many: outputs belong to `window.times`, and the start of the run is none of them"


def _tuple(values: Tuple[Any, ...], layout: Layout, n_times: int) -> str:
    names = layout.names()
    if len(values) == len(names) and all(q.size == 1 for q in layout.quantities):
        inside = ", ".join(names) + ("," if len(names) == 1 else "")
        remedy = f"`return numpy.column_stack(({inside}))`" if len(names) > 1 else "return the array alone"
    else:
        remedy = "return one array with a row per time"
    by_name = ", ".join(f'"{name}": ...' for name in names)
    return (
        f"a tuple of {len(values)} (`return a, b` makes one), expected an array of shape ({n_times}, {layout.size}), a row per time "
        f"({layout.told()}); {remedy}, or a table of names `return {{{by_name}}}`"
    )


def _numbers(method: str, told: str, values: Any) -> Array:
    """As 64-bit floats in their own shape."""
    wrong = _what_it_is(values)
    if wrong is None:
        try:
            found = np.asarray(values)
        except ValueError:
            wrong = f"rows of different lengths: {short(values)}"
        else:
            wrong = _of_kind(method, values, found)
            if wrong is None:
                floats: Array = found.astype(np.float64)
                return floats
    raise Misfit(method, f"{told}: {wrong}")


def _what_it_is(values: Any) -> Any:
    if values is None:
        return "nothing came: is a `return` missing?"
    if isinstance(values, Iterator):
        return f"a {type(values).__name__} is no array: `return numpy.array(list(...))`"
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        return "the array has masked values: a prediction is a number at every time"
    return None


def _of_kind(method: str, values: Any, found: Any) -> Any:
    """What is wrong with the kind of the values; None for numbers."""
    kind = found.dtype.kind
    if kind == "f":
        return None
    if kind in "iub":
        inner = values[0] if isinstance(values, (list, tuple)) and len(values) else None
        # A start is used as it is: nothing is put into it.
        if method != "initial" and (isinstance(values, np.ndarray) or isinstance(inner, np.ndarray)):
            return (
                f"an array of integers ({found.dtype}), which cuts off the decimals of what is put into it: make it of floats, such as "
                "`numpy.zeros(n)`, or `.astype(float)` where whole numbers are meant"
            )
        if kind != "b" and np.any(np.abs(found.astype(np.float64)) > 2.0**53):
            return f"{short(values)} has a whole number above 2**53, which no 64-bit float holds"
        return None
    if kind == "c":
        return "complex numbers: return what was measured, such as `.real` or `numpy.abs(...)`"
    if kind in "US":
        return f"text where numbers belong: {short(values)}"
    if kind == "O":
        return _of_objects(found)
    return f"values of the kind {found.dtype} where numbers belong"


def _of_objects(found: Any) -> str:
    flat: List[Any] = list(found.reshape(-1))
    if any(isinstance(value, (list, tuple, np.ndarray)) for value in flat):
        return f"rows of different lengths: {short(found.tolist())}"
    odd = next((v for v in flat if not isinstance(v, (int, float))), flat[0] if flat else None)
    return f"Python objects where numbers belong (the first is {short(odd)}): `float(...)` makes a number of one"
