"""Runs in this process: forms, inputs, terms, what is refused."""

import math

import numpy as np
import pytest

import starlings


class Oscillator(starlings.Solver):
    """x'' + c x' + k x = force, by `rate`."""

    parameters = [starlings.Quantity("k", "N/m"), starlings.Quantity("c", "N s/m", default=0.3)]
    states = {"x": "m", "v": "m/s"}
    outputs = {"position": "m", "force_felt": "N"}
    inputs = {"force": "N"}
    measures = {"position": "x"}
    dt = 0.001

    def initial(self, p):
        return {"v": 0.0, "x": 1.0}

    def rate(self, t, x, p, u):
        return [x[1], -p.k * x[0] - p.c * x[1] + u.force]

    def output(self, t, x, p, u):
        return {"position": x[0], "force_felt": u.force}


def exponential(matrix):
    """By scaling, Taylor's series and squaring."""
    squarings = max(0, math.ceil(math.log2(max(1e-300, np.abs(matrix).sum()))) + 5)
    small = matrix / 2.0**squarings
    total, term = np.eye(len(matrix)), np.eye(len(matrix))
    for n in range(1, 16):
        term = term @ small / n
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total


class Exact(starlings.Solver):
    """The same by `step`, with the exponential of the matrix of the system and its linear input."""

    parameters, states, outputs = Oscillator.parameters, Oscillator.states, Oscillator.outputs
    inputs, measures = Oscillator.inputs, Oscillator.measures
    initial, output = Oscillator.initial, Oscillator.output

    def step(self, t, dt, x, p, u):
        begin, end = u.at(t).force, u.at(t + dt).force
        whole = np.zeros((4, 4))
        whole[0, 1] = 1.0
        whole[1] = [-p.k, -p.c, 1.0, 0.0]
        whole[2, 3] = 1.0
        start = np.array([x[0], x[1], begin, (end - begin) / dt])
        return (exponential(whole * dt) @ start)[:2]


FORCE = {"force": ([0.0, 0.31237, 1.10719, 2.0], [0.0, 2.0, -1.0, 0.5])}
TIMES = np.linspace(0.0, 2.0, 21)


def test_rate_and_an_exact_step_agree():
    by_rate = starlings.simulate(Oscillator, parameters={"k": 9.0}, times=TIMES, inputs=FORCE)
    by_step = starlings.simulate(Exact, parameters={"k": 9.0}, times=TIMES, inputs=FORCE)
    # The fourth-order error with (omega dt)^4 = 8e-11 over two seconds; kinks of the force end steps, else it would be 1e-6.
    assert np.allclose(by_rate.outputs["position"], by_step.outputs["position"], rtol=0, atol=1e-10)
    assert np.array_equal(by_rate.outputs["force_felt"], np.interp(TIMES, *FORCE["force"]))


def test_a_default_stands_where_no_value_is_given():
    given = starlings.simulate(Oscillator, parameters={"k": 9.0, "c": 0.3}, times=TIMES, inputs=FORCE)
    left_out = starlings.simulate(Oscillator, parameters={"k": 9.0}, times=TIMES, inputs=FORCE)
    assert np.array_equal(given.state, left_out.state)


def test_an_estimated_initial_value_takes_the_place_of_the_solvers_own():
    run = starlings.simulate(Oscillator, parameters={"k": 9.0}, times=[0.0], inputs=FORCE, initial={"x": 0.25})
    assert run.outputs["position"].tolist() == [0.25]
    with pytest.raises(starlings.Failed, match="an initial value of `y`, which is no state"):
        starlings.simulate(Oscillator, parameters={"k": 9.0}, times=[0.0], inputs=FORCE, initial={"y": 1.0})


def test_a_term_is_added_to_the_rate_of_its_state():
    class Damped(Oscillator):
        def rate(self, t, x, p, u):
            rates = super().rate(t, x, p, u)
            return [rates[0], rates[1] - 0.7 * x[1] ** 3 + 0.1 * u.force]

    by_term = starlings.simulate(
        Oscillator,
        parameters={"k": 9.0},
        times=TIMES,
        inputs=FORCE,
        terms=[("v", "-a*v^3"), ("v", "0.1*force")],
        constants={"a": 0.7},
    )
    by_hand = starlings.simulate(Damped, parameters={"k": 9.0}, times=TIMES, inputs=FORCE)
    # The same sums in another order: rounding, over two thousand steps.
    assert np.allclose(by_term.state, by_hand.state, rtol=0, atol=1e-13)
    free = starlings.simulate(Oscillator, parameters={"k": 9.0}, times=TIMES, inputs=FORCE)
    assert abs(by_term.state[0] - free.state[0]) > 1e-3


