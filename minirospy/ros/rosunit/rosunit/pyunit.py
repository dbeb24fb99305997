"""The names of rosunit.pyunit."""

from minirospy.ros.rosunit.runner.unit import (
    XML_OUTPUT_FLAG,
    create_xml_runner,
    print_unittest_summary,
    unitrun,
)

__all__ = ["XML_OUTPUT_FLAG", "create_xml_runner", "print_unittest_summary", "unitrun"]
