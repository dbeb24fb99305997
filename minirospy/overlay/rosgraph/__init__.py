"""rosgraph, filled in by minirospy: the master as Python code asks it, names, the environment."""

import sys
from collections.abc import Sequence

from rosgraph import masterapi as masterapi
from rosgraph import names as names
from rosgraph import network as network
from rosgraph import rosenv as rosenv
from rosgraph.masterapi import Master as Master
from rosgraph.masterapi import MasterError as MasterError
from rosgraph.masterapi import MasterException as MasterException
from rosgraph.masterapi import MasterFailure as MasterFailure
from rosgraph.masterapi import is_online as is_master_online
from rosgraph.rosenv import get_master_uri as get_master_uri

__all__ = ["Master", "MasterException", "get_master_uri", "is_master_online", "myargv"]


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """The command line without remappings."""
    return [arg for arg in (sys.argv if argv is None else argv) if ":=" not in arg]
