"""rosunit: unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rosunit.rosunit import baretest as baretest
    from minirospy.ros.rosunit.rosunit import core as core
    from minirospy.ros.rosunit.rosunit import junitxml
    from minirospy.ros.rosunit.rosunit import pyunit as pyunit
    from minirospy.ros.rosunit.rosunit import xmlrunner as xmlrunner
    from minirospy.ros.rosunit.runner.unit import (
        XML_OUTPUT_FLAG,
        create_xml_runner,
        print_runner_summary,
        print_unittest_summary,
        rostest_name_from_path,
        unitrun,
        xml_results_file,
    )

__all__ = [
    "XML_OUTPUT_FLAG",
    "__version__",
    "create_xml_runner",
    "junitxml",
    "print_runner_summary",
    "print_unittest_summary",
    "rostest_name_from_path",
    "unitrun",
    "xml_results_file",
]

__version__ = "1.0.0"


def rosunitmain() -> None:
    """Run the command `rosunit` and exit."""
    import sys

    from minirospy.ros.rostest.commands.rostest import rosunit

    sys.exit(rosunit())
