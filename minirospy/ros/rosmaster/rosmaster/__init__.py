"""rosmaster: runs a master inside a program. Source: http://wiki.ros.org/rosmaster."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rosmaster.rosmaster import master as master
    from minirospy.ros.rosmaster.rosmaster.master import DEFAULT_MASTER_PORT

__all__ = ["DEFAULT_MASTER_PORT", "rosmaster_main"]


def rosmaster_main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status. ``argv`` starts with the command's name."""
    from minirospy.ros.rosmaster.commands.master import rosmaster

    return rosmaster(list(sys.argv if argv is None else argv)[1:])
