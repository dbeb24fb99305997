"""rosunit, provided by minirospy: unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""

from minirospy.ros.rostest.runner.unit import (
    XML_OUTPUT_FLAG,
    create_xml_runner,
    print_runner_summary,
    print_unittest_summary,
    rostest_name_from_path,
    unitrun,
    xml_results_file,
)
from minirospy.ros.rosunit.rosunit import __getattr__ as __getattr__
from minirospy.ros.rosunit.rosunit import __version__ as __version__
from rosunit import baretest as baretest
from rosunit import core as core
from rosunit import junitxml
from rosunit import pyunit as pyunit
from rosunit import xmlrunner as xmlrunner

__all__ = [
    "XML_OUTPUT_FLAG", "create_xml_runner", "junitxml", "print_runner_summary", "print_unittest_summary",
    "rostest_name_from_path", "unitrun", "xml_results_file",
]  # fmt: skip
