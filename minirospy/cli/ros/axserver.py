"""axserver.py: an action server at the terminal, whose person answers the goals: to try a client without a robot.

Source: http://wiki.ros.org/actionlib (Tools): there it is a window, here lines.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

from minirospy.cli.command import Parser, run
from minirospy.cli.ros.axclient import action_class, read_answer
from minirospy.cli.ros.form import ask_for

__all__ = ["main"]

_SLICE_SECONDS = 0.25
_CHOICES = "f(eedback) s(ucceed) a(bort) p(reempted)? "


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return run("axserver.py", lambda: _axserver(argv))


def _axserver(argv: Sequence[str] | None) -> None:
    parser = Parser(
        "axserver.py", description="Serve an action; you answer each goal. Ends by Ctrl-C or the input's end."
    )
    parser.add_argument("action", help="the server's name, as /run_led")
    parser.add_argument("type", help="the action's type, as rpi_msgs/runningLed")
    from minirospy import client as rospy
    from minirospy.actionlib import SimpleActionServer
    from minirospy.idl.message import strify_message

    options = parser.parse_args(rospy.myargv(argv)[0 if argv is not None else 1 :])
    cls = action_class(options.type)
    rospy.init_node("axserver", anonymous=True, disable_signals=True, disable_rosout=True)
    server = SimpleActionServer(options.action, cls, auto_start=False)
    news = threading.Event()
    server.register_goal_callback(news.set)
    server.register_preempt_callback(lambda: print("\nA client wants the goal preempted.", flush=True))
    server.start()
    print(f"Serving {rospy.resolve_name(options.action)} ({cls._type})", flush=True)
    while True:
        while not news.wait(_SLICE_SECONDS):
            # In slices: a Ctrl-C just before a wait would be seen at its end only.
            pass
        news.clear()
        while server.is_new_goal_available():
            print(f"Goal:\n{strify_message(server.accept_new_goal())}", flush=True)
            if not _answer(server):
                return


def _answer(server: Any) -> bool:
    """Ask what becomes of the goal until it has ended; False where the input ends: then it is aborted."""
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
