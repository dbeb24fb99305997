"""Call every callable name on the compatibility pages with no argument, None, wrong types and normal values.

Runs under real ROS and under minirospy; test_interop_called_names.py compares the two. Stdin is JSON: ``names``, a list of
[module, name or Class.member, parameters without default in real ROS]; ``left_out``, the calls that block; and
``seconds``, after which a call counts as blocking. Prints one line per call: the call, a tab, its outcome as JSON.
"""

import functools
import gc
import importlib
import inspect
import io
import json
import logging
import os
import re
import select
import signal
import sys
import sysconfig
import tempfile
import types
import warnings
import xmlrpc.client
from pathlib import Path

PATHS = {
    str(path)
    for folder in (
        *(
            "/usr",
            "/opt",
            "/home",
            "/root",
            "/tmp",
            tempfile.gettempdir(),
            os.getcwd(),
            Path(__file__).parents[2],
        ),
        *(sys.prefix, sys.base_prefix, sysconfig.get_path("purelib")),
    )
    for path in (folder, Path(folder).resolve())
}
"""Folders whose paths differ between machines: this checkout, its Python, the system's Python, the test's folder."""

CHANGING = re.compile(
    r"\b[0-9a-f]{8}(-[0-9a-f]{4,12}){4}| at 0x[0-9a-f]+|0x[0-9a-f]{6,}|\d{8,}|_\d+_\d+|\d+\.\d{9,}|:\d{4,5}\b|\b\d{2,7}, \d{9}\b"
    r"|-\d+\.log\b|\d\d:\d\d:\d\d|[\d.]+ms\b"
    + rf"|(?<![\w.-])({'|'.join(map(re.escape, sorted(PATHS, key=len, reverse=True)))})\b[^ ,:;)\]'\"]*"
)
# A wrong type raises one or the other, depending on the operation that fails first.
MIX_UP = (AttributeError, TypeError)

AT_RANDOM = re.compile(
    r"^random_|\bgetPid$|^Rate.remaining$|date_time_string$|^RosStreamHandler.emit$|^TransformRegistration.print_me$"
    r"|^rosmsg_cmd_packages$|disk_usage$|^list_msg_types$|^get_pkg_msg_specs$|^roswtf_main$"
)
"""Names whose values differ between calls or machines, for example lists of installed packages."""

# Standard library modules whose methods ROS's classes inherit.
NOT_OF_ROS = ("http.server", "logging", "socketserver", "xmlrpc.server")

