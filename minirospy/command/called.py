"""Run a command's verb for a program that calls a ROS function such as `_rostopic_cmd_list(argv)`; raise its errors."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import NamedTuple

from minirospy.base.errors import (
    MasterUnreachableError,
    MessageException,
    MinirospyError,
    ROSException,
    ServiceException,
)
from minirospy.base.escape import escaped
from minirospy.command.command import complain, ros_words
from minirospy.command.parser import CommandLineError
from minirospy.command.verbs import Family

__all__ = ["Raised", "call_verb"]

_MAIN_ADDS = "ERROR: "  # the prefix that ROS's main functions print before an exception's text
_NO_NETWORK = (
    "Network communication failed"  # the message that the main functions of ROS print for a socket error
)


class Raised(NamedTuple):
    """A ROS module's exceptions: ``unreachable`` if the master does not respond, ``failed`` for any other failure."""

    failed: type[Exception]
    unreachable: type[Exception]


def call_verb(family: Family, words: Sequence[str], raised: Raised) -> int | None:
    """Run a command line, given without the command's name; return its verb's status.

    Raise one of the exceptions in ``raised`` if the verb fails, or ConnectionRefusedError if ROS's function does not
    catch the socket error. Exit after a usage error, and after an error that ROS's function prints itself.
    """
    try:
        return family._dispatch(list(words))
    except CommandLineError as error:
        sys.exit(complain(family.name, error, 2, error.ros_text))
    except (MinirospyError, ROSException, ServiceException, MessageException) as error:
        text, status = ros_words(error, family.wording)
        if text.startswith(_NO_NETWORK):
            raise ConnectionRefusedError(text) from error
        if text and not text.startswith(_MAIN_ADDS):
            print(escaped(text, "\n\t"), file=sys.stderr)
            sys.exit(status)
        is_unreachable = MasterUnreachableError in (type(error), type(error.__cause__))
        exception = raised.unreachable if is_unreachable else raised.failed
        raise exception(text.removeprefix(_MAIN_ADDS) or str(error)) from error
