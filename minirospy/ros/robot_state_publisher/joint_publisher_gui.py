"""joint_state_publisher_gui for the terminal: joint_state_publisher with sliders controlled by keys.

Without a terminal, as in roslaunch, it publishes the zeros and the joint states from its sources.
Source: http://wiki.ros.org/joint_state_publisher_gui.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy import client as rospy
from minirospy.base.escape import escaped, own_output
from minirospy.base.keyboard import Keys, has_own_terminal
from minirospy.ros.robot_state_publisher.joint_publisher import JointPublisher, run_node
from minirospy.ros.robot_state_publisher.sliders import HINT, Row, Sliders

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = ["main"]

_QUIT = ("q", "\x04")
_OTHER_LINES = 6  # number of screen lines besides the sliders: the frame, the hint and the shell prompt


def main() -> int:
    """Run the node until it shuts down or `q` is pressed; return 1 if there are no joints, else 0."""
    return run_node("joint_state_publisher_gui", _run)


def _run() -> None:
    publisher = JointPublisher()
    if not has_own_terminal(sys.argv):
        rospy.loginfo(
            "no terminal: the joints stay at their zeros. `rosrun joint_state_publisher_gui joint_state_publisher_gui` in a "
            "separate terminal shows sliders"
        )
        publisher.loop()
        return
    threading.Thread(target=_publish, args=(publisher,), daemon=True).start()
    _show(publisher)
    rospy.signal_shutdown("quit")


def _publish(publisher: JointPublisher) -> None:
    try:
        publisher.loop()
    except rospy.ROSInterruptException:
        pass


def _show(publisher: JointPublisher) -> None:
    """Draw the sliders and handle keys until the node shuts down or `q` is pressed."""
    from rich.console import Console
    from rich.live import Live

    sliders = Sliders(publisher.joints.free)
    console = Console(file=own_output())
    shown: list[Row] = []
    with Keys() as keys, Live(console=console, auto_refresh=False) as live:
        key = ""
        while key not in _QUIT and not rospy.is_shutdown():
            with publisher.lock:
                if key:
                    sliders.press(key)
                rows = sliders.rows(max(console.height - _OTHER_LINES, 1))
            if rows != shown or not shown:
                shown = rows
                live.update(_picture(rows), refresh=True)
            key = keys.next()


def _picture(rows: Sequence[Row]) -> RenderableType:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    if not rows:
        return Text("this robot has no joint that can be set; q: quit")
    table = Table.grid(padding=(0, 2))
    for row in rows:
        style = "bold reverse" if row.is_selected else ""
        cells = (">" if row.is_selected else " ", row.name, f"[{row.bar}]", row.text)
        table.add_row(*(Text(escaped(cell), style=style) for cell in cells))
    return Group(table, Text(HINT, style="dim"))
