"""axclient.py: send a goal to an action server from the terminal, with a form generated from the goal's type.

Source: http://wiki.ros.org/actionlib (Tools). ROS's axclient.py opens a window; this one reads and prints lines, so
scripts can also use it.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import ROSException, UsageError
from minirospy.command.form import ask_for, fields, flow
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Action, Message
    from minirospy.ros.actionlib.actionlib import SimpleActionClient

__all__ = ["COMMAND", "action_class", "main", "read_answer"]

_BAR = 30
_CANCEL_SECONDS = 10.0
_SLICE_SECONDS = 0.25


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0 if the goal succeeded."""
    return COMMAND.main(argv)


class NodeParser(Parser):
    """A parser that skips remapping arguments, because the node parses them."""

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Parse the arguments to a dict keyed by name. Raise CommandLineError if an argument is invalid."""
        from minirospy import client as rospy

        return super().parse(rospy.myargv(["", *words])[1:])


def _parser() -> Parser:
    parser = NodeParser(
        "axclient.py",
        description="Send a goal to an action server: prompt for each field, show the feedback, print the result. "
        "Ctrl-C cancels the goal.",
    )

    parser.add_argument("action", help="the server's name, as /run_led", completer="nothing")
    parser.add_argument(
        "type",
        nargs="?",
        help="the action's type, as rpi_msgs/runningLed; found by the server's topics",
        completer="message_types",
    )
    parser.add_argument(
        "goal",
        nargs="?",
        help="the goal as YAML, instead of the questions: '{numberOfRuns: 3}'",
        completer="nothing",
    )
    parser.add_argument("-t", "--timeout", type=float, metavar="SEC", help="how long to wait for the server")
    return parser


def _axclient(action: str, type: str | None, goal: str | None, timeout: float | None) -> int:
    from minirospy import client as rospy

    if goal is None and type and type.lstrip().startswith("{"):
        type, goal = None, type
    # Disable signal handlers, so that Ctrl-C cancels the goal before the node shuts down.
    rospy.init_node("axclient", anonymous=True, disable_signals=True, disable_rosout=True)
    name = rospy.resolve_name(action)
    cls = action_class(type or _found_type(name, timeout))
    from minirospy.ros.actionlib.actionlib import SimpleActionClient

    client = SimpleActionClient(name, cls)
    if not client.wait_for_server(rospy.Duration.from_sec(0.5)):
        print(f"Waiting for an action server at {name} ...", flush=True)
        if not client.wait_for_server(rospy.Duration.from_sec(timeout or 0.0)):
            raise ROSException(f"no action server at {name}")
    message = client.action_client.ActionGoal().goal
    if goal is not None:
        from minirospy.introspect.messages import check, fill
        from minirospy.introspect.values import parse_value

        check(fill(message, [parse_value(goal)]))
    else:
        ask_for(message, read_answer, _complain)
    return _Progress(client, message).run()


def action_class(type_: str) -> type[Action]:
    """Return the action class for a type in either form: ``rpi_msgs/runningLed`` or ``rpi_msgs/runningLedAction``.

    Raise NotFoundError if there is no such action.
    """
    from minirospy.core.idl.load import get_message_class, message_class

    name = type_.replace("/msg/", "/").replace("/action/", "/")
    found = get_message_class(name)
    if found is None or not hasattr(found, "action_goal"):
        found = message_class(name if name.endswith("Action") else name + "Action")
    return cast("type[Action]", found)


def read_answer(question: str) -> str:
    """Prompt for a line and return it; return "" at end of input."""
    try:
        return input(question)
    except EOFError:
        return ""


def _complain(error: Exception) -> None:
    if not sys.stdin.isatty():
        raise error
    print(error, file=sys.stderr)


def _found_type(action: str, timeout: float | None) -> str:
    """Wait for the action's server and return the action's type. Raise ROSException after ``timeout`` seconds."""
    from minirospy.introspect.graph import Graph

    waiting = SignalSafeEvent()
    waited = 0.0
    with Graph.open("axclient") as graph:
        while True:
            type_ = graph.master.get_topic_types().get(action + "/goal", "")
            if type_.endswith("ActionGoal"):
                return type_[: -len("Goal")]
            if type_ not in ("", "*"):
                raise UsageError(f"{action} is not an action: {action}/goal is of type {type_}")
            if not waited:
                print(f"Waiting for an action server at {action} ...", flush=True)
            if timeout is not None and waited >= timeout:
                raise ROSException(f"no action server at {action}")
            waiting.wait(0.25)
            waited += 0.25


class _Progress:
    """Tracks a running goal: prints its state and feedback, and cancels the goal on Ctrl-C."""

    def __init__(self, client: SimpleActionClient, goal: Message) -> None:
        self._client = client
        self._goal = goal
        self._done = SignalSafeEvent()
        self._lock = threading.Lock()
        self._is_line_open = False
        self._is_active = False

    def run(self) -> int:
        """Send the goal, wait until it ends, and return the exit status."""
        from actionlib_msgs.msg import GoalStatus

        from minirospy.core.idl.message_text import strify_message

        client = self._client
        self._tell("Sent")
        try:
            client.send_goal(self._goal, self._on_done, self._on_active, self._on_feedback)
            # Wait in slices: a Ctrl-C that arrives just before a long wait would have no effect until the wait ends.
            while not self._done.wait(_SLICE_SECONDS):
                pass
        except KeyboardInterrupt:
            self._tell("Cancelling (Ctrl-C again: leave)")
            client.cancel_goal()
            if not self._done.wait(_CANCEL_SECONDS):
                raise ROSException("the server does not end the goal") from None
        state = client.get_state()
        names = {value: name for name, value in vars(GoalStatus).items() if name.isupper()}
        text = client.get_goal_status_text()
        self._tell(names.get(state, str(state)).capitalize() + (f": {text}" if text else ""))
        result = client.get_result()
        if result is not None and result.__slots__:
            print(strify_message(result), flush=True)
        return 0 if state == GoalStatus.SUCCEEDED else 1

    def _on_done(self, state: int, result: Message) -> None:
        self._done.set()

    def _on_active(self) -> None:
        with self._lock:
            is_first, self._is_active = not self._is_active, True
        if is_first:
            self._tell("Active")

    def _on_feedback(self, feedback: Message) -> None:
        # Feedback arrives on a separate connection, possibly before the status.
        self._on_active()
        line = "Feedback: " + ", ".join(f"{field.path}: {flow(field.value)}" for field in fields(feedback))
        share = progress(self._goal, feedback)
        if share is not None:
            full = round(_BAR * share)
            line += f"  [{'#' * full}{'.' * (_BAR - full)}] {share:.0%}"
        self._tell(line, replaces=True)

    def _tell(self, line: str, *, replaces: bool = False) -> None:
        """Print a line. On a terminal, feedback overwrites the previous feedback."""
        with self._lock:
            on_terminal = sys.stdout.isatty()
            if self._is_line_open and not replaces:
                print()
            self._is_line_open = on_terminal and replaces
            if self._is_line_open:
                print(f"\r\033[K{line}", end="", flush=True)
            else:
                print(line, flush=True)


def progress(goal: Message, feedback: Message) -> float | None:
    """Return the progress from 0 to 1, or None if it is unknown.

    The progress is known if the goal and the feedback each have one number, and the feedback's number is between 0 and the
    goal's.
    """
    wanted, reached = (
        [cast("float", field.value) for field in fields(message) if type(field.value) in (int, float)]
        for message in (goal, feedback)
    )
    if len(wanted) != 1 or len(reached) != 1 or not 0 <= reached[0] <= wanted[0] or not wanted[0]:
        return None
    return float(reached[0] / wanted[0])


COMMAND = Command("axclient.py", _parser, _axclient)
