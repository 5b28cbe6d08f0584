"""The change of a state by one datum, for each kind of observer."""

import math

import numpy as np
import pytest

import starlings
from chain import DOFS, MASS, OBSERVED, STIFFNESS, TIMES, WRONG, Chain, N, run
from starlings import Observer


def one_correction(kind, gain, dt, observed, state=WRONG):
    """The change of the state by one datum after `dt`, of a chain that does not move."""

    class Still(Chain):
        def step(self, t, dt, x, p, u):
            return x

    before = np.array(state, dtype=float)
    after = starlings.simulate(
        Still,
        parameters={"stiffness": 2.0},
        times=[dt],
        state=before,
        observed=observed,
        observer=kind,
        gain=gain,
    ).state
    return after - before


def test_sdf_pulls_along_the_extension_of_least_energy():
    change = one_correction("sdf", 2.0, 0.3, {"seen": [[0.5, 0.1]]})
    pull = 1.0 - math.exp(-0.6)
    # Free masses between two held ones are on the line; the end beyond the last held one follows it; the wall stays.
    expected = pull * np.array([0.15, 0.3, 0.3 - 0.4 / 3, 0.3 - 0.8 / 3, -0.1, -0.1])
    assert np.allclose(change[:N], expected, rtol=0, atol=1e-15)
    assert np.array_equal(change[N:], np.zeros(N))
    # And no force on what is not observed.
    force = STIFFNESS @ change[:N]
    assert np.abs(np.delete(force, DOFS)).max() < 1e-14


def test_dvf_is_the_implicit_step_of_a_damping_force():
    change = one_correction("dvf", 2.0, 0.3, {"speed": [[0.5, 0.1]]})
    # Masses are lumped: each observed one by itself, (1 + 0.6) change = 0.6 (datum - 0).
    expected = np.zeros(N)
    expected[DOFS] = 0.6 / 1.6 * np.array([0.5, 0.1])
    assert np.allclose(change[N:], expected, rtol=0, atol=1e-16)
    assert np.array_equal(change[:N], np.zeros(N))


def test_a_missing_value_is_a_place_that_is_not_observed():
    nothing = one_correction("sdf", 2.0, 0.3, {"seen": [[np.nan, np.nan]]})
    assert np.array_equal(nothing, np.zeros(2 * N))
    one = one_correction("sdf", 2.0, 0.3, {"seen": [[0.5, np.nan]]})
    # Everything beyond the one observed mass follows it.
    pull = (1.0 - math.exp(-0.6)) * 0.3
    assert np.allclose(one[:N], pull * np.array([0.5, 1, 1, 1, 1, 1]), rtol=0, atol=1e-15)


def test_prescribed_degrees_of_freedom_stay_and_hold_the_extension():
    # Springs of stiffness one; the last of four nodes is prescribed.
    chain = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    extended = starlings.extension(chain, [0], fixed=[3])
    assert np.allclose(extended[:, 0], [1.0, 2.0 / 3.0, 1.0 / 3.0, 0.0], rtol=0, atol=1e-15)


def test_sparse_and_dense_matrices_correct_alike():
    sparse = pytest.importorskip("scipy.sparse")

    class Sparse(Chain):
        def __init__(self):
            self.observers = [
                Observer.sdf(sparse.csc_matrix(STIFFNESS), DOFS),
                Observer.dvf(sparse.coo_matrix(MASS), DOFS, solid_mass=sparse.csr_matrix(0.5 * MASS)),
            ]

    class Dense(Chain):
        def __init__(self):
            self.observers = [Observer.sdf(STIFFNESS, DOFS), Observer.dvf(MASS, DOFS, solid_mass=0.5 * MASS)]

    for kind in ("sdf", "dvf"):
        found = [
            starlings.simulate(
                solver,
                parameters={"stiffness": 1.0},
                times=TIMES,
                state=WRONG,
                observed=OBSERVED,
                observer=kind,
                gain=3.0,
            ).state
            for solver in (Sparse, Dense)
        ]
        # Two ways of elimination, thirty corrections: rounding.
        assert np.allclose(*found, rtol=0, atol=1e-13)


@starlings.solver(
    states={"x": "m"}, outputs={"first": "m", "second": "m"}, measures={"first": "x", "second": "x"}
)
class Twice:
    """A state that stays, measured twice."""

    def step(self, t, dt, x, p, u):
        return x


def test_nudging_pulls_by_one_minus_exp_of_gain_times_time():
    once = starlings.simulate(Twice, times=[0.3], observed={"first": [10.0]}, observer="nudging", gain=2.0)
    assert once.state[0] == pytest.approx(10.0 * (1.0 - math.exp(-0.6)), rel=1e-15)
    both = starlings.simulate(
        Twice, times=[0.3], observed={"first": [10.0], "second": [20.0]}, observer="nudging", gain=2.0
    )
    # Two channels pull twice as fast, towards their mean.
    assert both.state[0] == pytest.approx(15.0 * (1.0 - math.exp(-1.2)), rel=1e-15)
    assert both.outputs["first"].tolist() == [0.0]


def test_two_components_that_show_one_place_pull_it_to_their_mean():
    class Doubled(Chain):
        def __init__(self):
            self.observers = [Observer.sdf(STIFFNESS, observed_dofs=[1, 1])]

        def step(self, t, dt, x, p, u):
            return x

        def output(self, t, x, p, u):
            return {"seen": x[[1, 1]], "speed": x[N:][DOFS]}

    after = starlings.simulate(
        Doubled,
        parameters={"stiffness": 1.0},
        times=[0.3],
        state=np.zeros(2 * N),
        observed={"seen": [[0.1, 0.3]]},
        observer="sdf",
        gain=2.0,
    )
    assert after.state[1] == pytest.approx(0.2 * (1.0 - math.exp(-0.6)), rel=1e-15)


def test_gain_zero_keeps_even_the_sign_of_zero():
    kept = starlings.simulate(
        Twice, times=[0.3], state=[-0.0], observed={"first": [10.0]}, observer="nudging", gain=0.0
    )
    assert math.copysign(1.0, kept.state[0]) == -1.0


def test_any_gain_is_stable():
    huge = starlings.simulate(Twice, times=[0.3], observed={"first": [10.0]}, observer="nudging", gain=1e12)
    assert huge.state[0] == 10.0
    for kind in ("sdf", "dvf"):
        assert np.all(np.isfinite(run(kind, 1e12, observed=OBSERVED, state=WRONG).state))
