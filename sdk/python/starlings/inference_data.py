"""A run as ArviZ takes it.

Next files to read: posterior.py, linearised.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict

import numpy as np

from .linearised import linearised
from .posterior import gaussian, in_units

if TYPE_CHECKING:
    from .run_folder import Run


def of_run(run: "Run", draws: int, chains: int, seed: int, predictive: bool = False) -> Any:
    """An arviz.InferenceData with the groups `posterior`, `observed_data` and `constant_data` (the run with the estimate, the
    noise, and whether a value was fitted). Draws are independent: chains are there because ArviZ compares them.

    Every channel is one variable, `RECORD:OUTPUT`, over times of its own. With `predictive` there are `posterior_predictive` and
    `log_likelihood` too, [chain][draw][time], and these and `observed_data` hold the fitted values, over `RECORD:OUTPUT:fitted_time`.
    """
    import arviz

    each = -(-draws // chains)
    z = gaussian(run.mean, run.covariance, each * chains, seed)
    drawn = in_units(run.transforms, z).reshape(chains, each, -1)
    posterior = {name: drawn[:, :, k] for k, name in enumerate(run.names)}
    groups: Any = {"observed_data": {}, "constant_data": {}}
    coordinates: Dict[str, Any] = {}
    dimensions: Dict[str, Any] = {}
    for channel, times, values, predicted, noise, fitted in _channels(run.columns("predictions")):
        axis = f"{channel}:time"
        coordinates[axis] = times
        groups["observed_data"][channel] = values
        parts = {"predicted": predicted, "noise": noise, "fitted": fitted}
        groups["constant_data"].update({f"{channel}:{what}": part for what, part in parts.items()})
        dimensions.update({name: [axis] for name in [channel, *(f"{channel}:{what}" for what in parts)]})
    if predictive:
        groups.update({"observed_data": {}, "posterior_predictive": {}, "log_likelihood": {}})
        rng = np.random.default_rng([seed, 1])
        for channel, fit in linearised(run).items():
            mean = fit.predicted + (z - run.mean) @ fit.slopes.T
            shape = (chains, each, len(fit.time))
            axis = f"{channel}:fitted_time"
            coordinates[axis], dimensions[channel] = fit.time, [axis]
            off = (fit.observed - mean) / fit.noise
            likelihood = -0.5 * off**2 - np.log(fit.noise * np.sqrt(2.0 * np.pi))
            groups["observed_data"][channel] = fit.observed
            groups["posterior_predictive"][channel] = (mean + fit.noise * rng.standard_normal(mean.shape)).reshape(shape)
            groups["log_likelihood"][channel] = likelihood.reshape(shape)
    return arviz.from_dict(
        posterior=posterior,
        **groups,
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