def test_a_term_sees_delays_and_slopes_of_inputs():
    @starlings.solver(states={"x": ""}, outputs={"y": ""}, inputs={"u": ""}, measures={"y": "x"}, dt=0.1)
    class Integral:
        def rate(self, t, x, p, u):
            return [0.0]

    ramp = {"u": ([0.0, 1.0, 2.0], [0.0, 1.0, -1.0])}
    slope = starlings.simulate(Integral, times=[1.0, 2.0], inputs=ramp, terms=[("x", "ddt(u)")])
    # The integral of a slope is the signal itself, and slopes are constant on steps: rounding.
    assert np.allclose(slope.outputs["y"], [1.0, -1.0], rtol=0, atol=1e-14)
    late = starlings.simulate(Integral, times=[0.5, 1.0], inputs=ramp, terms=[("x", "delay(u, 0.5)")])
    # The integral of t - 0.5 from 0.5 to 1.
    assert np.allclose(late.outputs["y"], [0.0, 0.125], rtol=0, atol=1e-14)


def test_a_step_asks_for_the_terms_that_it_hosts():
    class Hosting(starlings.Solver):
        states = {"x": ""}
        outputs = {"y": ""}
        measures = {"y": "x"}
        hosts = ["x"]
        dt = 0.5

        def step(self, t, dt, x, p, u):
            return x + dt * self.window.terms("x", t, x)

    run = starlings.simulate(Hosting, times=[1.0], terms=[("x", "2 + 4*t")])
    # Two explicit steps: 0.5*2 + 0.5*4.
    assert run.state.tolist() == [3.0]
    assert starlings.simulate(Hosting, times=[1.0]).state.tolist() == [0.0]


def test_a_function_of_a_whole_window_is_a_solver():
    @starlings.solver(parameters={"a": "m"}, outputs=["y", starlings.Quantity("field", size=2)])
    def wave(window):
        phase = np.sin(window.times)
        return {"y": window.p.a * phase, "field": np.outer(phase, [1.0, 2.0])}

    run = starlings.simulate(wave, parameters={"a": 3.0}, times=[1.0, 2.0])
    assert np.array_equal(run.outputs["y"], 3.0 * np.sin([1.0, 2.0]))
    assert run.outputs["field"].shape == (2, 2)
    assert run.state.size == 0


def test_a_whole_window_with_states_starts_again_from_its_end():
    class Counter(starlings.Solver):
        states = {"n": ""}
        outputs = {"y": ""}

        def initial(self, p):
            return [10.0]

        def run(self, window):
            counted = window.state[0] + np.arange(1, window.times.size + 1)
            return counted, counted[-1:]

    first = starlings.simulate(Counter, times=[1.0, 2.0])
    second = starlings.simulate(Counter, times=[3.0], start=2.0, state=first.state)
    assert first.outputs["y"].tolist() == [11.0, 12.0]
    assert second.outputs["y"].tolist() == [13.0]


def test_values_come_by_name_and_in_order():
    seen = {}

    @starlings.solver(parameters={"k": "", "c": ""}, outputs={"y": ""}, inputs={"u": ""})
    def look(window):
        k, c = window.p
        seen.update(k=k, c=c, by_key=window.p["c"], by_place=window.p[0], n=len(window.p))
        with pytest.raises(AttributeError, match="no `q` among the parameters: k, c"):
            getattr(window.p, "q")  # noqa: B009
        seen["u"] = window.inputs.at(0.25).u
        return [0.0]

    starlings.simulate(
        look, parameters={"k": 1.0, "c": 2.0}, times=[1.0], inputs={"u": ([0.0, 1.0], [0.0, 4.0])}
    )
    assert seen == {"k": 1.0, "c": 2.0, "by_key": 2.0, "by_place": 1.0, "n": 2, "u": 1.0}