# Parameter names with expressions for their normal values. A parameter that is not listed gets "/x".
NORMAL = {
    "a": "1.0", "addr": "'127.0.0.1'", "ai": "0.1", "aj": "0.2", "ak": "0.3", "angle": "0.5",
    "angles": "(0.1, 0.2, 0.3)", "arg": "'a:=b'", "args": "()", "argv": "['prog', 'a:=b', '__name:=n']",
    "averaging_interval": "rospy.Duration(1)", "axes": "'sxyz'", "axis": "[0, 0, 1]", "b": "io.BytesIO()",
    "b_type": "'int32[]'", "base_type": "'int32'", "blacklist": "[]", "bottom": "-1.0", "buff": "io.BytesIO()",
    "buff_size": "100", "buffer": "tf2_ros.Buffer(debug=False)", "c": "1", "c1": "1", "c2": "2", "call_list": "[]",
    "callback": "print", "callback_args": "()", "caller_api": "'http://localhost:1/'", "caller_id": "'/me'",
    "cb": "print", "center": "(0, 0)", "changes": "{}", "check_state": "1", "child": "'b'",
    "client_address": "('127.0.0.1', 1)", "cloud": "cloud()", "cmprs_img_msg": "CompressedImage()", "code": "1",
    "cols": "4", "command": "''", "command_type": "0", "config": "{}", "connection_header": "{}", "constants": "[]",
    "constrain": "False", "context": "'a'", "core_type": "'std_msgs/String'", "current_expected": "rospy.Time(1)",
    "current_real": "rospy.Time(1)", "cv": "(1.0, 0.0)", "cvim": "image()", "cvtype": "'8UC3'", "d": "{'a': 1}",
    "data": "b'ab'", "data_class": "String", "default": "1", "deltaU": "1.0", "deltaV": "1.0", "deltaX": "1.0",
    "deltaY": "1.0", "dependencies": "{}", "descr": "'text'", "description": "'text'", "descriptions": "[]",
    "dest": "'/b'", "dest_frame": "'a'", "detector": "rospkg.os_detect.LsbDetect('Debian')", "direction": "'i'",
    "disparity": "2.0", "drtype": "'a'", "dtype": "'uint8'", "dur": "rospy.Duration(1)",
    "duration": "rospy.Duration(0)", "echo_noarr": "False", "echo_nostr": "False",
    "edge": "rosgraph.impl.graph.Edge('/a', '/b')", "encoding": "'bgr8'", "end": "'/b'", "entries_out": "[]",
    "errstr": "'text'", "f": "lambda *args: None", "factor": "2.0", "far": "10.0", "fdo_id": "'debian'",
    "feedback": "visualization_msgs.msg.InteractiveMarkerFeedback()", "feedback_cb": "print", "field": "'a'",
    "field_name": "'a'", "field_type": "'int32[3]'", "field_val": "1", "fields": "[]", "file_name": "'f'",
    "file_path": "'/nowhere/f'", "filename": "'/nowhere/f'", "fixed_frame": "'a'", "float_secs": "1.5", "format": "'B'",
    "fraction": "0.5", "frame": "'a'", "frame_id": "'a'", "from_angle": "0.1", "from_stamp": "rospy.Time(1)",
    "fs": "(lambda m: m)", "full": "'std_msgs/String'", "full_msg_spec": "'x'", "full_msg_type": "'std_msgs/String'",
    "full_name": "'std_msgs/String'", "get_deps_dict": "{}",
    "group": "generator()", "h": "std_msgs.msg.Header()",
    "handle": "1", "handler": "print", "handles_in": "[]", "hdr": "std_msgs.msg.Header()", "header": "{'topic': '/x'}",
    "header_str": "{'topic': '/x'}", "hostname": "'localhost'", "hz": "1.0", "id": "'x'", "img_msg": "Image()",
    "inbag": "'/nowhere/a.bag'", "include_depends": "False", "instance": "String()", "interactive": "False",
    "key": "'/x'", "keyword": "'x'", "kwds": "{}", "L": "1.0", "label": "'x'", "last_duration": "0.1",
    "last_expected": "rospy.Time(1)", "last_real": "rospy.Time(1)", "latch": "False", "left": "-1.0",
    "left_limit": "-1.0", "left_msg": "CameraInfo()", "left_uv": "(1.0, 2.0)", "lengths": "(1, 1, 1)", "level": "0",
    "logname": "'x'", "lsb_name": "'Debian'", "m": "String('a')", "machine": "'localhost'",
    "marker": "visualization_msgs.msg.InteractiveMarker(name='a')", "marker_name": "'a'",
    "master": "rosgraph.Master('/me')", "matrix": "tf.transformations.identity_matrix()",
    "matrix0": "tf.transformations.identity_matrix()", "matrix1": "tf.transformations.identity_matrix()",
    "message": "String('a')", "message_type": "String", "messages": "[]", "method_name": "'getPid'",
    "migrator": "rosbag.migration.MessageMigrator()", "mode": "'r'", "msg": "String('a')", "msg_args": "['a']",
    "msg_cat": "'msg'", "msg_class": "String", "msg_context": "genmsg.MsgContext.create_default()",
    "msg_def": "'string data'", "msg_eval": "None", "msg_from": "String('a')", "msg_from_array": "[]",
    "msg_queue": "[]", "msg_search_path": "{}", "msg_to": "String('b')", "msg_to_array": "[]", "msg_to_name": "'a'",
    "msg_type": "'std_msgs/String'", "msg_type_name": "'std_msgs/String'",
    "msgspec": "genmsg.MsgSpec([], [], [], '', 'a/b', '')", "my_queue": "[]", "n_channels": "3", "name": "'x'",
    "names": "['a']", "namespace_": "'/ns'", "near": "1.0", "new_class": "String", "new_msg": "String('b')",
    "new_type": "'a/C'", "node": "'/n'", "node_api": "'http://localhost:1/'", "node_name": "'/n'",
    "node_names": "['/n']", "node_type": "'x'", "nodename": "'n'", "normal": "(0, 0, 1)", "ns": "'/ns'", "nsecs": "5",
    "num_peers": "0", "numpy": "__import__('numpy')", "obj": "{}", "object_stamped": "geometry_msgs.msg.PointStamped()",
    "observation_frame": "'a'", "old_class": "String", "old_msg": "String('a')", "old_type": "'a/B'",
    "on_broken": "print", "on_formed": "print", "ori": "(0, 0, 0, 1)",
    "os_detector": "rospkg.os_detect.LsbDetect('Debian')", "os_name": "'debian'", "outbag": "'/nowhere/b.bag'",
    "p": "'std_msgs'", "package": "'std_msgs'", "package_context": "'std_msgs'", "package_name": "'std_msgs'",
    "param": "'/x'", "param_name": "'/x'", "param_value": "1", "params": "{}", "paramtype": "'int'", "parent": "'a'",
    "parent_handle": "1", "path": "'/nowhere'", "pattern": "'x'", "peer_publish": "print", "per": "1.0",
    "period": "rospy.Duration(1)", "pkg": "'std_msgs'", "pkgname": "'std_msgs'", "point": "(0.0, 0.0, 1.0)",
    "point_cloud": "cloud()", "points": "[(1, 2, 3)]", "port": "0", "pos": "(0, 0, 0)", "pose": "PyKDL.Frame()",
    "ps": "geometry_msgs.msg.PoseStamped()", "pub": "None", "pub_args": "['a']", "quat0": "(0, 0, 0, 1)",
    "quat1": "(0, 0, 1, 0)", "quaternion": "(0, 0, 0, 1)", "quaternion0": "(0, 0, 0, 1)", "quaternion1": "(0, 0, 1, 0)",
    "queue_size": "5", "r": "1.0", "radius": "1.0", "raw": "image()", "reason": "'end'",
    "record": "logging.LogRecord('rosout', 20, 'f', 1, 'text', (), None)", "rectified": "image()",
    "ref_point": "PyKDL.Vector()", "reference_frame": "'a'", "reference_point_frame": "'a'", "reg_type": "'pub'",
    "request": "std_srvs.srv.EmptyRequest()", "res_pkg_name": "'std_msgs'", "resolved_service_name": "'/s'",
    "resource_name": "'String'", "response": "std_srvs.srv.EmptyResponse()", "right": "1.0", "right_limit": "1.0",
    "right_msg": "CameraInfo()", "rospack": "rospkg.RosPack()", "rotation": "(0, 0, 0, 1)", "rows": "4", "rule": "None",
    "rules": "[]", "rvec": "(0, 0, 1)", "s": "'x'", "scan_in": "scan()", "script_name": "'x'",
    "search_path": "{'std_msgs': ['/nowhere']}", "secs": "3", "seq": "1", "server": "None", "service": "'/s'",
    "service_api": "'rosrpc://localhost:1'", "service_args": "[]", "service_class": "std_srvs.srv.Empty",
    "service_name": "'/s'", "service_type": "'std_srvs/Empty'", "service_uri": "'rosrpc://localhost:1'", "size": "3",
    "slop": "0.1", "sock": "None", "source_frame": "'a'", "source_time": "rospy.Time()",
    "spec": "genmsg.MsgSpec(['int32'], ['a'], [], 'int32 a', 'p/M', 'p')", "srv_type": "'std_srvs/Empty'",
    "stale_secs": "1.0", "stamp": "rospy.Time(1)", "start": "'/a'", "str": "'int32 a'", "str_": "'x'",
    "subdir": "'msg'", "subgraph": "''", "t": "rospy.Time(1)", "target_frame": "'a'", "target_time": "rospy.Time()",
    "text": "'int32 a'", "tf": "'Text'", "time": "rospy.Time()", "timeout": "rospy.Duration(0)", "timestamp": "1.0",
    "title": "'title'", "to_angle": "0.2", "to_stamp": "rospy.Time(2)", "top": "1.0", "top_": "'a'", "top_name": "'a'",
    "topic": "'/t'", "topic_name": "'/t'", "topic_ns": "'/t'", "topic_publish": "print",
    "topic_type": "'std_msgs/String'", "tracking_frame": "'b'", "transform": "geometry_msgs.msg.TransformStamped()",
    "translation": "(1, 2, 3)", "tvec": "(1, 2, 3)", "twist": "PyKDL.Twist()", "type": "'int32'",
    "type_": "'std_msgs/String'", "types": "['int32']", "update": "None", "uri": "'http://localhost:1/'",
    "url": "'http://localhost:1/'", "uv": "(1.0, 2.0)", "uv_raw": "(1.0, 2.0)", "v": "1", "v0": "(1, 0, 0)",
    "v1": "(0, 1, 0)", "v3s": "geometry_msgs.msg.Vector3Stamped()", "val": "1", "val_text": "'1'", "value": "1",
    "values": "{'/x': 1}", "vector": "PyKDL.Vector()", "vector3": "geometry_msgs.msg.Vector3Stamped()",
    "visible": "True", "whitelist": "['/rosout']", "window_size": "5", "wrench": "PyKDL.Wrench()", "x": "0.3", "Z": "2.0",
}  # fmt: skip

