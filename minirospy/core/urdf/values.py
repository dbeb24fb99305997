"""Parse attributes to numbers and vectors, with the error messages of ROS's parser."""

from __future__ import annotations

import math
import re

__all__ = ["NotANumberError", "as_float", "parse_numbers", "parse_vector"]

_NUMBER = re.compile(r"[+-]?(\d+(?:\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class NotANumberError(ValueError):
    """The text is not the required number or vector; ``str()`` is the reason."""


def as_float(text: str) -> float:
    """Parse a number. Raise NotANumberError if the text is not a number or, as in ROS, is hexadecimal, infinite or NaN."""
    stripped = text.strip()
    value = float(stripped) if _NUMBER.fullmatch(stripped) else math.nan
    if not math.isfinite(value):
        raise NotANumberError(text)
    return value


def parse_numbers(text: str, what: str = "vector") -> tuple[float, ...]:
    """Parse the numbers in a string. Raise NotANumberError if one of them is not a number."""
    numbers = []
    for part in text.split():
        try:
            numbers.append(as_float(part))
        except NotANumberError:
            why = f"Unable to parse component [{part}] to a double (while parsing a {what} value)"
            raise NotANumberError(why) from None
    return tuple(numbers)


def parse_vector(text: str) -> tuple[float, float, float]:
    """Parse the three numbers in a string. Raise NotANumberError if there are not exactly three numbers."""
    numbers = parse_numbers(text)
    if len(numbers) != 3:
        raise NotANumberError(
            f"Parser found {len(numbers)} elements but 3 expected while parsing vector [{text}]"
        )
    return numbers[0], numbers[1], numbers[2]
