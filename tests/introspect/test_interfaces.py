"""Types that packages define."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import NotFoundError
from minirospy.core.idl.load import get_message_class, get_service_class
from minirospy.introspect.interfaces import Interfaces, Kind
from minirospy.workspace.packages import Packages


@pytest.fixture
def workspace(tmp_path: Path) -> Environment:
    """Create a workspace with a package that defines a message, a service and an action."""
    package = tmp_path / "src" / "my_msgs"
    for file, text in {
        "package.xml": "<package><name>my_msgs</name></package>",
        "msg/Led.msg": "# comment\nuint8 OFF=0\nbool on # here\nstd_msgs/Header[2] headers\n",
        "srv/Blink.srv": "int32 times\n---\nLed led\n",
        "action/Run.action": "int32 runs\n---\nint32 done\n---\nint32 now\n",
    }.items():
        (package / file).parent.mkdir(parents=True, exist_ok=True)
        (package / file).write_text(text)
    return Environment.read({"ROS_PACKAGE_PATH": str(tmp_path / "src"), "ROS_HOSTNAME": "localhost"})


def test_types_of_a_workspace_need_no_build(workspace: Environment) -> None:
    messages = Interfaces(Packages(workspace), Kind.MESSAGE)
    assert messages.in_package("my_msgs") == [
        "my_msgs/Led", "my_msgs/RunAction", "my_msgs/RunActionFeedback", "my_msgs/RunActionGoal",
        "my_msgs/RunActionResult", "my_msgs/RunFeedback", "my_msgs/RunGoal", "my_msgs/RunResult",
    ]  # fmt: skip
    assert messages.description("my_msgs/Led") == (
        "uint8 OFF=0\nbool on\nstd_msgs/Header[2] headers\n  uint32 seq\n  time stamp\n  string frame_id\n"
    )
    assert messages.text("my_msgs/Led").startswith("# comment\n")
    assert messages.description("my_msgs/RunGoal") == "int32 runs\n"
    services = Interfaces(Packages(workspace), Kind.SERVICE)
    assert services.in_package("my_msgs") == ["my_msgs/Blink"]
    assert services.description("my_msgs/Blink").startswith(
        "int32 times\n---\nmy_msgs/Led led\n  uint8 OFF=0\n"
    )


def test_every_md5sum_is_that_of_the_class() -> None:
    for kind, find in ((Kind.MESSAGE, get_message_class), (Kind.SERVICE, get_service_class)):
        interfaces = Interfaces(Packages(), kind)
        types = interfaces.all()
        assert len(types) > 10
        for type_ in types:
            assert interfaces.md5sum(type_) == find(type_)._md5sum


def test_bare_names_find_all_of_that_name() -> None:
    services = Interfaces(Packages(), Kind.SERVICE)
    assert services.find("Empty") == ["roscpp/Empty", "std_srvs/Empty"]
    assert services.find("std_srvs/Empty") == ["std_srvs/Empty"]
    assert "std_srvs" in services.packages()
    for name, near in (("SetBol", "SetBool"), ("std_srvs/SetBol", "std_srvs/SetBool")):
        with pytest.raises(NotFoundError, match=f"service type .* not found; did you mean {near}"):
            services.find(name)
    with pytest.raises(NotFoundError, match="package"):
        services.in_package("nope")
