"""init_node: the steps that turn a process into a node.

Source: http://wiki.ros.org/rospy/Overview/Initialization%20and%20Shutdown.
"""

from __future__ import annotations

import atexit
import functools
import logging
import os
import signal
import sys
import warnings
from collections.abc import Mapping, Sequence

from minirospy.base import names
from minirospy.base.clock import SILENT_CLOCK, SimulatedClock, wait_for_event
from minirospy.base.environment import wrong_address
from minirospy.base.errors import MasterUnreachableError, ROSException, ROSInitException, RpcError, RpcFault
from minirospy.client import log_setup
from minirospy.client.exit_messages import suppress_tracebacks
from minirospy.client.identity import private_parameters
from minirospy.client.session import Session, current_session, replace_session_in_fork
from minirospy.client.subscriber import Subscriber

__all__ = ["init_node", "start_clock"]

_POLL_SECONDS = 0.25

_log = logging.getLogger("rosout")


def init_node(
    name: str,
    argv: Sequence[str] | None = None,
    anonymous: bool = False,
    log_level: int | None = None,
    disable_rostime: bool = False,
    disable_rosout: bool = False,
    disable_signals: bool = False,
    xmlrpc_port: int = 0,
    tcpros_port: int = 0,
) -> None:
    """Make this process the node ``name``; wait for a master.

    ``anonymous`` appends a number, so that several nodes with the same name can run. ``log_level``: rospy.DEBUG to
    rospy.FATAL. Raise ValueError if the name is empty or has a namespace, ROSException if called again with other
    arguments, ROSInitException if the node cannot be set up, ROSInterruptException if it is shut down while it waits.
    """
    _check_name(name)
    session = current_session()
    argv = list(sys.argv if argv is None else argv)
    arguments = (name, argv, anonymous, log_level, disable_rostime, disable_signals)
    if _is_repeated(session, arguments):
        return
    _warn_of_name(name)

    session.init_arguments = arguments
    session.identity.take_name(name, argv, anonymous)
    parameters = private_parameters(session.identity.arguments)

    _release_previous(session)
    _install_process_hooks()
    if not disable_signals:
        session.signals.install()
    if session.is_shutdown():
        raise session.lifecycle.interrupted("rospy shutdown")

    log_setup.configure(session, log_level, session.identity.arguments.special.get("__log"))
    session.open_node(xmlrpc_port, tcpros_port)
    _wait_for_master(session)
    _set_parameters(session, parameters)
    if not disable_rostime:
        start_clock()
    session.has_time = True
    _leave_with_child_process()
    session.publish_node()
    log_setup.start(session, rosout=not disable_rosout)
    if why := wrong_address(session.identity.environment):
        _log.warning("%s: other nodes may not reach this one", why)


def start_clock() -> None:
    """Follow /clock if the master's /use_sim_time is set. Raise ROSInitException if the master fails."""
    session = current_session()
    try:
        is_simulated = session.master.has_param("/use_sim_time") and session.master.get_param("/use_sim_time")
    except RpcError as error:
        raise ROSInitException(f"the master does not return /use_sim_time: {error}") from error
    if is_simulated:
        clock = session.clock = SimulatedClock(
            changed=session.time_changed, on_silence=lambda: _log.warning("%s", SILENT_CLOCK)
        )
        session.when_ready(lambda: _follow_clock_topic(clock))


def _check_name(name: str) -> None:
    if not name:
        raise ValueError("name must not be empty")
    if "/" in name:
        raise ValueError("namespaces are not allowed in node names")


def _is_repeated(session: Session, arguments: tuple[object, ...]) -> bool:
    """Return whether init_node was called before with the same arguments.

    Raise ROSException if the arguments were different.
    """
    if session.init_arguments is None:
        return False
    if session.init_arguments != arguments:
        raise ROSException(
            "rospy.init_node() has already been called with different arguments: "
            + str(session.init_arguments)
        )
    return True


def _warn_of_name(name: str) -> None:
    if not names.is_legal_base_name(name):
        warnings.warn(
            f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
            stacklevel=4,
        )


def _release_previous(session: Session) -> None:
    """Remove everything that the process's previous node installed, such as its log handlers."""
    for release in session.on_replaced:
        release()
    session.on_replaced.clear()


@functools.cache
def _install_process_hooks() -> None:
    """Install the hooks for exit, forks and interrupts, once for all sessions in the process."""
    suppress_tracebacks(_is_interrupt)
    atexit.register(lambda: current_session().shut_down_at_exit())
    if sys.platform != "win32":
        mask: list[set[signal.Signals | int]] = []

        # Block signals during a fork: Python drops one that reaches the child too early, and Pool.terminate() then waits forever.
        def block_signals() -> None:
            mask.append(signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM}))

        def restore_signals() -> None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask.pop())

        def start_child() -> None:
            replace_session_in_fork()
            restore_signals()

        os.register_at_fork(before=block_signals, after_in_parent=restore_signals, after_in_child=start_child)


def _leave_with_child_process() -> None:
    """Shut the node down when the function of a multiprocessing.Process returns.

    Such a process calls multiprocessing's finalizers, but in some versions of Python no atexit functions.
    """
    process, util = (sys.modules.get(f"multiprocessing.{name}") for name in ("process", "util"))
    if process and util and process.parent_process() is not None:
        # Use a high priority: as with atexit, the node must leave the graph before the process joins its own children.
        util.Finalize(None, lambda: current_session().shut_down_at_exit(), exitpriority=100)


def _is_interrupt(error: BaseException) -> bool:
    return current_session().lifecycle.is_interrupt(error)


def _wait_for_master(session: Session) -> None:
    """Wait until the master responds. Print a message once if it does not respond.

    Raise ROSInterruptException if the node shuts down.
    """
    uri = session.identity.environment.master_uri
    is_reported = False

    while not session.lifecycle.is_shutdown_requested:
        try:
            session.master.get_pid()
        except MasterUnreachableError as error:
            if not is_reported:
                hint = f"({error.cause}.)" if error.cause else "(Start one with `roscore`.)"
                print(
                    f"Unable to register with master node [{uri}]: master may not be running yet. Will keep trying. {hint}",
                    file=sys.stderr,
                    flush=True,
                )
                is_reported = True
            if wait_for_event(session.lifecycle.shutting_down, _POLL_SECONDS):
                break
        except RpcFault:
            return  # some masters, such as @foxglove/ros1's, do not support this call
        except RpcError as error:
            raise ROSInitException(f"what answers at {uri} is not a ROS master: {error}") from error
        else:
            return

    raise session.lifecycle.interrupted(f"shut down while waiting for the master at {uri}")


def _set_parameters(session: Session, parameters: Mapping[str, object]) -> None:
    """Set the private parameters from the command line."""
    for key, value in parameters.items():
        session.master.set_param(names.resolve("~" + key, session.name), value)


def _follow_clock_topic(clock: SimulatedClock) -> None:
    """Set ``clock`` from /clock (rosgraph_msgs/Clock)."""
    from rosgraph_msgs.msg import Clock

    def on_clock(message: Clock) -> None:
        clock.set(message.clock.to_nsec())

    Subscriber("/clock", Clock, on_clock, queue_size=1)
