"""`roscore` and `minirospy master`: run the master in the foreground, with the /rosout node.

Source: http://wiki.ros.org/roscore.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
import threading
import uuid
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import minirospy
from minirospy.base import private_files
from minirospy.base.environment import DISTRO, ROS_VERSION, Environment, is_local, is_own_host, wrong_address
from minirospy.base.errors import MinirospyError, RpcError, RpcFault, RpcTimeout, RpcUnreachable
from minirospy.base.log_levels import LEVEL_NAMES, set_logger_level
from minirospy.base.signal_dispatch import interrupt_signals
from minirospy.command.command import warn
from minirospy.command.parser import Misuse, Parser, attach_completer, split_assignments
from minirospy.command.verbs import Command
from minirospy.ros.rosout.node import RosoutNode
from minirospy.runtime.master.log_file import LogFile
from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.client import RpcClient
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.rpc.server import is_address_in_use
from minirospy.runtime.transport.access import Access, listening_lines
from minirospy.runtime.transport.loop import new_event_loop

__all__ = ["MASTER", "ROSCORE", "ROSMASTER", "main", "roscore", "rosmaster"]

_LOG_BYTES = 10 * 1024 * 1024

ANSWER_SECONDS = 4.0
"""Seconds to wait for a response from the master on a busy machine. A master that still reads its journal does not respond
yet, but already holds the journal's lock.
"""


class _Options(NamedTuple):
    """Options for starting a master."""

    verbose: bool
    quiet: bool
    no_journal: bool
    fresh: bool
    no_rosout: bool
    master_logger_level: str | None
    timeout: float


def roscore(argv: Sequence[str] | None = None) -> int:
    """Run the command `roscore`; return its exit status."""
    return ROSCORE.main(argv)


def rosmaster(argv: Sequence[str] | None = None) -> int:
    """Run the command `rosmaster`, a roscore without the /rosout node; return its exit status."""
    return ROSMASTER.main(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command `minirospy master`; return its exit status."""
    return MASTER.main(argv)


class _MasterParser(Parser):
    """Ignores remapping arguments, which a launch file may add."""

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Parse the arguments to a dict keyed by name. Raise CommandLineError if an argument is invalid."""
        return super().parse(split_assignments(words)[0])


def _parser(name: str) -> Parser:
    parser = _MasterParser(
        name,
        "Starts the ROS master, the parameter server and the /rosout node.",
        f"{name} [options]",
        about="roscore will start up a ROS Master, a ROS Parameter Server and a rosout logging node",
        ros_epilog="See http://wiki.ros.org/roscore",
    )

    add = parser.add_argument
    add("-p", "--port", type=int, help="master port. Only valid if master is launched")
    add("-v", dest="verbose", action="store_true", help="verbose printing")

    # Accept these options without effect: one event loop in one process serves all clients.
    parser.accept(
        "-w",
        "--numworkers",
        nargs=None,
        type=float,
        metavar="NUM_WORKERS",
        help="override number of worker threads",
    )
    add(
        "-t",
        "--timeout",
        type=float,
        default=3.0,
        help="override the socket connection timeout (in seconds).",
    )
    add(
        "--master-logger-level",
        choices=[name.lower() for name in LEVEL_NAMES.values()],
        metavar="MASTER_LOGGER_LEVEL",
        help="set rosmaster.master logger level ('debug', 'info', 'warn', 'error', 'fatal')",
    )

    parser.accept(
        "--sigint-timeout",
        nargs=None,
        type=float,
        metavar="SIGINT_TIMEOUT",
        help="the SIGINT timeout used when killing the core (in seconds).",
    )
    parser.accept(
        "--sigterm-timeout",
        nargs=None,
        type=float,
        metavar="SIGTERM_TIMEOUT",
        help="the SIGTERM timeout used when killing core if SIGINT does not stop the core (in seconds).",
    )

    _add_own_options(parser)
    return parser


def _add_own_options(parser: Parser) -> None:
    add = parser.own_options().add_argument
    add("--verbose", action="store_true", help="print each registration")
    add("-q", "--quiet", action="store_true", help="print nothing but errors and warnings")
    add("--status", action="store_true", help="print the state of the running master, and exit")
    allow = add(
        "--allow",
        action="append",
        default=[],
        metavar="NETWORK",
        help="only these may connect, as 192.168.65.0/24 (again for more; default: MINIROSPY_ALLOW, else all)",
    )
    attach_completer(allow, "nothing")

    add(
        "--local",
        action="store_true",
        help="listen on loopback and refuse other machines, as MINIROSPY_LOCAL=1 has it for nodes and commands too",
    )
    add(
        "--no-journal",
        action="store_true",
        help="keep no file of the graph: a master that is killed forgets it",
    )
    add("--fresh", action="store_true", help="start empty: ignore the journal of a master that was killed")
    add("--no-rosout", action="store_true", help="without the /rosout node, as rosmaster")

    parser.accept("--core", group=parser.own_options())


def _master(
    name: str,
    *,
    port: int | None,
    verbose: bool,
    quiet: bool,
    status: bool,
    allow: Sequence[str],
    local: bool,
    no_journal: bool,
    fresh: bool,
    no_rosout: bool,
    master_logger_level: str | None,
    timeout: float,
) -> int:
    environment = _environment(local=local)
    if port is None:
        port = environment.master_address[1]
    if not 0 <= port < 65536:
        raise Misuse(f"port {port} is not between 0 and 65535")
    if status:
        return _status(Environment.read(), port)
    if not timeout > 0:
        raise Misuse("the timeout is more than 0 seconds")
    if not all(each.strip(" ,") for each in allow):
        # Reject an empty value, for example from an unset variable: it would give every address access to the master.
        raise Misuse("--allow wants a network, as 192.168.65.0/24, or an address")

    if environment.local:
        _warn_of_contradictions(environment, allow, local=local)
    else:
        environment = environment._replace(allow=",".join(allow) or environment.allow)
    options = _Options(verbose, quiet, no_journal, fresh, no_rosout, master_logger_level, timeout)
    loop = new_event_loop()
    try:
        return loop.run_until_complete(_serve(name, environment, port, options))
    finally:
        loop.close()


def _environment(*, local: bool) -> Environment:
    """Return a master's environment. If ROS_MASTER_URI names another machine, use only its port."""
    environ = dict(os.environ)
    local = is_local(environ) or local
    environ.pop("MINIROSPY_LOCAL", None)
    environment = Environment.read(environ)
    return environment.on_this_machine() if local else environment