# Normal values for the parameters of one module.
NORMAL_OF = {
    "message_filters.f": "message_filters.SimpleFilter()", "message_filters.fs": "[message_filters.SimpleFilter()]",
    "tf.transformations.direction": "[1.0, 0.0, 0.0]", "tf.transformations.point": "[0.0, 0.0, 0.0]",
    "tf.transformations.data": "[3.0, 4.0]", "tf.transformations.seq": "'sxyz'",
    "rosgraph.xmlrpc.addr": "('127.0.0.1', 0)", "rosmsg.mode": "'.msg'", "rosmsg.full": "'rosmsg msg'",
    "rosclean.d": "'.'", "rosbag.bag.mode": "'w'", "rosbag.bag.f": "'b.bag'", "rosbag.mode": "'w'", "rosbag.f": "'b.bag'",
    "dynamic_reconfigure.client.changes": "{'speed': 1.5}", "dynamic_reconfigure.server.changes": "{'speed': 1.5}",
    "rosmsg.type_": "'std_msgs/String'",
}  # fmt: skip

# Classes with expressions that make an object, if the normal values do not suit the constructor.
OBJECTS = {
    "rosbag.bag.Bag": "bag()", "rosbag.Bag": "bag()",
    "tf2_ros.buffer.Buffer": "tf2_ros.Buffer(debug=False)",
    "tf2_ros.transform_listener.TransformListener": "tf2_ros.TransformListener(tf2_ros.Buffer(debug=False))",
    "image_geometry.PinholeCameraModel": "camera()", "image_geometry.cameramodels.PinholeCameraModel": "camera()",
    "rospy.Duration": "rospy.Duration(1, 5)", "rospy.Time": "rospy.Time(1, 5)",
    "rospy.timer.Rate": "rate()", "rospy.Rate": "rate()",
    "dynamic_reconfigure.parameter_generator_catkin.ParameterGenerator": "generator()",
    "dynamic_reconfigure.server.Server": "reconfigure_server()",
    "dynamic_reconfigure.client.Client": "reconfigure_client()",
    "interactive_markers.interactive_marker_server.InteractiveMarkerServer": "markers()",
    "message_filters.Subscriber": "message_filters.Subscriber('/t', String)",
    "rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler": "object.__new__(rosgraph.xmlrpc.SilenceableXMLRPCRequestHandler)",
}  # fmt: skip


