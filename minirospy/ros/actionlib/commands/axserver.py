"""axserver.py: an action server on the terminal, for testing a client without a robot. The user enters the results.

Source: http://wiki.ros.org/actionlib (Tools). ROS's axserver.py opens a window; this one reads and prints lines.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from minirospy.base.clock import SignalSafeEvent
from minirospy.command.form import ask_for
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.ros.actionlib.commands.axclient import NodeParser, action_class, read_answer

if TYPE_CHECKING:
    from minirospy.ros.actionlib.actionlib import SimpleActionServer

__all__ = ["COMMAND", "main"]

_SLICE_SECONDS = 0.25
_CHOICES = "f(eedback) s(ucceed) a(bort) p(reempted)? "


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = NodeParser(
        "axserver.py",
        description="Serve an action; you answer each goal. Ends by Ctrl-C or the input's end.",
    )
    parser.add_argument("action", help="the server's name, as /run_led", completer="nothing")
    parser.add_argument("type", help="the action's type, as rpi_msgs/runningLed", completer="message_types")
    return parser


def _axserver(action: str, type: str) -> None:
    from minirospy import client as rospy
    from minirospy.core.idl.message_text import strify_message
    from minirospy.ros.actionlib.actionlib import SimpleActionServer

    cls = action_class(type)
    rospy.init_node("axserver", anonymous=True, disable_signals=True, disable_rosout=True)
    server = SimpleActionServer(action, cls, auto_start=False)
    news = SignalSafeEvent()
    server.register_goal_callback(news.set)
    server.register_preempt_callback(lambda: print("\nA client wants the goal preempted.", flush=True))
    server.start()
    print(f"Serving {rospy.resolve_name(action)} ({cls._type})", flush=True)
    while True:
        while not news.wait(_SLICE_SECONDS):
            # Wait in slices: a Ctrl-C that arrives just before a long wait would have no effect until the wait ends.
            pass
        news.clear()
        while server.is_new_goal_available():
            print(f"Goal:\n{strify_message(server.accept_new_goal())}", flush=True)
            if not _answer(server):
                return


def _answer(server: SimpleActionServer) -> bool:
    """Prompt the user for actions until the goal has ended. At end of input, abort the goal and return False."""
    types = server.action_server
    endings: dict[str, Callable[..., None]] = {
        "s": server.set_succeeded,
        "a": server.set_aborted,
        "p": server.set_preempted,
    }

    while True:
        try:
            choice = input(_CHOICES).strip().lower()[:1]
        except EOFError:
            server.set_aborted(text="the person who answered has left")
            return False

        if choice == "f":
            server.publish_feedback(ask_for(types.ActionFeedback().feedback, read_answer, _complain))
        elif choice in endings:
            result = ask_for(types.ActionResultType(), read_answer, _complain)
            endings[choice](result, read_answer("text ['']: "))
            return True


def _complain(error: Exception) -> None:
    print(error, file=sys.stderr)


COMMAND = Command("axserver.py", _parser, _axserver)