def _warn_of_contradictions(environment: Environment, allow: Sequence[str], *, local: bool) -> None:
    """If the master is local, warn in one line about options and variables meant for other machines."""
    asked = ["--allow"] if allow else []
    asked += [f"{name}={os.environ[name]}" for name in ("MINIROSPY_ALLOW",) if os.environ.get(name)]
    for name in ("ROS_HOSTNAME", "ROS_IP"):
        host = os.environ.get(name, "")
        if host and environment._replace(host=host).bind_host in ("0.0.0.0", "::"):
            asked.append(f"{name}={host}")

    if asked:
        how = "--local" if local else "MINIROSPY_LOCAL=1"
        warn(f"{how} keeps the master on this machine: {', '.join(asked)} has no effect")


async def _serve(name: str, environment: Environment, port: int, options: _Options) -> int:
    access = Access.parse(environment.allow)
    journal = None if options.no_journal or not port else environment.home / "master" / f"journal-{port}"
    master = Master(
        host=environment.uri_host,
        bind_host=environment.bind_host,
        port=port,
        journal=journal,
        fresh=options.fresh,
        access=access,
        timeout=options.timeout,
        max_clients=_max_clients(),
        same_host=environment.same_host,
        owns_process=True,
    )
    stop = _stop_event()
    try:
        await master.start()
    except OSError as error:
        raise _port_error(name, environment.host, port, journal, error) from error

    keep = True
    pid_file = environment.home / f"roscore-{master.port}.pid"
    try:
        _write_pid(pid_file)
        run_id = master.session or str(uuid.uuid1())
        log_file, master.log = _log_to_file(
            environment.log_dir / run_id, verbose=options.verbose, level=options.master_logger_level
        )
        for key, value in (("/run_id", run_id), ("/rosdistro", DISTRO), ("/rosversion", ROS_VERSION)):
            master.set_param("/roslaunch", key, value)

        where = listening_lines(environment.bind_host, master.port, access, local=environment.local)
        _announce(master, where, log_file, quiet=options.quiet)
        _warn_of_host(environment)
        if not options.quiet and name != "rosmaster":
            # Check in a thread, so that an unreachable DNS server does not delay the start.
            threading.Thread(target=_warn_of_uri, args=(environment, master), daemon=True).start()

        rosout = None
        if not options.no_rosout:
            rosout_file = log_file.with_name("rosout.log") if log_file else None
            rosout = RosoutNode(
                environment._replace(master_uri=master.uri), rosout_file, lambda: master.omits_topics
            )
        await _run(master, stop, rosout, run_id, quiet=options.quiet)
        keep = False
    finally:
        # Remove the pid file while this master still owns the port; later, the file may be the next master's.
        with contextlib.suppress(OSError):
            pid_file.unlink(missing_ok=True)
        await master.close(keep_journal=keep)

    if not options.quiet:
        _show("master stopped")
    return 0


