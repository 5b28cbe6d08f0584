"""Draws from a posterior that is Gaussian in transformed units, [n_param]."""

from __future__ import annotations

import re
from typing import Callable, Dict, Sequence

import numpy as np

from .values import Array

_LOGIT = re.compile(r"logit\((?P<lo>[^,]+),(?P<hi>[^)]+)\)")

_PLAIN: Dict[str, Callable[[Array], Array]] = {
    "linear": lambda z: z,
    "log": lambda z: np.exp(z),
    "log2": lambda z: np.exp2(z),
}


def physical(transform: str, z: Array) -> Array:
    """Values in a parameter's unit of transformed ones. Raises ValueError for a transform that is none."""
    plain = _PLAIN.get(transform)
    if plain is not None:
        return plain(z)
    bounds = _LOGIT.fullmatch(transform)
    if bounds is None:
        raise ValueError(f"unknown transform {transform!r}: the run folder was written by another version")
    lo, hi = float(bounds["lo"]), float(bounds["hi"])
    share = 0.5 * (1.0 + np.tanh(0.5 * z))
    within: Array = np.clip(lo + (hi - lo) * share, np.nextafter(lo, hi), np.nextafter(hi, lo))
    return within


def gaussian(mean: Array, covariance: Array, n: int, seed: int) -> Array:
    """`n` draws of the transformed parameters, [n][n_param]. A covariance without full rank is drawn in the directions that it has."""
    if n < 1:
        raise ValueError(f"{n} draws: at least one is needed")
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    z: Array = mean + np.random.default_rng(seed).standard_normal((n, len(mean))) @ root.T
    return z


def in_units(transforms: Sequence[str], z: Array) -> Array:
    """Draws of transformed parameters in the parameters' units, [n][n_param]."""
    return np.column_stack([physical(transform, z[:, k]) for k, transform in enumerate(transforms)])


def draw(mean: Array, covariance: Array, transforms: Sequence[str], n: int, seed: int) -> Array:
    """`n` draws in the parameters' units, [n][n_param]."""
    return in_units(transforms, gaussian(mean, covariance, n, seed))
