"""Runs nodes on other machines. ssh starts a roslaunch on each machine, which runs the nodes there and reports events.

The two processes use ROS 1's calls, so either may be a real roslaunch: the child calls ``register``, ``log`` and
``process_died`` of the parent; the parent calls ``launch`` and ``shutdown`` of the child. Source:
http://wiki.ros.org/roslaunch/Architecture, http://wiki.ros.org/roslaunch/XML/machine.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import shlex
import subprocess
import threading
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, cast

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.environment import Environment
from minirospy.base.errors import LaunchError, MinirospyError, RpcError, RpcFault
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Process, Timeouts, end_processes, start_process
from minirospy.ros.roslaunch.launcher.spec import MachineSpec, NodeSpec
from minirospy.runtime.rpc.client import RpcClient
from minirospy.runtime.rpc.master_proxy import unwrap
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.loop import LoopThread

__all__ = ["Api", "Method", "RemoteMachines", "call", "launch_text"]

_CALL_SECONDS = 15.0
_SHUTDOWN_SECONDS = 5.0


class Monitor(Protocol):
    """The launcher's methods that RemoteMachines calls."""

    def guard(self, process: Process) -> None:
        """Ensure that the process is terminated even if roslaunch is killed."""

    def remote_ended(self, node: NodeSpec | None, name: str, code: int) -> None:
        """Report that a process on another machine has exited."""


Method = Callable[..., object]


class Api:
    """Serves XML-RPC methods (``{name: function}``), run in worker threads, with results wrapped as in ROS."""

    def __init__(self, environment: Environment, methods: Mapping[str, Method]) -> None:
        self._methods = dict(methods)
        self._loop = LoopThread("roslaunch-server")
        self._server = RpcServer(
            self._dispatch,
            bind_host=environment.bind_host,
            ports=environment.ports,
            access=Access.parse(environment.allow),
        )
        self._loop.run(self._server.start())
        self.uri = f"http://{environment.uri_host}:{self._server.port}/"

    def close(self) -> None:
        """Stop the server. Idempotent."""
        with contextlib.suppress(TimeoutError, RuntimeError):
            self._loop.run(self._server.close(), 2.0)
        self._loop.close()

    def _dispatch(self, method: str, args: Sequence[object]) -> Awaitable[list[object]]:
        function = self._methods.get(method)
        if function is None:
            raise RpcFault(1, f'method "{method}" is not supported')
        return self._answer(function, args)

    async def _answer(self, function: Method, args: Sequence[object]) -> list[object]:
        try:
            return [1, "success", await asyncio.to_thread(function, *args)]
        except (MinirospyError, TypeError, ValueError) as error:
            return [-1, str(error), 0]


def call(uri: str, method: str, *args: object, timeout: float = _CALL_SECONDS) -> object:
    """Call a method on another roslaunch process. Raise RpcError if the call fails."""
    client = RpcClient(uri, timeout)
    try:
        return unwrap(method, client.call(method, *args))
    finally:
        client.close()


@dataclass(eq=False)
class _Child:
    """The roslaunch process on one machine."""

    name: str
    machine: MachineSpec
    nodes: list[NodeSpec]
    ssh: Process
    uri: str = ""
    has_registered: threading.Event = field(default_factory=SignalSafeEvent)
    running: set[str] = field(default_factory=set)
    ended: set[str] = field(default_factory=set)
    """Names of exited processes. A process may exit before ``launch`` has reported that it has started."""