def bag():
    """Return an open bag with two messages."""
    import rosbag
    import rospy
    from std_msgs.msg import String

    with rosbag.Bag("a.bag", "w") as made:
        made.write("/t", String("a"), rospy.Time(1))
        made.write("/t", String("b"), rospy.Time(2))
    return rosbag.Bag("a.bag")


def rate():
    """Return a Rate, after making the time available."""
    import rospy

    rospy.rostime.set_rostime_initialized(True)
    return rospy.Rate(1000)


@functools.lru_cache(None)
def node():
    """Initialize this process's node."""
    import rospy

    rospy.init_node("called", disable_signals=True)


@functools.lru_cache(None)
def markers():
    """Return an interactive marker server."""
    from interactive_markers.interactive_marker_server import InteractiveMarkerServer

    node()
    return InteractiveMarkerServer("markers")


@functools.lru_cache(None)
def reconfigure_server():
    """Return a dynamic_reconfigure server with one number, configured as by the generator."""
    from dynamic_reconfigure.server import Server

    node()
    shared = {"srcline": 1, "srcfile": "a.cfg", "type": "double", "level": 1}
    speed = {
        **shared,
        "name": "speed",
        "description": "",
        "edit_method": "",
        "cconsttype": "const double",
        "ctype": "double",
    }
    group = {
        "name": "Default",
        "type": "",
        "state": True,
        "cstate": "true",
        "id": 0,
        "parent": 0,
        "groups": [],
    }
    names = {
        "upper": "DEFAULT",
        "lower": "groups",
        "class": "DEFAULT",
        "field": "default",
        "parentname": "Default",
        "parentclass": "",
    }
    speed.update(default=1.0, min=0.0, max=2.0)
    config = types.SimpleNamespace(
        config_description={**shared, **group, **names, "parameters": [speed]},
        defaults={"speed": 1.0}, min={"speed": 0.0}, max={"speed": 2.0}, level={"speed": 1}, all_level=1,
    )  # fmt: skip
    return Server(config, lambda values, level: values)


