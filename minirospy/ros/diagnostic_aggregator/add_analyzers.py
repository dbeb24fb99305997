"""The program add_analyzers: adds analyzers to a running aggregator.

Source: http://wiki.ros.org/diagnostic_aggregator/Tutorials/Adding%20analyzers%20at%20runtime.
"""

from __future__ import annotations

import argparse
import sys

from diagnostic_msgs.srv import AddDiagnostics

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError
from minirospy.ros.bondpy.bondpy.bondpy import Bond
from minirospy.ros.rosparam import rosparam

__all__ = ["main"]

_NAME = "add_analyzers"
_SERVICE = "/diagnostics_agg/add_diagnostics"
_CONNECT_SECONDS = 120.0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        _NAME,
        description="Add analyzers to the diagnostic aggregator, until this node ends. They are in a file, or on the "
        "parameter server already.",
    )
    parser.add_argument("analyzer_yaml", nargs="?", help="a file with the parameters")
    parser.add_argument(
        "-t",
        "--timeout",
        type=float,
        help="time in seconds to wait for the diagnostic_agg service to come up before timing out. Default waits indefinitely",
    )
    return parser


def main() -> int:
    """Run the node; return the exit status."""
    rospy.init_node(_NAME)
    options = _parser().parse_args(rospy.myargv()[1:])
    namespace = rospy.get_name()
    if options.analyzer_yaml is not None:
        try:
            for params, place in rosparam.load_file(options.analyzer_yaml, default_namespace=namespace):
                rosparam.upload_params(place, params)
        except (rosparam.RosParamException, MinirospyError, OSError) as error:
            print(f"ERROR: {error}", file=sys.stderr)
            return 1

    bond = Bond(
        f"/diagnostics_agg/bond{namespace}",
        namespace,
        on_broken=lambda: _end(f"{namespace} bond to diagnostic aggregator is broken"),
    )
    bond.set_connect_timeout(_CONNECT_SECONDS)
    rospy.on_shutdown(bond.shutdown)
    try:
        _add(bond, namespace, options.timeout)
        rospy.spin()
    except rospy.ROSInterruptException:
        pass
    return 0


def _add(bond: Bond, namespace: str, timeout: float | None) -> None:
    try:
        rospy.wait_for_service(_SERVICE, timeout)
        bond.start()
        answer = rospy.ServiceProxy(_SERVICE, AddDiagnostics)(load_namespace=namespace)
    except rospy.ServiceException:
        _end(f"{_NAME} service returned failure - missing aggregator or failed init of analyzer group?")
    except rospy.ROSException:
        _end(f"{_NAME} add timed out while waiting for diagnostics_agg service, or ROS shutdown")
    else:
        if answer.success:
            rospy.loginfo(f"{_NAME} successfully added analyzers to diagnostic aggregator")
        else:
            _end(f"{_NAME} did not add any analyzers to diagnostic aggregator: {answer.message}")


def _end(reason: str) -> None:
    if not rospy.is_shutdown():
        rospy.logerr(reason)
        rospy.signal_shutdown(reason)
