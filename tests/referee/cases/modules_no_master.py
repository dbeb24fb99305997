"""rosgraph and similar modules without a master: an immediate error that users' programs catch."""

import contextlib
import io
import os
import time

os.environ["ROS_MASTER_URI"] = "http://localhost:1"

import rosgraph
import roslib.scriptutil
import rosnode
import rosparam
import rosservice
import rostopic
from referee import show

master = rosgraph.Master("/tester")
begun = time.time()
NODE, TOPIC = rosnode.ROSNodeIOException, rostopic.ROSTopicIOException
SERVICE, PARAM = rosservice.ROSServiceIOException, rosparam.RosParamIOException
for expected, call, *arguments in (
    (NODE, rosnode.get_node_names),
    (NODE, rosnode.get_api_uri, master, "/a"),
    (NODE, rosnode.rosnode_ping, "/a"),
    (NODE, rosnode.rosnode_ping_all),
    (NODE, rosnode.get_node_info_description, "/a"),
    (NODE, rosnode.get_machines_by_nodes),
    (NODE, rosnode.get_nodes_by_machine, "localhost"),
    (NODE, rosnode.rosnode_info, "/a"),
    (NODE, rosnode.rosnode_listnodes),
    (NODE, rosnode._sub_rosnode_listnodes),
    (NODE, rosnode.rosnode_cleanup),
    (OSError, rosnode.cleanup_master_blacklist, master, ["/a"]),
    (OSError, rosnode.cleanup_master_whitelist, master, ["/a"]),
    (OSError, rosnode.kill_nodes, ["/a"]),
    (TOPIC, rostopic.get_topic_type, "/a"),
    (TOPIC, rostopic.get_topic_class, "/a"),
    (TOPIC, rostopic.find_by_type, "std_msgs/Bool"),
    (OSError, rostopic.get_topic_list),
    (TOPIC, rostopic.get_info_text, "/a"),
    (TOPIC, rostopic._check_master),
    (TOPIC, rostopic.get_api, master, "/a"),
    (TOPIC, rostopic._rostopic_list, None),
    (TOPIC, rostopic._rostopic_info, "/a"),
    (TOPIC, rostopic._rostopic_type, "/a"),
    (SERVICE, rosservice.get_service_list),
    (SERVICE, rosservice.get_service_type, "/a"),
    (SERVICE, rosservice.get_service_uri, "/a"),
    (SERVICE, rosservice.get_service_node, "/a"),
    (SERVICE, rosservice.get_service_args, "/a"),
    (SERVICE, rosservice.get_service_class_by_name, "/a"),
    (SERVICE, rosservice.rosservice_find, "a/B"),
    (SERVICE, rosservice.has_service_args, "/a"),
    (SERVICE, rosservice.get_service_headers, "/a", "rosrpc://localhost:1"),
    (PARAM, rosparam.get_param, "/a"),
    (PARAM, rosparam.set_param, "/a", "1"),
    (PARAM, rosparam.upload_params, "/a", {"b": 1}),
    (PARAM, rosparam.delete_param, "/a"),
    (PARAM, rosparam.list_params, "/"),
    (OSError, master.getParam, "/a"),
    (OSError, master.lookupNode, "/a"),
    (OSError, master.getSystemState),
    (OSError, roslib.scriptutil.get_master().getPid, "/tester"),
    (OSError, master.is_online),
):
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            said = f"gives {call(*arguments)!r}"
        except expected as error:
            said = f"raises {expected.__name__}" + (f": {error}" if expected is not OSError else "")
        except Exception as error:  # noqa: BLE001 - whatever it is
            said = f"raises another: {type(error).__name__}"
    show(getattr(call, "__name__", "call"), said)
show("at once:", time.time() - begun < 10)
