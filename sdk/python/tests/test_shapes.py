"""What a solver may return: by its shape, never reshaped; what else is refused, in which words, and where it points."""

import traceback

import numpy as np
import pytest

import starlings

TIMES = [1.0, 2.0, 3.0, 4.0]


def returning(value, outputs=("X", "S", "P")):
    """A solver of whole windows that returns this."""

    @starlings.solver(outputs={name: "" for name in outputs})
    def culture(window):
        return value

    return culture


def refused(solver, **given):
    with pytest.raises(starlings.Failed) as caught:
        starlings.simulate(solver, times=TIMES, **given)
    return caught.value.text


X, S, P = (np.array(TIMES) + shift for shift in (0.0, 10.0, 20.0))
TABLE = np.column_stack((X, S, P))


@pytest.mark.parametrize(
    "value",
    [
        TABLE,
        TABLE.tolist(),
        list(TABLE),
        np.asfortranarray(TABLE),
        TABLE.astype(np.float32),
        TABLE.astype(int).tolist(),
        {"S": S, "X": X, "P": P},
        {"P": P.tolist(), "X": X.reshape(-1, 1), "S": S.astype(int).tolist()},
    ],
)
def test_a_row_per_time_or_a_table_of_names_is_taken_as_it_is(value):
    run = starlings.simulate(returning(value), times=TIMES)
    assert [run.outputs[name].tolist() for name in "XSP"] == [X.tolist(), S.tolist(), P.tolist()]


@pytest.mark.parametrize("value", [X, X.tolist(), X.reshape(4, 1), {"X": X}, [True, 2, 3.0, np.int64(4)]])
def test_a_single_output_may_be_one_dimensional(value):
    run = starlings.simulate(returning(value, ["X"]), times=TIMES)
    assert run.outputs["X"].tolist() == [float(v) for v in (value["X"] if isinstance(value, dict) else np.ravel(value))]


EXPECTED = "expected an array of shape (4, 3), a row per time (X, S, P)"
AT = "run returned the outputs at 4 times: "


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (TABLE.T, f"the array of shape (3, 4) is transposed, {EXPECTED}: return its `.T`, of SciPy's solve_ivp `return sol.y.T`"),
        ([X, S, P], f"the array of shape (3, 4) is transposed, {EXPECTED}: return its `.T`"),
        (
            (X, S, P),
            "a tuple of 3 (`return a, b` makes one), expected an array of shape (4, 3), a row per time (X, S, P); "
            "`return numpy.column_stack((X, S, P))`, or a table of names `return {\"X\": ..., \"S\": ..., \"P\": ...}`",
        ),
        (np.zeros((5, 4)), "the array of shape (5, 4) is transposed and has 5 rows"),
        (TABLE.ravel(), f"{EXPECTED}, got shape (12,); `.reshape(4, 3)` where all outputs of the first time come first"),
        (TABLE[:3], f"{EXPECTED}, got shape (3, 3)"),
        (np.vstack((TABLE, TABLE[:1])), "got shape (5, 3); one too many: outputs belong to `window.times`"),
        (TABLE[:, :2], f"{EXPECTED}, got shape (4, 2): 2 columns for 3 outputs"),
        (X, f"{EXPECTED}, got shape (4,): one value per time is one output of 3"),
        (TABLE[None], f"{EXPECTED}, got shape (1, 4, 3)"),
        (3.0, "expected 4 numbers (X, S, P), one per time, got a single number without a list around it"),
        ([[1.0, 2.0, 3.0]] * 3 + [[1.0]], "rows of different lengths"),
        (np.array([[1.0], [1.0, 2.0]], dtype=object), "rows of different lengths"),
        (np.array([[1.0, 2.0, None]] * 4), "Python objects where numbers belong (the first is None)"),
        (TABLE.astype(int), "an array of integers (int64), which cuts off the decimals of what is put into it"),
        (list(TABLE.astype(int)), "an array of integers (int64)"),
        (TABLE * 1j, "complex numbers: return what was measured"),
        (TABLE.astype(str), "text where numbers belong"),
        (np.ma.masked_greater(TABLE, 20.0), "the array has masked values"),
        ([[2**60 + 1, 0, 0]] * 4, "has a whole number above 2**53, which no 64-bit float holds"),
        (None, "nothing came: is a `return` missing?"),
        ((row for row in TABLE), "a generator is no array: `return numpy.array(list(...))`"),
        (np.array(["2020-01-01"], dtype="M8[D]"), "values of the kind datetime64[D] where numbers belong"),
        ({"t": TIMES, "y": TABLE.T, "nfev": 9}, "the whole answer of SciPy's solve_ivp, expected X, S, P; `return sol.y.T`"),
    ],
)
def test_everything_else_is_refused_with_the_remedy(value, words):
    text = refused(returning(value))
    assert text.startswith(f"ValueError: {AT}") and words in text, text