@functools.lru_cache(None)
def reconfigure_client():
    """Return a client of the dynamic_reconfigure server."""
    from dynamic_reconfigure.client import Client

    reconfigure_server()
    client = Client("/called", timeout=60)
    # The values that arrive on a topic are available after this call.
    client.get_configuration(60)
    client.get_group_descriptions(60)
    return client


def generator():
    """Return a configuration's generator, as if catkin_make ran it."""
    from dynamic_reconfigure.parameter_generator_catkin import ParameterGenerator

    sys.argv = ["a.cfg", "share", "include", "docs", "lib"]
    return ParameterGenerator()


def camera():
    """Return a calibrated camera."""
    import image_geometry
    from sensor_msgs.msg import CameraInfo

    model = image_geometry.PinholeCameraModel()
    model.fromCameraInfo(
        CameraInfo(
            width=4,
            height=3,
            K=[1, 0, 2, 0, 1, 1.5, 0, 0, 1],
            P=[1, 0, 2, 0, 0, 1, 1.5, 0, 0, 0, 1, 0],
            R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        )
    )
    return model


def cloud():
    from sensor_msgs import point_cloud2
    from std_msgs.msg import Header

    return point_cloud2.create_cloud_xyz32(Header(), [(1, 2, 3), (4, 5, 6)])


def scan():
    from sensor_msgs.msg import LaserScan

    return LaserScan(ranges=[1.0, 2.0], angle_increment=0.5, range_max=10.0)


def image():
    import numpy

    return numpy.zeros((3, 4, 3), numpy.uint8)


