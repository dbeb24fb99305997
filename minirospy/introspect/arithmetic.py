"""Evaluate the arithmetic in YAML angles, such as ``rad(pi/2)``.

ROS passes these expressions to Python's eval(), which can run any code. Here, an expression may contain only numbers, ``pi``,
Python's operators and some functions, and limits keep each step from taking long or filling the memory.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import ast

__all__ = ["BRACKETS", "arithmetic", "degrees", "radians"]

BRACKETS = r"\(([^()]*(?:\([^()]*\)[^()]*)*)\)"  # matches (...) after `rad`, with at most one nested level

_MAX_LENGTH = (
    200  # maximum length of an expression, in characters; longer ones may exceed limits of Python's parser
)
_MAX_BITS = 1_100  # maximum number of bits of an integer; longer ones exceed any float, an error in ROS, too
_MAX_PLACES = 400  # maximum argument of round(): a float has fewer decimal places

_CONSTANTS = ("e", "inf", "nan", "tau")  # names from the math module; `pi` is handled separately
_FUNCTIONS = (
    *(
        "acos",
        "acosh",
        "asin",
        "asinh",
        "atan",
        "atan2",
        "atanh",
        "ceil",
        "copysign",
        "cos",
        "cosh",
        "degrees",
    ),
    *(
        "exp",
        "fabs",
        "floor",
        "fmod",
        "hypot",
        "log",
        "log10",
        "log2",
        "pow",
        "radians",
        "sin",
        "sinh",
        "sqrt",
    ),
    *("tan", "tanh", "trunc"),
)  # names from the math module
_ALLOWED = "only numbers, pi, Python's operators, functions of math, abs, float, int, max, min, pow, round and brackets"

Number = int | float


def arithmetic(text: str) -> float:
    """Evaluate an arithmetic expression that contains numbers, operators, functions and ``pi``.

    A comparison returns 1.0 or 0.0. Raise ValueError, SyntaxError or ArithmeticError if the expression is invalid.
    """
    import ast

    if len(text) > _MAX_LENGTH:
        raise ValueError(f"more than {_MAX_LENGTH} characters")
    try:
        return float(_Evaluator().value(ast.parse(text.strip(), mode="eval").body))
    except TypeError as error:
        # Raised, for example, by 1 << 0.5, and by a function call with the wrong number of arguments.
        raise ValueError(str(error)) from error


def radians(text: str) -> float | str:
    """Evaluate ``rad(pi/2)`` or a plain expression; return the value in radians.

    ROS treats nested brackets as a string. Here they are evaluated, and the text remains a string only if that fails. Raise the
    same exceptions as :func:`arithmetic`.
    """
    return _angle(text, "rad", arithmetic)


def degrees(text: str) -> float | str:
    """Evaluate ``deg(90)`` or a plain expression in degrees; return the value in radians. See :func:`radians`."""

    def value(expression: str) -> float:
        try:
            number = float(expression) if len(expression) <= _MAX_LENGTH else arithmetic(expression)
        except ValueError:
            number = arithmetic(expression)
        return number * math.pi / 180.0

    return _angle(text, "deg", value)


def _angle(text: str, name: str, evaluate: Callable[[str], float]) -> float | str:
    match = re.fullmatch(name + BRACKETS, text.strip())
    try:
        return evaluate(match[1] if match else text)
    except (ValueError, SyntaxError, ArithmeticError):
        if match and ")" in match[1]:
            return text
        raise


class _Evaluator:
    """Evaluates a syntax tree, with one function per type of operator."""

    def __init__(self) -> None:
        import ast
        import operator

        self._unary: dict[type[ast.unaryop], Callable[[Number], Number]] = {
            ast.USub: operator.neg,
            ast.UAdd: operator.pos,
            ast.Invert: _inverted,
            ast.Not: operator.not_,
        }
        self._binary: dict[type[ast.operator], Callable[[Number, Number], Number]] = {
            ast.Add: operator.add,
            ast.Sub: operator.sub,
            ast.Mult: operator.mul,
            ast.Div: operator.truediv,
            ast.FloorDiv: operator.floordiv,
            ast.Mod: operator.mod,
            ast.Pow: _power,
            ast.LShift: _shifted,
            ast.RShift: operator.rshift,
            ast.BitAnd: operator.and_,
            ast.BitOr: operator.or_,
            ast.BitXor: operator.xor,
        }
        self._compare: dict[type[ast.cmpop], Callable[[Number, Number], bool]] = {
            ast.Eq: operator.eq,
            ast.NotEq: operator.ne,
            ast.Lt: operator.lt,
            ast.LtE: operator.le,
            ast.Gt: operator.gt,
            ast.GtE: operator.ge,
        }

    def value(self, node: ast.expr) -> Number:
        """Return the value of a node. Raise ValueError, TypeError or ArithmeticError if it cannot be evaluated."""
        value = self._any_value(node)
        if isinstance(value, int) and value.bit_length() > _MAX_BITS:
            raise OverflowError("int too large to convert to float")
        return value

    def _any_value(self, node: ast.expr) -> Number:
        import ast

        match node:
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.Name(id="pi"):
                return math.pi
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if name in _CONSTANTS:
                constant: float = getattr(math, name)
                return constant
            case ast.UnaryOp(op=sign, operand=inner):
                return self._unary[type(sign)](self.value(inner))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in self._binary:
                return self._binary[type(op)](self.value(left), self.value(right))
            case ast.Compare(left=left, ops=ops, comparators=others) if self._compare.keys() >= set(
                map(type, ops)
            ):
                return self._compared(left, ops, others)
            case ast.BoolOp(op=connective, values=values):
                return self._connected(values, until=isinstance(connective, ast.Or))
            case ast.IfExp(test=test, body=body, orelse=other):
                return self.value(body if self.value(test) else other)
            case ast.Call(func=function, args=arguments, keywords=[]):
                return _function(function)(*map(self.value, arguments))
            case _:
                raise ValueError(_ALLOWED)

    def _compared(self, left: ast.expr, ops: Sequence[ast.cmpop], others: Sequence[ast.expr]) -> bool:
        before = self.value(left)
        for op, other in zip(ops, others, strict=True):
            after = self.value(other)
            if not self._compare[type(op)](before, after):
                return False
            before = after
        return True

    def _connected(self, values: Sequence[ast.expr], *, until: bool) -> Number:
        """Evaluate ``and`` or ``or``: return the first value with the truth value ``until``, or else the last value."""
        for node in values:
            value = self.value(node)
            if bool(value) is until:
                break
        return value


def _function(node: ast.expr) -> Callable[..., Number]:
    import ast

    match node:
        case ast.Attribute(value=ast.Name(id="math"), attr=name) if name in _FUNCTIONS:
            function: Callable[..., Number] = getattr(math, name)
            return function
        case ast.Name(id=name) if name in _BUILT_IN:
            return _BUILT_IN[name]
        case _:
            raise ValueError(_ALLOWED)


def _inverted(number: Number) -> Number:
    if isinstance(number, float):
        raise TypeError("bad operand type for unary ~: 'float'")
    return ~number


def _power(base: Number, exponent: Number) -> Number:
    if not (isinstance(base, int) and isinstance(exponent, int) and exponent >= 0):
        # Unlike **, math.pow() raises ValueError if the result would be complex.
        return math.pow(base, exponent)
    if base.bit_length() * exponent > 2 * _MAX_BITS and abs(base) > 1:
        raise OverflowError("int too large to convert to float")
    return int(base**exponent)


def _shifted(number: Number, by: Number) -> Number:
    if isinstance(number, float) or isinstance(by, float):
        raise TypeError("unsupported operand type(s) for <<: a float")
    if by > _MAX_BITS and number:
        raise OverflowError("int too large to convert to float")
    return number << by


def _rounded(number: Number, places: int | None = None) -> Number:
    if places is not None and abs(places) > _MAX_PLACES:
        raise OverflowError(f"round() to {places} places")
    return round(number, places)


_BUILT_IN: dict[str, Callable[..., Number]] = {
    "abs": abs,
    "float": float,
    "int": int,
    "max": max,
    "min": min,
    "pow": _power,
    "round": _rounded,
}
