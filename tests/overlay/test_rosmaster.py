"""A master inside a program, as third-party tests start one."""

from __future__ import annotations

import pytest
import rosgraph
import rosmaster
import rosmaster.master
import roswtf


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_master_in_the_program() -> None:
    master = rosmaster.master.Master(port=0)
    assert not master.ok()
    master.start()
    try:
        assert master.ok()
        assert master.uri is not None
        client = rosgraph.Master("/tester", master.uri)
        client.setParam("/a", 5)
        assert client.getParam("/a") == 5
        with pytest.raises(OSError, match="in use"):
            rosmaster.master.Master(master.port).start()
        uri = master.uri
    finally:
        master.stop()
    master.stop()
    assert not master.ok()
    assert not rosgraph.is_master_online(uri)


def test_names() -> None:
    assert rosmaster.DEFAULT_MASTER_PORT == 11311
    assert callable(rosmaster.rosmaster_main)
    assert callable(roswtf.roswtf_main)
