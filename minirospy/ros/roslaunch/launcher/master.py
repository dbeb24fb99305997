"""Finds or starts the master for a launch, and sets /run_id and the launch file's parameters."""

from __future__ import annotations

import contextlib
import os
import sys
import time
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path

from minirospy.base.environment import DISTRO, ROS_VERSION, Environment, run_folder
from minirospy.base.errors import MasterUnreachableError, MinirospyError, RpcError, ValueTextError
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Process, start_process
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["CORE_PARAMETERS", "LaunchMaster"]

CORE_PARAMETERS: Mapping[str, str] = {"/rosdistro": DISTRO, "/rosversion": ROS_VERSION}
"""Parameters that every launch sets, as in ROS."""

_START_SECONDS = 60.0
_POLL_SECONDS = 0.005  # seconds between checks whether the started master responds
_SLOW_POLL_SECONDS = 0.02  # the same, after the first second: on a slow computer, poll less often


class LaunchMaster:
    """Finds or starts the master for a launch.

    ``pause(seconds)`` must sleep, and raise KeyboardInterrupt if the run is stopped meanwhile.
    """

    def __init__(self, environment: Environment, output: Output, pause: Callable[[float], None]) -> None:
        self._environment = environment
        self._output = output
        self._pause = pause
        self._proxy = MasterProxy(environment.master_uri, "/roslaunch")
        self.run_id = ""
        """The name of the run's log folder, and the master's /run_id."""
        self.has_logs = True  # whether log files can be written

    @property
    def log_folder(self) -> Path:
        """Return the folder for this run's log files."""
        return self._environment.log_dir / self.run_id

    def is_online(self) -> bool:
        """Return whether a master responds."""
        return self._proxy.is_online()

    def close(self) -> None:
        """Close the connections. Idempotent."""
        self._proxy.close()

    def wait(self) -> None:
        """Wait until the master responds."""
        self._output.print("roscore/master is not yet running, will wait for it to start")
        while not self.is_online():
            self._pause(0.1)
        self._output.print("master has started, initiating launch")

    def start(self, arguments: tuple[str, ...]) -> Process:
        """Start a master on this machine.

        Raise MasterUnreachableError if the master URI names another machine, MinirospyError if the process cannot be started.
        """
        if not self._environment.master_is_local:
            # Call the master to get an error with the reason, such as an unknown host name or a suspended master.
            self._proxy.get_pid()
            raise MasterUnreachableError(self._environment.master_uri)
        self._output.print("auto-starting new master")
        port = str(self._environment.master_address[1])
        command = [
            sys.executable,
            "-m",
            "minirospy.ros.rosmaster.commands.master",
            "-q",
            "-p",
            port,
            *arguments,
        ]
        return start_process("master", command, environ=os.environ)

    def wait_for_start(self, process: Process) -> None:
        """Wait until the started master responds, then set /run_id. Raise MinirospyError if it exits or does not respond."""
        start = time.monotonic()
        while not self.is_online():
            if not process.is_running:
                raise MinirospyError(f"the master ended with status {process.exit_code}")
            waited = time.monotonic() - start
            if waited > _START_SECONDS:
                raise MinirospyError(f"the master does not answer at {self._environment.master_uri}")
            self._pause(_POLL_SECONDS if waited < 1.0 else _SLOW_POLL_SECONDS)

        if self.run_id:
            # Set the run id explicitly: the launching program may have chosen it, and it names the log folder.
            self._proxy.set_param("/run_id", self.run_id)
        # Do not warn again: a master that cannot write its log has already warned.
        self.find_run_id(warns=False)

    def find_run_id(self, *, warns: bool = True) -> None:
        """Use the master's /run_id or set a new one, and open roslaunch's log file."""
        try:
            found = self._proxy.get_param("/run_id")
        except RpcError:
            found = None
        if run_folder(self._environment.log_dir, found):
            self.run_id = str(found)
        else:
            if found is not None:
                self._output.warn(
                    "WARNING: /run_id at the master cannot be the name of a folder: it is replaced"
                )
            self.run_id = self.run_id or str(uuid.uuid1())
            self._proxy.set_param("/run_id", self.run_id)
            self._output.print(f"setting /run_id to {self.run_id}", bold=True)

        try:
            self._output.print(f"... logging to {self._output.log_to(self.log_folder)}")
        except OSError as error:
            # Start the nodes even on a full or read-only disk.
            self.has_logs = False
            if warns:
                why = error.strerror or error
                self._output.warn(f"WARNING: cannot write logs to {self.log_folder}: {why}; set ROS_LOG_DIR")

    def set_parameters(self, spec: LaunchSpec) -> None:
        """Delete the namespaces of clear_params, run the <rosparam> commands, then set the parameters.

        Raise MinirospyError if a value cannot be set.
        """
        for namespace in spec.clear:
            with contextlib.suppress(RpcError):
                self._proxy.delete_param(namespace)

        for command in spec.commands:
            if command.file is None:
                self._output.print(f"running rosparam delete {command.name}")
                try:
                    self._proxy.delete_param(command.name)
                except RpcError:
                    self._output.warn(f"ERROR: parameter [{command.name}] is not set")
            else:
                self._output.print(f"running rosparam dump {command.file} {command.name}")
                self._dump(command.name, command.file)

        for name, value in {**CORE_PARAMETERS, **spec.params}.items():
            try:
                self._proxy.set_param(name, value)
            except (RpcError, ValueTextError) as error:
                raise MinirospyError(f"parameter [{name}]: {error}") from error

    def _dump(self, name: str, file: str) -> None:
        from minirospy.introspect.parameters import dump_parameters

        try:
            Path(file).write_text(dump_parameters(self._proxy.get_param(name)), encoding="utf-8")
        except (OSError, RpcError) as error:
            self._output.warn(f"ERROR: parameters cannot be dumped to [{file}]: {error}")
