"""rostest.rostest_parent: runs a launch file's nodes for its tests, one test after another."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace

from minirospy.base.environment import Environment
from minirospy.ros.roslaunch.roslaunch.config import LaunchFile, ROSLaunchConfig
from minirospy.ros.roslaunch.roslaunch.core import Master, Test, generate_run_id
from minirospy.ros.roslaunch.roslaunch.launch import ROSLaunchRunner
from minirospy.ros.roslaunch.roslaunch.parent import ROSLaunchParent
from minirospy.ros.rostest.runner.runner import master_of_tests

__all__ = ["ROSTestLaunchParent"]


class ROSTestLaunchParent(ROSLaunchParent):
    """Starts a new master on a free port, and runs a configuration's nodes and tests with it.

    ``reuse_master``: use the master at ROS_MASTER_URI instead; ``clear`` first deletes its parameters. ``port`` has no effect.
    """

    def __init__(
        self,
        config: ROSLaunchConfig,
        roslaunch_files: Sequence[LaunchFile],
        port: int = 0,
        reuse_master: bool = False,
        clear: bool = False,
    ) -> None:
        if config is None:
            raise Exception("config not initialized")
        super().__init__(generate_run_id(), roslaunch_files, port=port, is_rostest=True)
        self.config: ROSLaunchConfig = config
        self.reuse_master = reuse_master
        self.clear = clear
        self._open = ExitStack()

    def setUp(self) -> None:
        """Start the master, or connect to it.

        Raise RLException if the master cannot be started, MasterUnreachableError if a reused master does not respond.
        """
        environment = self._open.enter_context(
            master_of_tests(Environment.read(), self.run_id, reuse=self.reuse_master, clear=self.clear)
        )
        self.config.set_master(Master(uri=environment.master_uri))
        self.runner = ROSLaunchRunner(
            self.run_id, self.config, is_rostest=True, options=replace(self._options(), log_errors=True)
        )
        self.pm = self.runner.pm

    def launch(self) -> tuple[list[str], list[str]]:
        """Start the nodes; return the names of the started processes and of the nodes that failed."""
        assert self.runner
        return self.runner.launch()

    def run_test(self, test: Test) -> bool:
        """Run a test until it exits; return whether its exit status is 0.

        Raise RLTestTimeoutException if the test exceeds its time limit.
        """
        assert self.runner
        return self.runner.run_test(test)

    def tearDown(self) -> None:
        """Terminate all processes. Idempotent."""
        self.shutdown()
        self._open.close()

    def _load_config(self) -> None:
        """Use the configuration passed to the constructor."""