class RemoteMachines:
    """The roslaunch processes on other machines."""

    def __init__(
        self, environment: Environment, run_id: str, output: Output, timeouts: Timeouts, monitor: Monitor
    ) -> None:
        self._environment = environment
        self._run_id = run_id
        self._output = output
        self._timeouts = timeouts
        self._monitor = monitor
        self._children: dict[str, _Child] = {}
        self._api: Api | None = None

    @property
    def is_running(self) -> bool:
        """Return whether a node is running on another machine."""
        return any(child.running and child.ssh.is_running for child in self._children.values())

    def start(self, nodes: Sequence[tuple[NodeSpec, MachineSpec]]) -> None:
        """Start nodes on their machines. Raise LaunchError if a machine cannot be reached."""
        if self._environment.master_address[0] in ("localhost", "127.0.0.1", "::1"):
            self._output.warn(
                f"WARNING: ROS_MASTER_URI [{self._environment.master_uri}] means another master on another machine: "
                "set it, and ROS_HOSTNAME, to this machine's name or address"
            )

        api = Api(
            self._environment,
            {
                "register": self._register,
                "log": self._log,
                "process_died": self._process_died,
                "get_pid": os.getpid,
                "list_processes": lambda: [[], []],
                "get_node_names": lambda: [node.name for node, _ in nodes],
            },
        )
        self._api = api
        self._output.print(f"started roslaunch server {api.uri}", bold=True)

        by_machine: dict[tuple[str, str, int, str], list[tuple[NodeSpec, MachineSpec]]] = {}
        for node, machine in nodes:
            key = (machine.address, machine.user, machine.ssh_port, machine.env_loader)
            by_machine.setdefault(key, []).append((node, machine))
        for number, group in enumerate(by_machine.values()):
            machine = group[0][1]
            name = f"{machine.address}-{number}"
            self._output.print(f"remote[{name}] starting roslaunch")
            ssh = self._start_ssh(name, machine, api.uri)
            self._children[name] = _Child(name, machine, [node for node, _ in group], ssh)
        for child in self._children.values():
            self._launch(child)

    def close(self) -> None:
        """Terminate the nodes and the roslaunch processes on the other machines. Idempotent."""
        for child in self._children.values():
            self._output.print(f"[{child.name}] killing on exit")
        threads = [
            threading.Thread(target=self._end, args=(child,), daemon=True)
            for child in self._children.values()
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self._children.clear()
        if self._api:
            self._api.close()
            self._api = None

    def _start_ssh(self, name: str, machine: MachineSpec, uri: str) -> Process:
        where = f"{machine.user}@{machine.address}" if machine.user else machine.address
        user = f", user[{machine.user}]" if machine.user else ""
        self._output.print(
            f"remote[{name}]: creating ssh connection to {machine.address}:{machine.ssh_port}{user}"
        )
        if machine.password:
            self._output.warn(
                f"WARNING: {machine.file}:{machine.line}: the password is not used: give ssh a key (ssh-copy-id {where})"
            )

        options = [
            "BatchMode=yes",
            f"ConnectTimeout={max(1, round(machine.timeout))}",
            "ServerAliveInterval=5",
        ]
        if os.environ.get("ROSLAUNCH_SSH_UNKNOWN") == "1":
            options += ["StrictHostKeyChecking=accept-new"]
        words = [word for option in options for word in ("-o", option)]
        timeouts = (
            f"--sigint-timeout={self._timeouts.interrupt:g} --sigterm-timeout={self._timeouts.terminate:g}"
        )
        loader = f"{shlex.quote(machine.env_loader)} " if machine.env_loader else ""
        command = (
            f"ROS_MASTER_URI={shlex.quote(self._environment.master_uri)} {loader}roslaunch -c {shlex.quote(name)} "
            f"-u {uri} --run_id {shlex.quote(self._run_id)} {timeouts}"
        )

        try:
            process = start_process(
                name,
                ["ssh", *words, "-p", str(machine.ssh_port), where, command],
                environ=os.environ,
                stdout=subprocess.DEVNULL,
            )
        except MinirospyError as error:
            raise LaunchError(machine.file, machine.line, f"machine [{machine.name}]: {error}") from error
        self._monitor.guard(process)
        return process

    def _launch(self, child: _Child) -> None:
        machine = child.machine
        end = time.monotonic() + machine.timeout
        while not child.has_registered.wait(0.1):
            if not child.ssh.is_running:
                why = f"ssh ended with status {child.ssh.exit_code}"
            elif time.monotonic() > end:
                why = f"its roslaunch does not call back within {machine.timeout:g} seconds"
            else:
                continue
            text = f"unable to start remote roslaunch child [{child.name}]: {why}"
            raise LaunchError(machine.file, machine.line, text)

        try:
            answer = call(child.uri, "launch", launch_text(child.nodes))
            succeeded, failed = cast("tuple[list[str], list[str]]", answer)
        except (RpcError, ValueError) as error:
            text = f"remote roslaunch child [{child.name}] cannot launch its nodes: {error}"
            raise LaunchError(machine.file, machine.line, text) from None
        # Real roslaunch returns "Process<name-1>".
        child.running |= {name.removeprefix("Process<").removesuffix(">") for name in succeeded}
        child.running -= child.ended
        for name in failed:
            self._output.warn(f"remote[{child.name}]: [{name}] cannot be launched")

    def _end(self, child: _Child) -> None:
        if child.uri and child.ssh.is_running:
            with contextlib.suppress(RpcError):
                call(child.uri, "shutdown", timeout=_SHUTDOWN_SECONDS + self._timeouts.interrupt)
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.ssh.popen.wait(_SHUTDOWN_SECONDS)
        end_processes([child.ssh], Timeouts(1.0, 1.0), lambda _: None)

    # --- XML-RPC methods for the children

    def _register(self, name: str, uri: str) -> int:
        child = self._children.get(name)
        if child is None:
            raise ValueError(f"no child [{name}] is expected")
        child.uri = uri
        child.has_registered.set()
        return 1

    def _log(self, name: str, level: int, text: str) -> int:
        write = self._output.warn if level >= 8 else self._output.print
        write(f"[{name}]: {text}")
        return 1

    def _process_died(self, name: str, code: int) -> int:
        node_name = "/" + name.rpartition("-")[0]
        for child in self._children.values():
            if any(node.name == node_name for node in child.nodes):
                child.ended.add(name)
            child.running.discard(name)
        nodes = [node for child in self._children.values() for node in child.nodes if node.name == node_name]
        self._monitor.remote_ended(nodes[0] if nodes else None, name, code)
        return 1


def launch_text(nodes: Sequence[NodeSpec]) -> str:
    """Return a launch file with these nodes for the remote roslaunch that runs them."""
    return "\n".join(["<launch>", *(node.to_xml() for node in nodes), "</launch>", ""])