def _announce(master: Master, where: Sequence[str], log_file: Path | None, *, quiet: bool) -> None:
    """Print and log the master's URI, the recovered state and the path of its log."""
    listening, *warnings = where
    if not quiet:
        logs = f"log file {log_file}" if log_file else "no log file"
        _show(f"minirospy {minirospy.__version__} master: pid {os.getpid()}, {logs}")
        _show("\n".join([listening, *master.news]))
        _show(f"ROS_MASTER_URI={master.uri}")
    if warnings:
        print("\n".join(warnings), file=sys.stderr, flush=True)

    for line in (*where, *master.news):
        logging.getLogger("minirospy.master").warning(line)


def _write_pid(path: Path) -> None:
    """Write the process id to a file for scripts, as ROS does."""
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with private_files.open_text(path, "w") as file:
            file.write(str(os.getpid()))


async def _run(
    master: Master, stop: asyncio.Event, rosout: RosoutNode | None, run_id: str, *, quiet: bool
) -> None:
    """Serve until the master is told to stop."""
    try:
        if rosout:
            await rosout.start()
            master.attach(rosout.node)
        if not quiet:
            _show(f"setting /run_id to {run_id}")
            core = "started core service [/rosout]; " if rosout else ""
            _show(f"{core}Ctrl-C stops the master")
        await _first(stop, master.stopped)
    finally:
        if rosout:
            await rosout.close()


def _status(environment: Environment, port: int) -> int:
    """Print one line about the running master. For ROS's rosmaster, get the data from the Master API."""
    host = environment.master_address[0]
    uri = f"http://{f'[{host}]' if ':' in host else host}:{port}"
    master = MasterProxy(uri, "/master_status")
    try:
        found = master.call("minirospy.status")
    except RpcFault:
        state = master.get_system_state()
        tables = (state.publishers, state.subscribers, state.services)
        nodes = {node for table in tables for names in table.values() for node in names}
        print(
            f"{uri} (not minirospy's): pid {master.get_pid()}, {len(nodes)} nodes, "
            f"{len(tables[0].keys() | tables[1].keys())} topics, {len(tables[2])} services, "
            f"{len(master.get_param_names())} parameters"
        )
        return 0
    finally:
        master.close()

    print(
        f"{uri}: pid {found['pid']}, up {_span(found['uptime'])}, {found['nodes']} nodes, {found['topics']} topics, "
        f"{found['services']} services, {found['parameters']} parameters, {found['clients']} clients, "
        f"{found['calls']} calls, {found['refused']} refused; journal: {found['journal']}"
    )
    return 0


def _span(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}"


def _warn_of_host(environment: Environment) -> None:
    """Warn if nodes cannot reach ROS_IP or ROS_HOSTNAME, usually an address in another network."""
    why = wrong_address(environment)
    if why:
        warn(f"{why} (`minirospy doctor` shows more)")


def _warn_of_uri(environment: Environment, master: Master) -> None:
    """Warn if ROS_MASTER_URI, which nodes from this terminal use, is another master's URI."""
    host, port = environment.master_address
    if port != master.port:
        what = f"port [{port}] does not match this roscore [{master.port}]"
    elif not is_own_host(host, environment.host):
        what = f"[{environment.master_uri}] host is not set to this machine"
    else:
        return
    warn(f"ROS_MASTER_URI {what}: nodes find it with ROS_MASTER_URI={master.uri.rstrip('/')}")


def _max_clients() -> int:
    """Raise the open-file limit; return the number of clients it allows, reserving some files for other uses."""
    if sys.platform == "win32":
        return 400
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 16384 if hard == resource.RLIM_INFINITY else min(hard, 16384)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            soft = wanted
    return max(50, (wanted if soft == resource.RLIM_INFINITY else soft) - 400)


