"""What is known of a parameter before the data: a Gaussian in transformed units, as in a study file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Union

from .failures import DeclarationError


@dataclass(frozen=True)
class Prior:
    """The prior of one parameter; its transform follows from what is given.

    - `Prior(30, factor=2)`: positive; one standard deviation is a factor of 2 (log).
    - `Prior(0.1, sd=0.05)`: any value; the standard deviation in the parameter's unit (linear).
    - `Prior(0.3, lo=0, hi=1, factor=3)`: between bounds; one standard deviation is a factor of 3 on the odds (logit).

    `per_record=True`: one value for each record. `process`: drift, `{"forgetting": 0.98}` or `{"walk": 0.01}`.
    """

    median: float
    factor: Optional[float] = None
    sd: Optional[float] = None
    lo: Optional[float] = None
    hi: Optional[float] = None
    unit: str = "1"
    per_record: Optional[bool] = None
    process: Optional[Mapping[str, float]] = None

    def table(self, name: str) -> Dict[str, Any]:
        """The entry of `[[parameters]]`."""
        bounded = self.lo is not None or self.hi is not None
        if bounded and (self.lo is None or self.hi is None):
            raise DeclarationError(f"the prior of `{name}` has one bound: give both `lo` and `hi`")
        if (self.factor is None) == (self.sd is None):
            raise DeclarationError(f"the prior of `{name}` needs either `factor` or `sd`")
        prior: Dict[str, Any] = {"median": float(self.median)}
        if bounded:
            prior.update(transform="logit", lo=float(self.lo or 0.0), hi=float(self.hi or 0.0))
        else:
            prior["transform"] = "linear" if self.factor is None else "log"
        if self.factor is not None:
            prior["factor"] = float(self.factor)
        if self.sd is not None:
            prior["sd"] = float(self.sd)
        entry: Dict[str, Any] = {"name": name, "unit": self.unit, "prior": prior}
        if self.per_record is not None:
            entry["per_record"] = self.per_record
        if self.process is not None:
            entry["process"] = dict(self.process)
        return entry


#: A prior, or the entry of `[[parameters]]` or its `prior` as a table.
Priors = Mapping[str, Union[Prior, Mapping[str, Any]]]


def entries(priors: Priors) -> "list[Dict[str, Any]]":
    """`[[parameters]]`, in the order given."""
    found = []
    for name, prior in priors.items():
        if isinstance(prior, Prior):
            found.append(prior.table(name))
        elif isinstance(prior, Mapping):
            entry = dict(prior) if "prior" in prior else {"unit": "1", "prior": dict(prior)}
            found.append({"name": name, **entry})
        else:
            raise DeclarationError(
                f"the prior of `{name}` is {prior!r}: write starlings.Prior({prior!r}, factor=2) for a positive value known "
                "within a factor of 2, or with sd= for one of either sign"
            )
    return found