def test_a_single_output_that_is_transposed_or_a_tuple_is_told_too():
    assert "the array of shape (1, 4) is transposed" in refused(returning(X[None], ["X"]))
    assert "a tuple of 1 (`return a, b` makes one)" in refused(returning((X,), ["X"]))
    one_more = refused(returning(np.append(X, 5.0), ["X"]))
    assert "expected 4 numbers (X), got 5; one too many: outputs belong to `window.times`" in one_more


def test_a_named_output_is_a_column_of_its_own():
    assert "run returned `S` at 4 times: expected 4 numbers (S), got 3" in refused(
        returning({"X": X, "S": S[:3], "P": P})
    )
    field = [starlings.Quantity("wall", size=2)]

    @starlings.solver(outputs=field)
    def wall(window):
        return {"wall": np.vstack((X, S))}

    assert "run returned `wall` at 4 times: the array of shape (2, 4) is transposed" in refused(wall)


def test_where_times_and_outputs_are_as_many_another_number_of_times_tells():
    transposed = returning(TABLE.T)
    with pytest.raises(starlings.Failed, match="is transposed"):
        starlings.simulate(transposed, times=TIMES)
    # As many times as outputs: nobody can tell, which is why conformance asks for several numbers of times.
    starlings.simulate(returning(np.zeros((3, 3))), times=TIMES[:3])


class Pair(starlings.Solver):
    """Two states, whose step is replaced."""

    states = {"x": "m", "v": "m/s"}
    outputs = {"y": "m"}
    measures = {"y": "x"}
    given = [1.0, 2.0]

    def step(self, t, dt, x, p, u):
        return self.given


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ([1.0], "expected 2 numbers (x, v), got 1"),
        (np.zeros((2, 1)), "got an array of shape (2, 1); its entries are arrays of one number: take the `[0]` of each"),
        (np.zeros((1, 2)), "got an array of shape (1, 2); `.ravel()` makes one row of it"),
        (np.array([1, 2]), "an array of integers (int64)"),
        ([1.0, None], "Python objects where numbers belong (the first is None)"),
        (None, "nothing came: is a `return` missing?"),
        ({"x": 1.0}, "step: expected the states x, v, got x"),
    ],
)
def test_states_are_taken_by_their_shape_likewise(value, words):
    text = refused(type("Odd", (Pair,), {"given": value}))
    assert text.startswith("ValueError: step") and words in text, text


def test_a_start_of_whole_numbers_is_a_start():
    class Counted(Pair):
        def initial(self, p):
            return np.array([3, 4])

        def step(self, t, dt, x, p, u):
            return x + 0.5

    assert starlings.simulate(Counted, times=[1.0]).state.tolist() == [3.5, 4.5]


def test_a_run_with_states_returns_two_things():
    class Three(starlings.Solver):
        states = {"x": ""}
        outputs = {"y": "", "z": ""}

        def run(self, window):
            return window.times, window.times, [1.0]

    text = refused(Three)
    assert "a solver with states returns two things, outputs and the state at the end; got 3 things" in text
    assert "`return outputs, state`" in text


def test_what_was_returned_wrongly_is_placed_in_the_file_of_the_solver(capsys):
    @starlings.solver(outputs={"y": ""})
    def short(window):
        return [1.0]

    line = short.run.__wrapped__.__code__.co_firstlineno + 2
    assert refused(short).endswith(f"(test_shapes.py:{line})")
    last = capsys.readouterr().err.strip().splitlines()
    assert last[0] == "Traceback (most recent call last):" and "return [1.0]" in last[-2]
    assert f"test_shapes.py\", line {line}" in last[-3]


def test_a_traceback_has_no_line_of_this_package(capsys):
    @starlings.solver(parameters={"k": ""}, outputs={"y": ""})
    def typing_error(window):
        try:
            return window.p.kk
        except AttributeError as error:
            raise ValueError("no such thing") from error

    text = refused(typing_error, parameters={"k": 1.0})
    shown = capsys.readouterr().err
    assert "ValueError: no such thing" in shown and "AttributeError: no `kk` among the parameters: k" in shown
    package = starlings.__file__.rpartition("/")[0]
    files = [line for line in shown.splitlines() if line.startswith("  File ")]
    assert len(files) == 2 and not any(package in line for line in files), shown
    assert "test_shapes.py:" in text
    # The usual way of printing would have shown them.
    try:
        starlings.simulate(typing_error, times=TIMES, parameters={"k": 1.0})
    except starlings.Failed as error:
        assert package in "".join(traceback.format_exception(type(error), error, error.__traceback__))
