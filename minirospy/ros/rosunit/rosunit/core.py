"""The names of rosunit.core."""

from minirospy.ros.rosunit.runner.unit import (
    XML_OUTPUT_FLAG,
    XMLTestRunner,
    create_xml_runner,
    rostest_name_from_path,
    xml_results_file,
)

__all__ = [
    "XML_OUTPUT_FLAG",
    "XMLTestRunner",
    "create_xml_runner",
    "rostest_name_from_path",
    "xml_results_file",
]