def namespace():
    """Return the names that the expressions may use."""
    names = {
        "io": io,
        "logging": logging,
        "bag": bag,
        "camera": camera,
        "cloud": cloud,
        "scan": scan,
        "image": image,
        "rate": rate,
        "generator": generator,
        "markers": markers,
        "reconfigure_server": reconfigure_server,
        "reconfigure_client": reconfigure_client,
    }
    for module in (
        "rospy", "genmsg", "genpy", "rosgraph", "rosgraph.impl.graph", "rospkg", "rospkg.os_detect", "rosbag", "rosbag.migration",
        "tf",
        "tf.transformations", "tf2_ros", "PyKDL", "std_msgs.msg", "std_srvs.srv", "geometry_msgs.msg", "visualization_msgs.msg",
        "image_geometry", "message_filters", "rosgraph.xmlrpc", "dynamic_reconfigure.parameter_generator_catkin",
    ):  # fmt: skip
        importlib.import_module(module)
        names[module.split(".")[0]] = sys.modules[module.split(".")[0]]
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image
    from std_msgs.msg import String

    names.update(String=String, Image=Image, CompressedImage=CompressedImage, CameraInfo=CameraInfo)
    return names


def shown(value, depth=0):
    """Return a value as a string without addresses, times and module names of classes."""
    if inspect.isgenerator(value):
        value = [each for each, _ in zip(value, range(5), strict=False)]
    if inspect.isclass(value):
        return f"class {value.__name__}"
    if isinstance(value, (types.ModuleType,)):
        return "a module"
    if callable(value) and hasattr(value, "__name__"):
        return "a function"
    if type(value) in (list, tuple) and depth < 4:
        inner = ", ".join(shown(each, depth + 1) for each in value[:20])
        return f"[{inner}]" if type(value) is list else f"({inner})"
    if isinstance(value, dict) and depth < 4:
        return (
            "{"
            + ", ".join(
                sorted(f"{shown(k, depth + 1)}: {shown(v, depth + 1)}" for k, v in list(value.items())[:20])
            )
            + "}"
        )
    if isinstance(value, (set, frozenset)):
        return "{" + ", ".join(sorted(shown(each, depth + 1) for each in value)) + "}"
    kind = type(value).__name__
    if type(value).__repr__ is object.__repr__:
        return f"an object {kind}"
    if kind in ("Timer", "Thread", "UpdateContext", "EntryContext"):
        return f"an object {kind}"
    text = CHANGING.sub("#", repr(value))
    if kind.startswith("float"):  # numpy's values, whose format differs between numpy versions
        return CHANGING.sub("#", repr(float(value)))
    if kind in ("str", "bytes", "int", "float", "bool", "NoneType"):
        return text[:300]
    return f"{kind}: {re.sub(r'<[a-z0-9_.]*[.]', '<', text)[:300]}"


def outcome(function, arguments):
    """Return the value or exception of a call, and its output."""
    out, err = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = printed, _ = io.StringIO(), io.StringIO()
    try:
        said = shown(function(*arguments))
    except SystemExit as error:
        said = f"exits with {CHANGING.sub('#', repr(error.code))}"
    except KeyboardInterrupt:
        said = "raises KeyboardInterrupt"
    except Exception as error:  # noqa: BLE001 - whatever it is
        said = (
            f"raises {'AttributeError or TypeError' if isinstance(error, MIX_UP) else type(error).__name__}"
        )
    finally:
        sys.stdout, sys.stderr = out, err
    text = CHANGING.sub("#", printed.getvalue())[:200]
    return f"{said} and prints {text!r}" if text else said


def cases(module, required, has_optional):
    """Return the arguments of each call, as expressions, by label."""
    found = {"nothing": []}
    if required or has_optional:
        count = max(1, len(required))
        found.update({"None": ["None"] * count, "0.5": ["0.5"] * count, "object": ["object()"] * count})
    if required:
        found["normal"] = [normal(module, each) for each in required]
    return found


def normal(module, parameter):
    """Return the expression for a parameter's normal value."""
    return NORMAL_OF.get(f"{module}.{parameter}") or NORMAL.get(parameter, "'/x'")


