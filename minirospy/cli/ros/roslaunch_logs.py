"""`roslaunch-logs`: where the log files of the present run lie.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools#roslaunch-logs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.cli.command import Parser, run
from minirospy.environment import Environment
from minirospy.errors import MasterUnreachableError, RpcError
from minirospy.runtime.master_proxy import MasterProxy

__all__ = ["get_run_id", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """The command; 0, or 2 (as in ROS) where no master answers, and the folder of all runs is printed."""
    return run("roslaunch-logs", lambda: _logs(sys.argv[1:] if argv is None else argv))


def get_run_id() -> str | None:
    """The id of the present run; None where no master answers, or it has none."""
    master = MasterProxy(Environment.read().master_uri, "/roslaunch")
    try:
        return str(master.get_param("/run_id"))
    except (MasterUnreachableError, RpcError):
        return None
    finally:
        master.close()


def _logs(argv: Sequence[str]) -> int:
    Parser(prog="roslaunch-logs", description="Prints the folder of the present run's log files.").parse_args(
        argv
    )
    run_id = get_run_id()
    folder = Environment.read().log_dir
    if run_id is None:
        print("No active roscore", file=sys.stderr)
        print(folder)
        return 2
    print(folder / run_id)
    return 0


if __name__ == "__main__":
    sys.exit(main())
