"""Runs launch files from a program, with the classes of roslaunch.parent, roslaunch.scriptapi and roslaunch.launch.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

from minirospy.ros.roslaunch.launcher.process import Timeouts
from minirospy.ros.roslaunch.launcher.runner import RunOptions
from minirospy.ros.roslaunch.roslaunch.config import LaunchFile, ROSLaunchConfig, load_config_default
from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.launch import ROSLaunchRunner, master_options, replacement_of
from minirospy.ros.roslaunch.roslaunch.pmon import ProcessListener, ProcessMonitor

__all__ = ["RLException", "ROSLaunchParent", "load_config_default"]


class ROSLaunchParent:
    """Runs launch files (paths, or paths with arguments) in the background. Methods raise RLException on an error."""

    def __init__(
        self,
        run_id: str,
        roslaunch_files: Sequence[LaunchFile],
        is_core: bool = False,
        port: int | None = None,
        local_only: bool = False,
        process_listeners: Sequence[ProcessListener] | None = None,
        verbose: bool = False,
        force_screen: bool = False,
        force_log: bool = False,
        is_rostest: bool = False,
        roslaunch_strs: Sequence[str] | None = None,
        num_workers: int = 3,
        timeout: float | None = None,
        master_logger_level: str | bool = False,
        show_summary: bool = True,
        force_required: bool = False,
        sigint_timeout: float = 15.0,
        sigterm_timeout: float = 2.0,
    ) -> None:
        if sigint_timeout <= 0 or sigterm_timeout <= 0:
            raise RLException("sigint_timeout and sigterm_timeout must be positive numbers")

        self.logger = logging.getLogger("roslaunch.parent")
        self.run_id = run_id
        self.roslaunch_files = roslaunch_files
        self.roslaunch_strs = roslaunch_strs
        self.is_core = is_core
        self.port = port
        self.local_only = local_only
        self.process_listeners = process_listeners

        self.verbose = verbose
        self.force_screen = force_screen
        self.force_log = force_log
        self.force_required = force_required
        self.show_summary = show_summary

        self.config: ROSLaunchConfig | None = None
        self.runner: ROSLaunchRunner | None = None
        self.pm: ProcessMonitor | None = None
        self.server = self.remote_runner = None
        self._master_options = master_options(timeout, master_logger_level)
        self._timeouts = Timeouts(sigint_timeout, sigterm_timeout)

    def start(self, auto_terminate: bool = True) -> None:
        """Start everything; return once all nodes have started. Raise RLException on failure.

        If not ``auto_terminate``, the run continues after the last node has exited.
        """
        if self.runner is not None:
            raise RLException("this roslaunch instance has been started before: make another one")
        if self.config is None:
            self._load_config()
        assert self.config
        runner = ROSLaunchRunner(self.run_id, self.config, is_core=self.is_core, options=self._options())
        for listener in self.process_listeners or ():
            runner.add_process_listener(listener)
        self.runner, self.pm = runner, runner.pm
        try:
            runner.launch()
        except RLException:
            # Let the program call start() again.
            self.runner = None
            raise
        if auto_terminate and self.pm:
            self.pm.registrations_complete()

    def spin(self) -> None:
        """Wait until all nodes have exited, or terminate them on a signal."""
        if self.runner is None:
            raise RLException("parent not started yet")
        if self.runner.pm:
            self.runner.spin()

    def spin_once(self) -> bool:
        """Handle pending signals; return whether the run continues."""
        return self.runner is not None and self.runner.spin_once()

    def shutdown(self) -> None:
        """Terminate all processes and wait until they exit. Idempotent."""
        if self.runner:
            self.runner.stop()

    def _load_config(self) -> None:
        """Load the launch files into ``config``. Programs may override this method to fill ``config`` differently."""
        load = replacement_of("roslaunch.config", "load_config_default", load_config_default)
        self.config = load(
            self.roslaunch_files, self.port, roslaunch_strs=self.roslaunch_strs, verbose=self.verbose
        )

    def _options(self) -> RunOptions:
        return RunOptions(
            screen=self.force_screen,
            log=self.force_log,
            required=self.force_required,
            local=self.local_only,
            summary=self.show_summary,
            timeouts=self._timeouts,
            master_arguments=self._master_options,
        )
