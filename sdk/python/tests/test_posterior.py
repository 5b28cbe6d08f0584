"""Draws from a posterior."""

import numpy as np
import pytest

from starlings.posterior import draw, physical


def test_transforms_are_those_of_a_study():
    z = np.array([-40.0, 0.0, 2.0])
    assert np.array_equal(physical("linear", z), z)
    assert np.allclose(physical("log", z), np.exp(z), rtol=1e-15)
    assert np.allclose(physical("log2", z), 2.0**z, rtol=1e-15)
    found = physical("logit(1.0, 3.0)", z)
    assert np.allclose(found, 1.0 + 2.0 / (1.0 + np.exp(-z)))
    assert np.all((found > 1.0) & (found < 3.0))
    with pytest.raises(ValueError, match="another version"):
        physical("sqrt", z)


def test_draws_have_the_mean_and_the_covariance_within_monte_carlo_error():
    mean, covariance = np.array([1.0, -2.0]), np.array([[0.04, 0.03], [0.03, 0.09]])
    n = 200_000
    drawn = draw(mean, covariance, ["linear", "linear"], n, 5)
    assert np.all(np.abs(drawn.mean(axis=0) - mean) < 5.0 * np.sqrt(np.diag(covariance) / n))
    assert np.allclose(np.cov(drawn.T), covariance, atol=5.0 * 0.09 * np.sqrt(2.0 / n))
    assert np.array_equal(drawn, draw(mean, covariance, ["linear", "linear"], n, 5))


def test_a_direction_without_spread_is_drawn_without():
    drawn = draw(np.zeros(2), np.ones((2, 2)), ["linear", "linear"], 100, 1)
    assert np.allclose(drawn[:, 0], drawn[:, 1], atol=1e-7)


def test_no_draws_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        draw(np.zeros(1), np.eye(1), ["linear"], 0, 1)
