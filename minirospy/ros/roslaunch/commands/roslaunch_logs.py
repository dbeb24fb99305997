"""`roslaunch-logs`: print the folder of the current run's log files.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools#roslaunch-logs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.base.environment import Environment, run_folder
from minirospy.base.errors import MasterUnreachableError, MinirospyError, RpcError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["COMMAND", "get_run_id", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0. If no master responds, print the parent folder of all runs and return 2, like ROS."""
    return COMMAND.main(argv)


def get_run_id() -> str | None:
    """Return the current run id, or None if no master responds or it has no run id."""
    master = MasterProxy(Environment.read().master_uri, "/roslaunch")
    try:
        return str(master.get_param("/run_id"))
    except (MasterUnreachableError, RpcError):
        return None
    finally:
        master.close()


def _parser() -> Parser:
    return Parser("roslaunch-logs", "Print the folder of the present run's log files.", "roslaunch-logs")


def _logs() -> int:
    run_id = get_run_id()
    log_dir = Environment.read().log_dir
    if run_id is None:
        print("No active roscore", file=sys.stderr)
        print(log_dir)
        return 2
    folder = run_folder(log_dir, run_id)
    if folder is None:
        raise MinirospyError("/run_id at the master cannot be the name of a folder: somebody has changed it")
    print(folder)
    return 0


COMMAND = Command("roslaunch-logs", _parser, _logs)

if __name__ == "__main__":
    sys.exit(main())
