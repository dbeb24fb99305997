"""rostest.runner, provided by minirospy: the tests of a launch file as a class for unittest."""

from minirospy.compat.rostest.rostest_parent import ROSTestLaunchParent
from minirospy.compat.rostest.rostestutil import printlog, printlogerr, printRostestSummary
from minirospy.compat.rostest.runner import (
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
