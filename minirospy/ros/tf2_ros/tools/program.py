"""Code shared by the programs: arguments, errors, and a buffer with a listener."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError
from minirospy.base.escape import escaped

__all__ = ["USAGE_STATUS", "ToolError", "report", "run_program"]

# exit status after a usage error: ROS's programs return -1, which the shell reports as 255
USAGE_STATUS = 255


class ToolError(MinirospyError):
    """Raised if a program cannot continue.

    It prints ``text`` to stdout and ``str()`` to stderr, and exits with the status.

    ``level`` is the line's log level; if it is empty, the line is printed without a level.
    """

    def __init__(
        self, line: str, *, text: str = "", status: int = USAGE_STATUS, level: str = "ERROR"
    ) -> None:
        super().__init__(line)
        self.text = text
        self.status = status
        self.level = level


def run_program(body: Callable[[Sequence[str]], int | None], words: Sequence[str] | None) -> int:
    """Run a program with its arguments; return its exit status. Ctrl-C and a closed stdout are not errors."""
    arguments = rospy.myargv(sys.argv)[1:] if words is None else words
    try:
        return body(arguments) or 0
    except ToolError as error:
        if error.text:
            print(error.text, flush=True)
        if str(error):
            report(str(error), error.level)
        return error.status
    except (rospy.ROSInterruptException, KeyboardInterrupt):
        return 0
    except BrokenPipeError:
        # Discard the buffered output, because it cannot be written.
        sys.stdout = None
        return 0


def report(line: str, level: str = "ERROR") -> None:
    """Print a line in ROS's console format; this works without a node. If ``level`` is empty, print the line unchanged.

    The level INFO is printed to stdout, all others to stderr.
    """
    head = f"[{level}] [{time.time():.6f}]: " if level else ""
    print(escaped(head + line, "\n"), file=sys.stdout if level == "INFO" else sys.stderr, flush=True)
