"""introspect/arithmetic: the expressions in rad() and deg(). tests/referee/cases/params_angles.py compares them with ROS."""

from __future__ import annotations

import math

import pytest

from minirospy.introspect.arithmetic import arithmetic, degrees, radians


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 << 3 >> 1", 4.0),
        ("3 > 2", 1.0),
        ("3 < 2 < 1", 0.0),
        ("3 and 4", 4.0),
        ("0 or 0.0", 0.0),
        ("not pi", 0.0),
        ("~1 & 7 | 6 ^ 2", float(~1 & 7 | 6 ^ 2)),
        ("1 if pi > 3 else 2", 1.0),
        ("7**30/3", 7**30 / 3),
        ("2**-1", 0.5),
        ("max(1, math.sqrt(9))", 3.0),
        ("round(2.567, 1)", 2.6),
        ("0 << 10**9", 0.0),
        ("1**10**9", 1.0),
    ],
)
def test_operators_and_functions(text: str, value: float) -> None:
    assert arithmetic(text) == value


@pytest.mark.parametrize(
    "text",
    [
        "1 << 10**9",
        "9**9**9",
        "2**1024",
        "pow(10, 10**9)",
        "round(7, -10**9)",
        "10**308*10**308*1",
        "(-8)**(1/3)",
        "1 << 0.5",
        "1 << -1",
        "1/0",
        "x",
        "'1'",
        "[1][0]",
        "math.factorial(9)",
        "__import__('os')",
        "pi.real",
        "(lambda: 1)()",
        "1 if x else 2",
        "max(1, key=abs)",
        "max()",
        "1j",
        "1 in [1]",
        "",
        "1 +",
    ],
)
def test_what_is_refused(text: str) -> None:
    with pytest.raises((ValueError, SyntaxError, ArithmeticError)):
        arithmetic(text)


def test_brackets_that_are_no_expression_are_a_text() -> None:
    assert radians("rad(pi/2)") == radians("pi/2") == math.pi / 2
    assert radians("rad((1+2)*3)") == 9.0
    assert radians("rad(deg(1))") == "rad(deg(1))"
    assert degrees("deg(90)") == degrees("90") == degrees("deg(180/2)") == math.pi / 2
    assert math.isnan(float(degrees("deg(nan)")))
    with pytest.raises(ValueError, match="only numbers"):
        radians("rad(x)")
