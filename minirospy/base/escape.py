"""Make untrusted text safe to display: names, URIs and messages from peers and files.

A control character in them could move a terminal's cursor, set its title, or forge a line in a log file or an HTTP
header. Pure.
"""

from __future__ import annotations

import contextlib
import io
import re
import sys
from typing import TextIO

__all__ = ["SafeTerminal", "escaped", "has_controls", "own_output"]

_CONTROLS = r"\x00-\x1f\x7f-\x9f\u2028\u2029"
# Includes direction marks, which reverse the text that follows: a name could then look like another one.
_CONTROL = re.compile(f"[{_CONTROLS}\u202a-\u202e\u2066-\u2069]")
_NAME_CONTROL = re.compile(f"[{_CONTROLS}]")

_OWN_SEQUENCE = re.compile(r"\033\[[0-9;]*m|\r?\033\[K|\033\[2J\033\[;H|\033\]2;[^\x00-\x1f\x7f-\x9f]*\007")
"""The control sequences that commands themselves send to a terminal: colours, clearing a line or the screen, the window
title.
"""


def escaped(text: str, keep: str = "") -> str:
    r"""Return ``text`` with control characters, except those in ``keep``, escaped as in Python: ``\n``, ``\x1b``."""
    if not _CONTROL.search(text):
        return text
    return _CONTROL.sub(
        lambda match: match[0] if match[0] in keep else match[0].encode("unicode_escape").decode(), text
    )


def has_controls(text: str) -> bool:
    """Return whether ``text`` contains a control character or a line separator, and therefore cannot be a name or a URI."""
    return _NAME_CONTROL.search(text) is not None


def own_output() -> TextIO:
    """Return a stream to stdout that does not escape control sequences, for drawings that move the cursor.

    The caller must escape untrusted text in the drawing.
    """
    if isinstance(sys.stdout, SafeTerminal) and sys.__stdout__ is not None:
        sys.stdout.flush()
        return sys.__stdout__
    return sys.stdout


class SafeTerminal(io.TextIOWrapper):
    """A standard stream that shows control characters on a terminal instead of executing them, as `ls` does for names.

    Sequences from the commands themselves (:data:`_OWN_SEQUENCE`), line feeds and tabs are written unchanged.
    """

    @classmethod
    def around(cls, stream: io.TextIOWrapper) -> SafeTerminal:
        """Return a stream that writes to the same terminal as ``stream``."""
        stream.flush()
        return cls(stream.buffer, stream.encoding, "backslashreplace", line_buffering=True)

    def write(self, text: str) -> int:
        """Write ``text`` with its control characters escaped."""
        if _CONTROL.search(text):
            end, parts = 0, []
            for own in _OWN_SEQUENCE.finditer(text):
                parts += [escaped(text[end : own.start()], "\n\t"), own[0]]
                end = own.end()
            text = "".join([*parts, escaped(text[end:], "\n\t")])
        return super().write(text)

    def write_own(self, text: str) -> int:
        """Write a command's own text, such as a status line, without escaping its control characters."""
        return super().write(text)

    def close(self) -> None:
        """Write pending output. The terminal itself stays open, because the interpreter's own stream uses it."""
        # Ignore ValueError, which means that the stream was already closed.
        with contextlib.suppress(ValueError):
            self.flush()
            self.detach()

    def __del__(self) -> None:
        # Unlike TextIOWrapper.__del__, do not close the stream: that would close the buffer, which sys.__stdout__ shares.
        pass
