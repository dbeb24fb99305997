"""Names that are None or a number: ROS's errors, with which programs detect that something does not exist."""

from __future__ import annotations

from collections.abc import Callable

import dynamic_reconfigure.client
import pytest
import rosclean
import rosgraph
import roslib
import roslib.packages
import rosmsg
import rosparam
import rospkg
import rospy
import rosservice
import rostopic


@pytest.mark.parametrize("name", [None, 3, 0.5])
@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda name: rospkg.RosPack().get_path(name), rospkg.ResourceNotFound),
        (roslib.load_manifest, rospkg.ResourceNotFound),
        (lambda name: roslib.packages.find_node(name, "x"), rospkg.ResourceNotFound),
        (rosmsg.list_types, rospkg.ResourceNotFound),
        (rosmsg.get_msg_text, rosmsg.ROSMsgException),
        (rosclean.get_disk_usage, rosclean.CleanupException),
        (lambda name: rostopic.create_publisher("/t", name, False), rostopic.ROSTopicException),
        (lambda uri: rosservice.get_service_headers("/s", uri), rosservice.ROSServiceException),
        (dynamic_reconfigure.client.Client, TypeError),
    ],
)
def test_name_of_nothing_is_not_found(
    call: Callable[[object], object], error: type[Exception], name: object
) -> None:
    with pytest.raises(error):
        call(name)


@pytest.mark.parametrize(
    "call",
    [
        lambda: rosgraph.Master("/me").lookupNode(None),
        lambda: rosparam.get_param(None),
        lambda: rosparam.delete_param(None),
        lambda: rosservice.get_service_type(None),
        lambda: rospy.search_param(None),
    ],
)
def test_none_is_not_sent_to_the_master(call: Callable[[], object], master: str) -> None:
    with pytest.raises(TypeError):
        call()


def test_number_is_the_name_of_nothing_at_the_master(master: str) -> None:
    for call in (rosparam.get_param, rosparam.delete_param, lambda name: rosparam.set_param_raw(name, 1)):
        with pytest.raises(rosgraph.MasterError):
            call(3)
    assert rospy.get_param(3, "default") == "default"
    assert not rospy.has_param(3)
    with pytest.raises(KeyError):
        rospy.delete_param(3)
    found = [rosservice.get_service_type(3), rosservice.get_service_uri(3), rosservice.get_service_node(3)]
    assert [*found, rosservice.get_service_list(3), rosservice.rosservice_find(None)] == [
        None,
        None,
        None,
        [],
        [],
    ]
    with pytest.raises(rosservice.ROSServiceException):
        rosservice.get_service_class_by_name(3)


@pytest.mark.parametrize("name", [None, ""])
def test_services_of_no_type_are_looked_up_at_the_master(name: object) -> None:
    with pytest.raises(rosservice.ROSServiceIOException):
        rosservice.rosservice_find(name)
