"""The language of expressions, against what the study file promises of it."""

import math

import pytest

from starlings import Expression, ExpressionError

TABLE = [
    ("1 + 2*3", 7.0),
    ("(1 + 2)*3", 9.0),
    ("-x^2", -9.0),
    ("(-x)^2", 9.0),
    ("2^3^2", 512.0),
    ("2^-1", 0.5),
    ("-2^2", -4.0),
    ("2*-3", -6.0),
    ("6/3/2", 1.0),
    ("7 - 2 - 1", 4.0),
    ("+x", 3.0),
    ("1e3 + .5 + 2.", 1002.5),
    ("x > 2", 1.0),
    ("x <= 2", 0.0),
    ("x == 3", 1.0),
    ("x != 3", 0.0),
    ("1 + 1 < 3", 1.0),
    ("if(x > 2, 10, 20)", 10.0),
    ("if(x < 2, 10, 20)", 20.0),
    ("if(0/0, 1, 2)", 2.0),
    ("if(x > 5, 1/0, 4)", 4.0),
    ("sin(0.5)", math.sin(0.5)),
    ("cos(0.5)", math.cos(0.5)),
    ("tan(0.5)", math.tan(0.5)),
    ("exp(1)", math.e),
    ("log(exp(2))", 2.0),
    ("sqrt(16)", 4.0),
    ("abs(-2)", 2.0),
    ("sign(-2) + 10*sign(0) + 100*sign(5)", 99.0),
    ("min(2, 1) + 10*max(2, 1)", 21.0),
    ("tanh(0.5)", math.tanh(0.5)),
    ("step(0)", 1.0),
    ("step(-1e-300)", 0.0),
    ("pi", math.pi),
    ("2*t", 14.0),
    ("1/0", math.inf),
    ("-1/0", -math.inf),
    ("log(0)", -math.inf),
    ("exp(1000)", math.inf),
    ("10^400", math.inf),
    ("x_1 * Q2", 20.0),
    ("\t x\n", 3.0),
]


@pytest.mark.parametrize(("text", "value"), TABLE)
def test_an_expression_has_its_value(text, value):
    # The same functions of the same libm, so exactly equal.
    assert Expression(text)(t=7.0, x=3.0, x_1=4.0, Q2=5.0) == value


@pytest.mark.parametrize(
    "text", ["0/0", "sqrt(-1)", "log(-1)", "(-8)^0.5", "sin(1/0)", "step(0/0)", "abs(0/0)"]
)
def test_what_is_no_number_is_not_a_number_and_raises_nothing(text):
    assert math.isnan(Expression(text)())


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [
        ("", 1, "found the end"),
        ("1 +", 4, "found the end"),
        ("2 x", 3, "a product needs `*`"),
        ("2(3)", 2, "a product needs `*`"),
        ("a**2", 3, "a power is written `^`"),
        ("a = 2", 3, "equality is written `==`"),
        ("1 < 2 < 3", 7, "comparisons do not chain"),
        ("sin", 1, "`sin` is a function"),
        ("sin(1, 2)", 6, "`sin` takes 1 argument"),
        ("max(1)", 6, "`max` takes 2 arguments"),
        ("sine(1)", 1, "no function named `sine`"),
        ("(1", 3, "found the end"),
        ("1)", 2, "found `)`"),
        ("1e999", 1, "too large a number"),
        ("x + nobody", 5, "nothing is named `nobody`"),
        ("delay(2*x, 1)", 1, "needs the name of an input"),
        ("ddt(x)", 5, "which is no input"),
        ("__import__('os')", 1, "no function named `__import__`"),
        ("x.real", 2, "found `.`"),
        ("x if t else 1", 3, "found `if`"),
        ("(" * 300 + "1" + ")" * 300, 201, "nested more than 200 deep"),
        ("1+" * 2500 + "1", 4001, "longer than 4000 characters"),
    ],
)
def test_what_is_wrong_is_told_with_its_column(text, column, words):
    with pytest.raises(ExpressionError) as caught:
        Expression(text)(x=1.0)
    assert caught.value.column == column
    assert words in str(caught.value)


def test_names_are_those_that_need_a_value():
    assert Expression("k*x - max(c, t)*pi + k").names == ["k", "x", "c"]
