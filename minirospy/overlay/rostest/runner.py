"""rostest.runner, provided by minirospy: the tests of a launch file as a class for unittest."""

from minirospy.ros.rostest.rostest.rostest_parent import ROSTestLaunchParent
from minirospy.ros.rostest.rostest.rostestutil import printlog, printlogerr, printRostestSummary
from minirospy.ros.rostest.rostest.runner import (
    _DEFAULT_TEST_PORT,
    createUnitTest,
    failDuplicateRunner,
    failRunner,
    getConfig,
    getResults,
    getRostestParents,
    rostestRunner,
    setTextMode,
    setUp,
    tearDown,
)

__all__ = [
    "_DEFAULT_TEST_PORT",
    "ROSTestLaunchParent",
    "createUnitTest",
    "failDuplicateRunner",
    "failRunner",
    "getConfig",
    "getResults",
    "getRostestParents",
    "printRostestSummary",
    "printlog",
    "printlogerr",
    "rostestRunner",
    "setTextMode",
    "setUp",
    "tearDown",
]
