"""Observers: predict, record, then correct."""

import math

import numpy as np
import pytest

import starlings
from starlings import Observer, Quantity

N = 6
#: A chain of masses: springs between neighbours and to a wall on the left, the last one free.
STIFFNESS = 40.0 * (2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
STIFFNESS[-1, -1] = 40.0
MASS = np.diag(np.linspace(1.0, 2.0, N))
DOFS = [1, 4]


class Chain(starlings.Solver):
    """Masses on springs by the implicit midpoint rule; two of them are observed."""

    parameters = {"stiffness": ""}
    states = [
        Quantity("d", "m", size=N, role="displacement"),
        Quantity("v", "m/s", size=N, role="velocity"),
    ]
    outputs = [
        Quantity("seen", "m", size=2, role="displacement"),
        Quantity("speed", "m/s", size=2, role="velocity"),
    ]
    dt = 0.02

    def __init__(self):
        self.observers = [
            Observer.sdf(lambda p: p.stiffness * STIFFNESS, observed_dofs=DOFS),
            Observer.dvf(MASS, observed_dofs=DOFS),
        ]

    def initial(self, p):
        return {"d": np.linspace(0.1, 0.6, N), "v": np.zeros(N)}

    def step(self, t, dt, x, p, u):
        d, v = x[:N], x[N:]
        k = p.stiffness * STIFFNESS
        middle = np.linalg.solve(MASS + dt**2 / 4 * k, MASS @ v - dt / 2 * k @ d)
        return np.concatenate([d + dt * middle, 2 * middle - v])

    def output(self, t, x, p, u):
        return {"seen": x[DOFS], "speed": x[N:][DOFS]}


TIMES = np.linspace(0.1, 3.0, 30)


def run(observer="none", gain=0.0, **more):
    chosen = dict(parameters={"stiffness": 1.0}, times=TIMES, observer=observer, gain=gain)
    chosen.update(more)
    return starlings.simulate(Chain, **chosen)


TRUTH = run()
OBSERVED = {"seen": TRUTH.outputs["seen"], "speed": TRUTH.outputs["speed"]}
WRONG = np.concatenate([np.full(N, 0.2), np.zeros(N)])


@pytest.mark.parametrize("kind", ["sdf", "dvf"])
def test_gain_zero_is_no_observer_to_the_last_bit(kind):
    with_gain = run(kind, 0.0, observed=OBSERVED, state=WRONG)
    without = run(state=WRONG)
    assert with_gain.state.tobytes() == without.state.tobytes()
    for name in OBSERVED:
        assert with_gain.outputs[name].tobytes() == without.outputs[name].tobytes()


@pytest.mark.parametrize("kind", ["sdf", "dvf"])
def test_on_noise_free_data_of_the_truth_nothing_moves(kind):
    observed = run(kind, 5.0, observed=OBSERVED)
    assert observed.state.tobytes() == TRUTH.state.tobytes()


@pytest.mark.parametrize("kind", ["sdf", "dvf"])
def test_a_prediction_is_recorded_before_its_datum_corrects_it(kind):
    free, observed = run(state=WRONG), run(kind, 5.0, observed=OBSERVED, state=WRONG)
    for name in OBSERVED:
        assert observed.outputs[name][0].tobytes() == free.outputs[name][0].tobytes()
        assert np.abs(observed.outputs[name][1] - free.outputs[name][1]).max() > 1e-4


@pytest.mark.parametrize("kind", ["sdf", "dvf"])
def test_with_everything_observed_an_error_decays_with_half_the_gain(kind):
    class Seen(Chain):
        outputs = [
            Quantity("seen", "m", size=N, role="displacement"),
            Quantity("speed", "m/s", size=N, role="velocity"),
        ]

        def __init__(self):
            self.observers = [Observer.sdf(STIFFNESS), Observer.dvf(MASS)]

        def output(self, t, x, p, u):
            return {"seen": x[:N], "speed": x[N:]}

    def left(gain):
        times = np.linspace(0.01, 6.0, 600)
        still = {"seen": np.zeros((600, N)), "speed": np.zeros((600, N))}
        x = starlings.simulate(
            Seen,
            parameters={"stiffness": 1.0},
            times=times,
            state=WRONG,
            observed=still,
            observer=kind,
            gain=gain,
        ).state
        return x[:N] @ STIFFNESS @ x[:N] + x[N:] @ MASS @ x[N:]

    # Half of the energy is of the corrected kind on average, so that energy decays with exp(-gain t). What is left of the
    # average over periods of up to 2.4 s is below gain/frequency = 0.4/2.6, and the step adds gain dt = 0.004.
    assert left(0.4) / left(0.0) == pytest.approx(math.exp(-0.4 * 6.0), rel=0.16)


def test_a_window_that_is_cut_gives_the_run_of_the_whole():
    whole = run("sdf", 3.0, observed=OBSERVED, state=WRONG)
    state, start, seen = WRONG, 0.0, []
    for part in (slice(0, 7), slice(7, 8), slice(8, 30)):
        observed = {name: values[part] for name, values in OBSERVED.items()}
        piece = run("sdf", 3.0, observed=observed, state=state, start=start, times=TIMES[part])
        seen.append(piece.outputs["seen"])
        state, start = piece.state, TIMES[part][-1]
    assert np.concatenate(seen).tobytes() == whole.outputs["seen"].tobytes()
    assert state.tobytes() == whole.state.tobytes()


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


def test_a_loop_of_its_own_can_correct_by_the_same_observer():
    class Own(starlings.Solver):
        parameters, states, outputs = Chain.parameters, Chain.states, Chain.outputs
        initial = Chain.initial

        def __init__(self):
            self.observers = [Observer.sdf(STIFFNESS, DOFS)]
            self.chain = Chain()

        def run(self, window):
            x, previous, rows = window.state, window.start, []
            for i, time in enumerate(window.times):
                for t, h in window.steps(previous, time, Chain.dt):
                    x = self.chain.step(t, h, x, window.p, None)
                y = self.chain.output(time, x, window.p, None)
                rows.append(np.concatenate([y["seen"], y["speed"]]))
                x = window.correct(i, x, y)
                previous = time
            return np.array(rows), x

    own = starlings.simulate(
        Own,
        parameters={"stiffness": 1.0},
        times=TIMES,
        state=WRONG,
        observed=OBSERVED,
        observer="sdf",
        gain=3.0,
    )
    hosted = run("sdf", 3.0, observed=OBSERVED, state=WRONG)
    assert own.state.tobytes() == hosted.state.tobytes()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Observer.sdf(STIFFNESS, [1]), "2 components, and 1 observed degrees of freedom"),
        (lambda: Observer.sdf(STIFFNESS, [1, 6]), "degrees of freedom 0 to 5, and 6 is named"),
        (
            lambda: Observer.sdf(STIFFNESS, DOFS, output="wall"),
            "no `wall` among the outputs: seen\\[2\\], speed\\[2\\]",
        ),
        (lambda: Observer.nudging(), "needs `measures`"),
    ],
)
def test_an_observer_that_finds_no_place_is_refused(make, words):
    class Odd(Chain):
        def __init__(self):
            self.observers = [make()]

    with pytest.raises(starlings.DeclarationError, match=words):
        starlings.simulate(Odd, parameters={"stiffness": 1.0}, times=[1.0])


def test_a_matrix_of_another_size_is_told():
    class Odd(Chain):
        def __init__(self):
            self.observers = [Observer.sdf(np.eye(3), DOFS)]

    with pytest.raises(starlings.Failed, match="stiffness is 3 × 3; the state makes it 6 × 6"):
        starlings.simulate(
            Odd,
            parameters={"stiffness": 1.0},
            times=[1.0],
            state=WRONG,
            observed={"seen": [[1.0, 1.0]]},
            observer="sdf",
            gain=1.0,
        )
