"""`rosrun joint_state_publisher_gui joint_state_publisher_gui`: sliders in a browser or, without a display, in a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Any

from minirospy.base.keyboard import has_own_terminal
from minirospy.cli.dashboard import Serving, _main, _parser, _serve
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command

__all__ = ["JOINT_STATE_PUBLISHER_GUI", "main"]

_NAME = "joint_state_publisher_gui"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node; return its exit status.

    The sliders are shown on a web page if a browser can be opened. If there is neither a display nor a terminal, they
    are also on a page, whose link is printed. In all other cases, and if the page's libraries are missing, the sliders
    are in the terminal. ``--page`` and ``--terminal`` override this choice.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    if "--terminal" in words or not (_uses_page(words) and _has_libraries()):
        from minirospy.ros.robot_state_publisher.joint_publisher_gui import main as in_terminal

        return in_terminal()
    return _main(JOINT_STATE_PUBLISHER_GUI, words)


def _uses_page(words: Sequence[str]) -> bool:
    from minirospy.web.dashboard.browser import has_screen

    is_terminal = has_own_terminal(words)
    asks_for_page = any(word in ("--page", "-h", "--help") for word in words)
    return asks_for_page or not is_terminal or has_screen(os.environ)


def _has_libraries() -> bool:
    from minirospy.base.errors import BridgeError
    from minirospy.web.serve import require_libraries

    try:
        require_libraries()
    except BridgeError:
        return False
    return True


def _joint_parser() -> Parser:
    parser = _parser(_NAME, "Publishes joint_states, set by sliders in a browser.")
    parser.add_argument("--page", action="store_true", help="sliders in the browser, also without a screen")
    parser.add_argument("--terminal", action="store_true", help="sliders in this terminal")
    return parser


def _joint_body(*, page: bool, terminal: bool, arguments: Sequence[str] = (), **serving: Any) -> int:
    return _serve("joints", {}, Serving(**serving), arguments, node_name=_NAME)


JOINT_STATE_PUBLISHER_GUI = Command(_NAME, _joint_parser, _joint_body)
