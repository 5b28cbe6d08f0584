"""A run as ArviZ takes it.

Next file to read: posterior.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict

import numpy as np

from .posterior import draw

if TYPE_CHECKING:
    from .run_folder import Run


def of_run(run: "Run", draws: int, chains: int, seed: int) -> Any:
    """An arviz.InferenceData with the groups `posterior`, `observed_data` and `constant_data` (the run with the estimate, the
    noise, and whether a value was fitted). Draws are independent: chains are there because ArviZ compares them.

    Every channel is one variable, `RECORD:OUTPUT`, over times of its own.
    """
    import arviz

    each = -(-draws // chains)
    drawn = draw(run.mean, run.covariance, run.transforms, each * chains, seed).reshape(chains, each, -1)
    posterior = {name: drawn[:, :, k] for k, name in enumerate(run.names)}
    rows = run.columns("predictions")
    observed: Dict[str, Any] = {}
    constant: Dict[str, Any] = {}
    coordinates: Dict[str, Any] = {}
    dimensions: Dict[str, Any] = {}
    for channel, times, values, predicted, noise, fitted in _channels(rows):
        axis = f"{channel}:time"
        coordinates[axis] = times
        observed[channel] = values
        parts = {"predicted": predicted, "noise": noise, "fitted": fitted}
        constant.update({f"{channel}:{what}": part for what, part in parts.items()})
        dimensions.update({name: [axis] for name in [channel, *(f"{channel}:{what}" for what in parts)]})
    return arviz.from_dict(
        posterior=posterior,
        observed_data=observed,
        constant_data=constant,
        coords=coordinates,
        dims=dimensions,
        attrs={"study": str(run.summary.get("study", "")), "conditional_on": str(run.summary.get("conditional_on", ""))},
    )


def _channels(rows: Dict[str, Any]) -> Any:
    names = list(dict.fromkeys(zip(rows["record"], rows["output"])))
    for record, output in names:
        here = (rows["record"] == record) & (rows["output"] == output)
        part = {key: values[here] for key, values in rows.items()}
        yield (
            f"{record}:{output}",
            part["time"],
            part["observed"],
            part["predicted"],
            part["noise"],
            np.array([use == "train" for use in part["use"]]),
        )
