"""What every peer runs: the same tasks, of the same sizes, as the fleet's own in coordinator/fleet/benches/peers.rs."""

import time

#: Values of a state of 8 MB.
VALUES = 1_000_000


def spin(seconds: float) -> float:
    """Computes for so many seconds of wall time."""
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        pass
    return seconds


def still(state):
    """A run that ends where it starts."""
    return state
