"""rosmaster, filled in by minirospy: a master inside a program. Source: http://wiki.ros.org/rosmaster."""

from __future__ import annotations

import sys
from collections.abc import Sequence

__all__ = ["rosmaster_main"]


def rosmaster_main(argv: Sequence[str] | None = None) -> int:
    """The command; ``argv`` begins with its name. Its exit status, once it ends."""
    from minirospy.cli.ros.master import rosmaster

    return rosmaster(list(sys.argv if argv is None else argv)[1:])