def _stop_event() -> asyncio.Event:
    """Return an event that is set by Ctrl-C, SIGTERM or a closed terminal (SIGHUP, except under nohup)."""
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    numbers = [*interrupt_signals(), signal.SIGTERM]
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    for number in numbers:
        try:
            loop.add_signal_handler(number, stop.set)
        except NotImplementedError:
            # On Windows, the handler runs in this thread only after the event loop wakes up.
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop.set))
    if sys.platform == "win32":
        _keep_waking(loop)
    return stop


def _keep_waking(loop: asyncio.AbstractEventLoop) -> None:
    """Wake the loop twice a second, because Ctrl-C does not interrupt a select on Windows."""
    loop.call_later(0.5, _keep_waking, loop)


async def _first(*events: asyncio.Event) -> None:
    tasks = [asyncio.ensure_future(event.wait()) for event in events]
    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _port_error(name: str, host: str, port: int, journal: Path | None, error: OSError) -> MinirospyError:
    if not is_address_in_use(error):
        return MinirospyError(f"cannot listen on port {port}: {error.strerror or error}")
    uri = f"http://{host}:{port}"
    silence = ""
    try:
        RpcClient(f"http://127.0.0.1:{port}", timeout=ANSWER_SECONDS).call("getPid", "/roscore")
    except RpcError as failure:
        pid = _holder(journal) if journal and isinstance(failure, RpcUnreachable) else None
        if pid is None:
            late = f" or by a suspended master (no answer within {ANSWER_SECONDS:g} s)"
            return MinirospyError(
                f"port {port} is taken by another program{late if isinstance(failure, RpcTimeout) else ''}: "
                f"choose one with `{name} -p PORT`"
            )
        # The journal is still locked, so the master is running but does not respond.
        silence = (
            f"; it{f' (pid {pid})' if pid else ''} does not answer: it is suspended, or reads a large journal"
        )
    return MinirospyError(
        f"{name} cannot run as another roscore/master is already running. "
        f"Please kill other roscore/master processes before relaunching. The ROS_MASTER_URI is {uri}{silence}"
    )


def _holder(path: Path) -> int | None:
    """Return the pid of the master that holds a journal's lock (0: unknown), or None if it is not locked."""
    from minirospy.runtime.master.journal import Journal, JournalBusyError

    if not path.with_name(path.name + ".lock").exists():
        return None
    journal = Journal(path, list)
    try:
        journal.lock()
    except JournalBusyError as error:
        return error.pid
    except OSError:
        return None
    journal.close()
    return None


def _quiet(line: str) -> None:
    """Ignore a log line."""


class _Shown(logging.Handler):
    """Prints log records to stdout."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a log record."""
        _show(self.format(record))


def _show(line: str) -> None:
    """Print a line; ignore a closed stdout (`roscore -v | head`)."""
    with contextlib.suppress(OSError):
        # Print in a single write, because another thread may print the warning about ROS_MASTER_URI.
        print(f"{line}\n", end="", flush=True)


def _log_to_file(
    folder: Path, *, verbose: bool, level: str | None
) -> tuple[Path | None, Callable[[str], object]]:
    """Log to ``folder``/master.log. If possible, create a link ``latest`` to the folder, in the same parent folder.

    Return the file, and the function that logs registrations. If the file cannot be written, the master runs without a log.
    """
    path = folder / "master.log"
    logger = logging.getLogger("minirospy")
    set_logger_level(logger.name, level or "info")
    file = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = LogFile(path, _LOG_BYTES, "minirospy.master")
    except OSError as error:
        warn(f"cannot write logs to {folder}: {error.strerror or error}; set ROS_LOG_DIR")
    logger.addHandler(file or logging.NullHandler())

    record: Callable[[str], object] = file.line if file and logger.isEnabledFor(logging.INFO) else _quiet
    if verbose:
        logger.addHandler(_Shown())

        def record_and_show(line: str, record: Callable[[str], object] = record) -> None:
            record(line)
            _show(line)

        record = record_and_show
    if not file:
        return None, record

    latest = folder.parent / "latest"
    with contextlib.suppress(OSError):
        latest.unlink(missing_ok=True)
        latest.symlink_to(folder.name)
    return path, record


def _rosmaster(**options: Any) -> int:
    return _master("rosmaster", **{**options, "no_rosout": True})


ROSCORE = Command("roscore", partial(_parser, "roscore"), partial(_master, "roscore"))
ROSMASTER = Command("rosmaster", partial(_parser, "rosmaster"), _rosmaster)
MASTER = Command(
    "minirospy master", partial(_parser, "minirospy master"), partial(_master, "minirospy master")
)


if __name__ == "__main__":
    sys.exit(roscore())