def run(module, name, required, has_optional, todo, names, pipe):
    """Make those calls of a name that are in ``todo``, and write one line for each."""
    if not module.startswith("rospy"):
        # Most modules' objects need the time, which init_node initializes.
        names["rospy"].rostime.set_rostime_initialized(True)
    home = importlib.import_module(module)
    owner, _, member = name.partition(".")
    target = getattr(home, owner)
    for label, expressions in cases(module, required, has_optional).items():
        if label not in todo:
            continue
        try:
            arguments = [eval(each, names) for each in expressions]
            function = getattr(made(module, owner, target, names), member) if member else target
            if AT_RANDOM.search(name) or (member and getattr(function, "__module__", "") in NOT_OF_ROS):
                os.write(pipe, (json.dumps([label, "not called"]) + "\n").encode())
                continue
        except Exception as error:  # noqa: BLE001
            said = f"no object: {type(error).__name__}"
        else:
            said = outcome(function, arguments)
        os.write(pipe, (json.dumps([label, said]) + "\n").encode())


def made(module, owner, target, names):
    """Return an object of a class, on which to call its members."""
    if not inspect.isclass(target):
        return target
    if f"{module}.{owner}" in OBJECTS:
        return eval(OBJECTS[f"{module}.{owner}"], names)
    out, sys.stdout = sys.stdout, io.StringIO()
    try:
        required = CONSTRUCTORS.get(f"{module}.{owner}", [])
        return target(*(eval(normal(module, each), names) for each in required))
    finally:
        sys.stdout = out


CONSTRUCTORS = {}


def main():
    warnings.simplefilter("ignore")
    task = json.load(sys.stdin)
    left_out, seconds = set(task["left_out"]), task["seconds"]
    for module in {module for module, *_ in task["names"]}:
        importlib.import_module(module)
    for module, name, required, _ in task["names"]:
        if "." not in name:
            CONSTRUCTORS[f"{module}.{name}"] = required
    names = namespace()
    # A fork then copies fewer pages.
    gc.collect()
    gc.freeze()
    logging.disable(logging.CRITICAL)
    master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    _, _, before = master.getSystemState("/test")
    for module, name, required, has_optional in task["names"]:
        if (state := master.getSystemState("/test")[2]) != before:
            forget(master, before, state)
        todo = [
            each
            for each in cases(module, required, has_optional)
            if f"{module}.{name} {each}" not in left_out
        ]
        while todo:
            found, ended = in_child(module, name, required, has_optional, todo, names, seconds)
            for label, said in found:
                print(f"{module}.{name} {label}\t{json.dumps(said)}", flush=True)
                todo.remove(label)
            if not ended and todo:
                print(f'{module}.{name} {todo.pop(0)}\t"waits"', flush=True)
            elif todo:
                print(f'{module}.{name} {todo.pop(0)}\t"ends the process"', flush=True)


def forget(master, before, state):
    """Unregister from the master everything that killed children have registered."""
    methods = (("unregisterPublisher", True), ("unregisterSubscriber", True), ("unregisterService", False))
    for (method, is_topic), old, new in zip(methods, before, state, strict=True):
        known = dict(old)
        for name, nodes in new:
            for node in set(nodes) - set(known.get(name, ())):
                uri = (
                    master.lookupNode("/test", node)[2]
                    if is_topic
                    else master.lookupService("/test", name)[2]
                )
                getattr(master, method)(node, name, uri)


def in_child(module, name, required, has_optional, todo, names, seconds):
    """Make calls in a child process; return their results, and whether the child exited by itself."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        os.setsid()
        os.close(read)
        quiet = os.open(os.devnull, os.O_RDWR)
        for number in (0, 1, 2):
            os.dup2(quiet, number)
        try:
            run(module, name, required, has_optional, list(todo), names, write)
        finally:
            os._exit(0)
    os.close(write)
    text = b""
    ended = False
    while select.select([read], [], [], seconds)[0]:
        part = os.read(read, 65536)
        if not part:
            ended = True
            break
        text += part
    os.close(read)
    try:
        os.killpg(child, signal.SIGKILL)
    except ProcessLookupError:
        pass
    os.waitpid(child, 0)
    return [json.loads(line) for line in text.decode().splitlines()], ended


if __name__ == "__main__":
    main()
