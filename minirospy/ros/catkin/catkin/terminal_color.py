"""catkin.terminal_color: strings with named colors, such as ``fmt("@{redf}error@{reset}")``."""

from __future__ import annotations

import os
import string
from collections.abc import Mapping

__all__ = ["ColorTemplate", "ansi", "disable_ANSI_colors", "enable_ANSI_colors", "fmt", "sanitize"]

_CODES = {
    "escape": "\033",
    "reset": "\033[0m", "|": "\033[0m",
    "boldon": "\033[1m", "!": "\033[1m",
    "italicson": "\033[3m", "/": "\033[3m",
    "ulon": "\033[4m", "_": "\033[4m",
    "invon": "\033[7m",
    "boldoff": "\033[22m", "italicsoff": "\033[23m", "uloff": "\033[24m", "invoff": "\033[27m",
}  # fmt: skip
_CODES |= {"atexclimation": "@!", "atfwdslash": "@/", "atunderscore": "@_", "atbar": "@|"}
_COLORS = ("black", "red", "green", "yellow", "blue", "purple", "cyan", "white")
for _number, _color in enumerate(_COLORS):
    _letter = "k" if _color == "black" else _color[0]
    _CODES |= dict.fromkeys((_color, f"{_color}f", f"{_letter}f"), f"\033[{30 + _number}m")
    _CODES |= dict.fromkeys((f"{_color}b", f"{_letter}b"), f"\033[{40 + _number}m")


class ColorTemplate(string.Template):
    """A string template in which ``@`` precedes a color name."""

    delimiter = "@"


class _Colors:
    """The current ANSI codes: empty on Windows and after :func:`disable_ANSI_colors`."""

    def __init__(self) -> None:
        self.codes: Mapping[str, str] = {}
        self.switch(is_on=os.name != "nt")

    def switch(self, *, is_on: bool) -> None:
        self.codes = _CODES if is_on else dict.fromkeys(_CODES, "")


_USED = _Colors()


def ansi(key: str) -> str:
    """Return the ANSI code for a color or style. Raise KeyError if the name is unknown."""
    return _USED.codes[key]


def enable_ANSI_colors() -> None:
    """Make this module's functions insert ANSI codes."""
    _USED.switch(is_on=True)


def disable_ANSI_colors() -> None:
    """Make this module's functions return plain text."""
    _USED.switch(is_on=False)


def fmt(msg: str) -> str:
    """Return a string with ANSI codes in place of ``@{redf}``, ``@!`` (bold), ``@/``, ``@_`` and ``@|`` (reset)."""
    for mark in ("!", "/", "_", "|"):
        msg = msg.replace(f"@{mark}", f"@{{{_NAMES[mark]}}}")
    return ColorTemplate(msg).substitute(_USED.codes) + _USED.codes["reset"]


_NAMES = {"!": "boldon", "/": "italicson", "_": "ulon", "|": "reset"}


def sanitize(msg: str) -> str:
    """Escape a string so that :func:`fmt` returns the original string, except that braces are doubled."""
    msg = msg.replace("@", "@@").replace("{", "{{").replace("}", "}}")
    for mark, name in _MARKS.items():
        msg = msg.replace(f"@@{mark}", f"@{{{name}}}")
    return msg


_MARKS = {"!": "atexclimation", "/": "atfwdslash", "_": "atunderscore", "|": "atbar"}
