"""Observers hosted by a solver: predict, record, then correct."""

import math

import numpy as np
import pytest

import starlings
from chain import DOFS, MASS, OBSERVED, STIFFNESS, TIMES, TRUTH, WRONG, Chain, N, run
from starlings import Observer, Quantity


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
