"""`xacro`: expands the macros in robot descriptions with the Python package xacro.

`$(find PACKAGE)` finds minirospy's packages. The options, messages and exit statuses (2 if a file cannot be processed)
are those of the Python package. Options for behaviour that is now standard are accepted without effect. Source:
http://wiki.ros.org/xacro.
"""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.errors import MinirospyError, NotFoundError
from minirospy.base.installation import install_command
from minirospy.base.xml_text import check_xml
from minirospy.command.command import run

__all__ = ["main"]

_ALWAYS = {"--xacro-ns", "--check-order"}
"""Options that are accepted without effect, as in ROS: since Melodic, xacro always does what they ask for."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run xacro; return its exit status."""
    words = sys.argv[1:] if argv is None else argv
    return run("xacro", lambda: _xacro(words))


def _xacro(words: Sequence[str]) -> int:
    # Import this module because the package xacro uses it in an `except` clause without importing it.
    import xml.parsers.expat  # noqa: F401

    try:
        import xacro  # type: ignore[import-untyped]
    except ImportError as error:
        raise MinirospyError(
            f"the package xacro cannot be imported ({error}): {install_command('xacro')}"
        ) from error

    if isinstance(sys.stdout, io.TextIOWrapper) and not sys.stdout.isatty():
        # Write UTF-8 regardless of the system's code page, because roslaunch reads a robot description as UTF-8.
        sys.stdout.reconfigure(encoding="utf-8")
    evaluate = xacro.eval_extension

    def eval_extension(text: str) -> object:
        """Evaluate `$(...)`. If a package is missing, shorten the error, which xacro would print twice and with a class name."""
        try:
            return evaluate(text)
        except xacro.XacroException as error:
            if isinstance(getattr(error.exc, "__cause__", None), NotFoundError):
                raise xacro.XacroException(str(error.exc)) from error
            raise

    parse = xacro.parse

    def checked_parse(inp: object, filename: str | None = None) -> object:
        """Parse a file or string, after checking that its entities do not expand to gigabytes."""
        if inp is None and filename is not None:
            # Ignore a file that cannot be opened; xacro itself reports that error.
            with contextlib.suppress(OSError), open(Path(xacro.root_dir, filename)) as file:
                inp = file.read()
        if isinstance(inp, str):
            check_xml(inp)
        return parse(inp, filename)

    xacro.parse = checked_parse
    xacro.eval_extension = eval_extension
    sys.argv = ["xacro", *(word for word in words if word not in _ALWAYS)]
    try:
        xacro.main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0
