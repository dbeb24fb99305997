"""Text of strangers made fit to be shown: names, URIs and messages that peers and files choose.

A control character in them could move a terminal's cursor, set its title, forge a line of a log file or a header of
HTTP. Pure.
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
from typing import TextIO

__all__ = ["SafeTerminal", "escaped", "has_controls", "own_output"]

_CONTROLS = r"\x00-\x1f\x7f-\x9f\u2028\u2029"
# Marks that turn the direction of what follows: a name would look like another one.
_CONTROL = re.compile(f"[{_CONTROLS}\u202a-\u202e\u2066-\u2069]")
_NAME_CONTROL = re.compile(f"[{_CONTROLS}]")

_OWN_SEQUENCE = re.compile(r"\033\[[0-9;]*m|\r?\033\[K|\033\[2J\033\[;H|\033\]2;[^\x00-\x1f\x7f-\x9f]*\007")
"""What the commands themselves send to a terminal: colours, a cleared line or screen, the title of the window."""


def escaped(text: str, keep: str = "") -> str:
    r"""Return ``text`` with each control character but those of ``keep`` as Python writes it: ``\n``, ``\x1b``."""
    if not _CONTROL.search(text):
        return text
    return _CONTROL.sub(
        lambda match: match[0] if match[0] in keep else match[0].encode("unicode_escape").decode(), text
    )


def has_controls(text: str) -> bool:
    """Return whether ``text`` holds a control character or a separator of lines: it is not a name or a URI then."""
    return _NAME_CONTROL.search(text) is not None


def own_output() -> TextIO:
    """Return the standard output for a picture that moves the cursor, which :class:`SafeTerminal` would write out.

    What is foreign in the picture has to be escaped.
    """
    if isinstance(sys.stdout, SafeTerminal) and sys.__stdout__ is not None:
        sys.stdout.flush()
        return sys.__stdout__
    return sys.stdout


class SafeTerminal(io.TextIOWrapper):
    """A standard stream that is a terminal: control characters are shown, not obeyed, as `ls` shows those of names.

    What the commands themselves send (:data:`_OWN_SEQUENCE`), line feeds and tabs pass.
    """

    @classmethod
    def around(cls, stream: io.TextIOWrapper) -> SafeTerminal:
        """Return a stream that writes where ``stream`` does."""
        stream.flush()
        return cls(stream.buffer, stream.encoding, "backslashreplace", line_buffering=True)

    def write(self, text: str) -> int:
        """Write a text."""
        if _CONTROL.search(text):
            end, parts = 0, []
            for own in _OWN_SEQUENCE.finditer(text):
                parts += [escaped(text[end : own.start()], "\n\t"), own[0]]
                end = own.end()
            text = "".join([*parts, escaped(text[end:], "\n\t")])
        return super().write(text)

    def write_own(self, text: str) -> int:
        """Write a text of the command's own, whose control characters the terminal is to obey: a status line."""
        return super().write(text)

    def close(self) -> None:
        """Write what waits; the terminal itself stays open for the interpreter's own stream."""
        # ValueError: it has been closed before.
        with contextlib.suppress(ValueError):
            self.flush()
            self.detach()

    def __del__(self) -> None:
        # TextIOWrapper's would close the buffer that sys.__stdout__ shares.
        pass