def test_a_rate_may_give_the_same_array_every_time():
    class Reusing(starlings.Solver):
        states = {"x": ""}
        outputs = {"y": ""}
        measures = {"y": "x"}
        dt = 0.1

        def __init__(self):
            self.kept = np.zeros(1)

        def initial(self, p):
            return [1.0]

        def rate(self, t, x, p, u):
            self.kept[:] = -x
            return self.kept

    # Ten fourth-order steps of 0.1: the error is below 1e-6; with one array for four stages it would be 1e-2.
    assert abs(starlings.simulate(Reusing, times=[1.0]).state[0] - math.exp(-1.0)) < 1e-6


@pytest.mark.parametrize(
    ("attributes", "words"),
    [
        ({"parameters": ["k", "k"]}, "parameters name `k` twice"),
        ({"parameters": "k"}, "parameters are a table of names and units or a list, not 'k'"),
        ({"parameters": 3}, "parameters are a table of names and units or a list, not 3"),
        ({"parameters": ["2k"]}, "'2k' cannot be a name"),
        ({"parameters": ["t"]}, "'t' cannot be a name"),
        ({"parameters": [starlings.Quantity("k", size=2)]}, "parameters are single numbers"),
        ({"parameters": {"k": 3}}, "the unit of `k` is 3"),
        ({"states": [starlings.Quantity("x", size=0)]}, "`x` has size 0"),
        ({"states": ()}, "declares no states"),
        ({"outputs": ()}, "declares no outputs"),
        ({"measures": {"y": "z"}}, "`measures` says `y` shows `z`"),
        ({"measures": {}}, "`measures` does not say which state is `y`"),
        ({"dt": -1.0}, "`dt` is -1.0"),
        ({"hosts": ["z"]}, "`z` is no scalar state"),
        ({"observers": ["sdf"]}, "the observer `sdf` is only a name"),
        ({"run": lambda self, window: None}, "defines `step` and `run`"),
        ({"step": starlings.Solver.step}, "defines none of them"),
    ],
)
def test_declarations_that_do_not_fit_are_refused(attributes, words):
    plain = {
        "states": {"x": ""},
        "outputs": {"y": ""},
        "measures": {"y": "x"},
        "step": lambda self, t, dt, x, p, u: x,
    }
    solver = type("Odd", (starlings.Solver,), {**plain, **attributes})
    with pytest.raises(starlings.DeclarationError, match=words):
        starlings.simulate(solver, times=[1.0])


def test_outputs_of_the_wrong_shape_are_told():
    @starlings.solver(outputs={"y": "", "z": ""})
    def short(window):
        return {"y": [1.0], "z": [1.0, 2.0]}

    with pytest.raises(starlings.Failed, match=r"`y` at 2 times: expected 2 numbers \(y\), got 1"):
        starlings.simulate(short, times=[1.0, 2.0])

    @starlings.solver(outputs={"y": "", "z": ""})
    def other(window):
        return {"y": [1.0], "w": [1.0]}

    with pytest.raises(starlings.Failed, match="expected the outputs y, z, got y, w"):
        starlings.simulate(other, times=[1.0])


def test_a_wrong_step_length_is_told_before_it_takes_for_ever():
    class Tiny(Oscillator):
        dt = 1e-12

    with pytest.raises(starlings.Failed, match="is `dt` in study time"):
        starlings.simulate(Tiny, parameters={"k": 1.0}, times=[1.0], inputs=FORCE)


def test_a_window_whose_signals_are_cut_gives_the_bits_of_the_whole():
    random = np.random.RandomState(3)
    samples = np.concatenate([[0.0], np.sort(random.uniform(0.0, 2.0, 200))])
    # So large that the state is mostly the force's doing, and a last digit of it is seen.
    values = 1000.0 * random.standard_normal(201)
    given = {"parameters": {"k": 9.0}}
    whole = starlings.simulate(Coarse, times=samples[1:], inputs={"force": (samples, values)}, **given)
    state, seen = None, []
    for i in range(200):
        near = {"force": (samples[i : i + 2], values[i : i + 2])}
        piece = starlings.simulate(
            Coarse, times=samples[i + 1 : i + 2], start=samples[i], state=state, inputs=near, **given
        )
        state = piece.state
        seen.append(piece.outputs["position"][0])
    assert np.array(seen).tobytes() == whole.outputs["position"].tobytes()


class Coarse(Oscillator):
    """In steps between which many samples lie."""

    dt = 0.05
