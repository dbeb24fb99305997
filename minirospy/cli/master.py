"""`roscore` and `minirospy master`: the master in the foreground, with the /rosout node beside it.

Source: http://wiki.ros.org/roscore.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
import uuid
from collections.abc import Sequence
from logging.handlers import RotatingFileHandler
from pathlib import Path

import minirospy
from minirospy.cli.command import Parser, run
from minirospy.environment import DEFAULT_MASTER_PORT, Environment
from minirospy.errors import MinirospyError, RpcError, RpcUnreachable
from minirospy.runtime.loop import new_event_loop
from minirospy.runtime.master import Master
from minirospy.runtime.rosout import RosoutNode
from minirospy.runtime.rpc_client import RpcClient
from minirospy.runtime.rpc_server import is_address_in_use

__all__ = ["main", "roscore"]

DISTRO = "noetic\n"
"""What /rosdistro says: the ROS 1 distribution whose behaviour is ours; with its line end, as ROS sets it."""

ROS_VERSION = "1.17.0\n"

_LOG_BYTES = 10 * 1024 * 1024


def roscore(argv: Sequence[str] | None = None) -> int:
    """The command `roscore`."""
    return _command("roscore", argv)


def main(argv: Sequence[str] | None = None) -> int:
    """The command `minirospy master`."""
    return _command("minirospy master", argv)


def _command(name: str, argv: Sequence[str] | None) -> int:
    parser = Parser(
        prog=name, description="Starts the ROS master, the parameter server and the /rosout node."
    )
    parser.add_argument(
        "-p", "--port", type=int, help=f"port (default: of ROS_MASTER_URI, else {DEFAULT_MASTER_PORT})"
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="print each registration")
    parser.add_argument("-q", "--quiet", action="store_true", help="print nothing but errors")
    # Options of ROS's roscore that ask for nothing here: one loop serves every client.
    parser.add_argument("--core", action="store_true", help="accepted for compatibility, without effect")
    parser.add_argument(
        "-w", "--numworkers", type=int, metavar="N", help="accepted for compatibility, without effect"
    )
    parser.add_argument(
        "-t", "--timeout", type=float, metavar="S", help="accepted for compatibility, without effect"
    )

    def body() -> int:
        arguments = [a for a in (sys.argv[1:] if argv is None else argv) if ":=" not in a]
        options = parser.parse_args(arguments)
        environment = Environment.read()
        port = environment.master_address[1] if options.port is None else options.port
        if not 0 <= port < 65536:
            parser.error(f"port {port} is not between 0 and 65535")
        loop = new_event_loop()
        try:
            return loop.run_until_complete(
                _serve(name, environment, port, verbose=options.verbose, quiet=options.quiet)
            )
        finally:
            loop.close()

    return run(name, body)


async def _serve(name: str, environment: Environment, port: int, *, verbose: bool, quiet: bool) -> int:
    master = Master(host=environment.host, bind_host=environment.bind_host, port=port)
    stop = _stop_event()
    try:
        await master.start()
    except OSError as error:
        raise _port_error(name, environment.host, port, error) from error
    run_id = str(uuid.uuid1())
    log_file = _log_to_file(environment.log_dir / run_id, verbose=verbose)
    for key, value in (("/run_id", run_id), ("/rosdistro", DISTRO), ("/rosversion", ROS_VERSION)):
        master.parameters.set(key, value, "/roslaunch")
    if not quiet:
        print(f"minirospy {minirospy.__version__} master: pid {os.getpid()}, log file {log_file}")
        print(f"ROS_MASTER_URI={master.uri}", flush=True)
    rosout = RosoutNode(Environment.read(master_uri=master.uri), log_file.parent / "rosout.log")
    try:
        await rosout.start()
        if not quiet:
            print(f"setting /run_id to {run_id}")
            print("started core service [/rosout]; Ctrl-C stops the master", flush=True)
        await _first(stop, master.stopped)
    finally:
        await rosout.close()
        await master.close()
    if not quiet:
        print("master stopped", flush=True)
    return 0


def _stop_event() -> asyncio.Event:
    """Set by SIGINT or SIGTERM."""
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, stop.set)
        except NotImplementedError:
            # Windows: the handler runs in the main thread, the loop's own, once it wakes up.
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop.set))
    if sys.platform == "win32":
        _keep_waking(loop)
    return stop


def _keep_waking(loop: asyncio.AbstractEventLoop) -> None:
    """On Windows a select does not end at Ctrl-C: look twice a second."""
    loop.call_later(0.5, _keep_waking, loop)


async def _first(*events: asyncio.Event) -> None:
    tasks = [asyncio.ensure_future(event.wait()) for event in events]
    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _port_error(name: str, host: str, port: int, error: OSError) -> MinirospyError:
    if not is_address_in_use(error):
        return MinirospyError(f"cannot listen on port {port}: {error.strerror or error}")
    uri = f"http://{host}:{port}"
    try:
        RpcClient(f"http://127.0.0.1:{port}", timeout=2.0).call("getPid", "/roscore")
    except (RpcUnreachable, RpcError):
        return MinirospyError(f"port {port} is taken by another program: choose one with `{name} -p PORT`")
    return MinirospyError(
        f"{name} cannot run as another roscore/master is already running. "
        f"Please kill other roscore/master processes before relaunching. The ROS_MASTER_URI is {uri}"
    )


def _log_to_file(folder: Path, *, verbose: bool) -> Path:
    """Log to ``folder``/master.log; ``latest`` beside the folder points to it where links are allowed."""
    path = folder / "master.log"
    logger = logging.getLogger("minirospy")
    logger.setLevel(logging.INFO)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handler: logging.Handler = RotatingFileHandler(
            path, maxBytes=_LOG_BYTES, backupCount=3, encoding="utf-8", delay=True
        )
    except OSError as error:
        raise MinirospyError(f"cannot write logs to {folder}: {error}; set ROS_LOG_DIR") from error
    handler.setFormatter(logging.Formatter("[%(name)s][%(levelname)s] %(asctime)s: %(message)s"))
    logger.addHandler(handler)
    if verbose:
        logger.addHandler(logging.StreamHandler(sys.stdout))
    latest = folder.parent / "latest"
    with contextlib.suppress(OSError):
        latest.unlink(missing_ok=True)
        latest.symlink_to(folder.name)
    return path


if __name__ == "__main__":
    sys.exit(roscore())
