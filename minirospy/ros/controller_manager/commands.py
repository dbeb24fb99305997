"""``rosrun controller_manager controller_manager`` and ``controller_group``: call the manager's services on the command line.

Source: http://wiki.ros.org/controller_manager.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence

from controller_manager_msgs.srv import ListControllers

from minirospy import client as rospy
from minirospy.ros.controller_manager import interface as manager

__all__ = ["main", "main_of_groups", "new_group_parser"]

_USAGE = """Commands:
    load <name>          - Load the controller named <name>
    unload <name>        - Unload the controller named <name>
    start <name>         - Start the controller named <name>
    stop <name>          - Stop the controller named <name>
    spawn <name>         - Load and start the controller named <name>
    kill <name>          - Stop and unload the controller named <name>
    list                 - List active controllers
    list-types           - List controller Types
    reload-libraries     - Reloads all plugin controller libraries"""

_EACH: dict[str, tuple[Callable[[str], object], ...]] = {
    "load": (manager.load_controller,),
    "unload": (manager.unload_controller,),
    "start": (manager.start_controller,),
    "stop": (manager.stop_controller,),
    "spawn": (manager.load_controller, manager.start_controller),
    "sp": (manager.load_controller, manager.start_controller),
    "kill": (manager.stop_controller, manager.unload_controller),
    "kl": (manager.stop_controller, manager.unload_controller),
}
"""Commands that take names. Each function runs for all names before the next function starts."""

_SERVICE_SECONDS = 5


def main() -> int:
    """Run ``controller_manager``; return 1 for an unknown command, but 0 even if the manager reports an error."""
    words = rospy.myargv()[1:]
    try:
        rospy.init_node("controller_manager", anonymous=True)
        if not words:
            print(_USAGE)
            return 0
        command, *names = words
        if command in ("list-types", "lt"):
            manager.list_controller_types()
        elif command in ("list", "lc"):
            manager.list_controllers()
        elif command == "reload-libraries":
            manager.reload_libraries(True, restore="--restore" in names)
        elif command in _EACH:
            for function in _EACH[command]:
                for name in names:
                    function(name)
        else:
            print(_USAGE)
            return 1
    except rospy.ROSInterruptException:
        pass
    except rospy.ServiceException as error:
        rospy.logerr("%s", error)
        return 1
    return 0


def new_group_parser() -> argparse.ArgumentParser:
    """Return the parser for ``controller_group``."""
    parser = argparse.ArgumentParser(prog="controller_group", description="Controller Group Utility")
    commands = parser.add_subparsers(title="Commands", metavar="", dest="command")
    commands.add_parser("list", help="list available groups")
    spawn = commands.add_parser(
        "spawn", help="load all controllers in all groups and start controllers in the specified group"
    )
    spawn.add_argument("group", help="name of the group to start")
    switch = commands.add_parser("switch", help="switch to the specified group")
    switch.add_argument("group", help="name of the group to switch to")
    return parser


def main_of_groups(argv: Sequence[str] | None = None) -> int:
    """Run ``controller_group``; return 1 if the command or a controller manager is missing."""
    parser = new_group_parser()
    arguments = parser.parse_args(rospy.myargv()[1:] if argv is None else argv)
    if arguments.command is None:
        parser.print_usage()
        return 1
    groups = rospy.get_param("controller_groups", {})
    if not isinstance(groups, dict):
        groups = {}
    try:
        if arguments.command == "list":
            _print_groups(groups)
        else:
            _use_group(groups, arguments.group, arguments.command == "switch")
    except (rospy.ROSException, rospy.ServiceException) as error:
        rospy.logerr("%s", error)
        return 1
    return 0


def _print_groups(groups: dict[str, Sequence[str]]) -> None:
    print(f"Number of groups: {len(groups)}")
    for group, controllers in sorted(groups.items()):
        print(f"  {group}")
        for controller in controllers:
            print(f"      {controller}")


def _use_group(groups: dict[str, Sequence[str]], group: str, is_switch: bool) -> None:
    """Load and start a group's controllers. If ``is_switch``, skip running ones and stop the other groups' controllers."""
    wanted = list(dict.fromkeys(groups.get(group, ())))
    if not wanted:
        rospy.logerr(f"There is no controller defined in group {group}")
        return
    if not is_switch:
        for name in wanted:
            manager.load_controller(name)
        for name in wanted:
            manager.start_controller(name)
        return

    running = _running_of_loaded()
    for name in wanted:
        if name not in running and not manager.load_controller(name):
            print("Cancel group switching")
            return
    others = dict.fromkeys(name for names in groups.values() for name in names if name not in wanted)
    manager.start_stop_controllers(_where(wanted, running, False), _where(others, running, True))


def _where(names: Iterable[str], running: dict[str, bool], is_running: bool) -> list[str]:
    return [name for name in names if running.get(name, False) is is_running]


def _running_of_loaded() -> dict[str, bool]:
    """Map each loaded controller's name to whether the controller is running."""
    rospy.wait_for_service("controller_manager/list_controllers", timeout=_SERVICE_SECONDS)
    found = {}
    for each in rospy.ServiceProxy("controller_manager/list_controllers", ListControllers)().controller:
        found[each.name] = each.state == "running"
        if each.state not in ("running", "stopped"):
            rospy.logerr(f"Unknown controller state {each.state}")
    return found
