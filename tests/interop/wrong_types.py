"""Call each function of ROS's modules with no argument, None, wrong types and a normal name; print each result.

Runs under real ROS and under minirospy; test_interop_wrong_types.py compares the two.
"""

import inspect
import io
import re
import sys
import warnings

warnings.simplefilter("ignore")

import genmsg.msgs  # noqa: E402
import genmsg.names  # noqa: E402
import genpy.base  # noqa: E402
import genpy.message  # noqa: E402
import rosgraph.names  # noqa: E402
import rosgraph.network  # noqa: E402
import rosgraph.rosenv  # noqa: E402
import roslib.names  # noqa: E402
import rosmsg  # noqa: E402
import rosnode  # noqa: E402
import rosparam  # noqa: E402
import rospy.names  # noqa: E402
import rosservice  # noqa: E402
import rostopic  # noqa: E402

MODULES = (
    rosgraph.names, rosgraph.network, rosgraph.rosenv, roslib.names, rospy.names, genmsg.names, genmsg.msgs, genpy.base,
    genpy.message, rostopic, rosnode, rosservice, rosparam, rosmsg,
)  # fmt: skip
OF = (
    "rosgraph",
    "roslib",
    "rospy",
    "genmsg",
    "genpy",
    "rostopic",
    "rosservice",
    "rosparam",
    "rosmsg",
    "rosnode",
    "minirospy",
)
VALUES = (None, 3, b"x", "", "x", "/x/y", "~p", ["a"], {"a": 1}, 2.5, True, object())
# Functions whose results differ at each call, that resolve host names, read the terminal, wait for a service, write a
# file or create a node; and parts of a YAML loader.
LEFT_OUT = re.compile(
    r"local_address|get_host_name|anonymous_name|handshake_header$"
    r"|main$|^stdin_|^rosmsg_cmd|^(construct|represent)_|publish|subscriber|^call_service$"
    r"|^rosnode_cleanup$|^dump_params$|^fullusage$"
)
CHANGING = re.compile(r"0x[0-9a-f]+|_\d+_\d+|\d{8,}|/(usr|work|tmp|home|root|opt)[^ '\"]*")


def outcome(function, arguments):
    """Return a call's value, or that it raises an exception. The exception's type depends on which operation fails first."""
    out, err, sys.stdout, sys.stderr = sys.stdout, sys.stderr, io.StringIO(), io.StringIO()
    try:
        result = function(*arguments)
        result = list(result) if inspect.isgenerator(result) else result
    except SystemExit as error:
        return f"exits with {error.code}"
    except Exception:  # noqa: BLE001 - whatever it is
        return "raises"
    finally:
        sys.stdout, sys.stderr = out, err
    return "a function" if inspect.isroutine(result) else CHANGING.sub("#", repr(result))[:300]


def main():
    for module in MODULES:
        for name in sorted(vars(module)):
            function = getattr(module, name)
            home = (getattr(function, "__module__", None) or "").split(".")[0]
            if name[0] == "_" or not inspect.isfunction(function) or home not in OF or LEFT_OUT.search(name):
                continue
            plain = [
                each
                for each in inspect.signature(function).parameters.values()
                if each.default is each.empty and each.kind is each.POSITIONAL_OR_KEYWORD
            ]
            others = ("x",) * (len(plain) - 1)
            calls = [(), *((value, *others) for value in VALUES)]
            calls += [(*others, value) for value in VALUES] if others else []
            if name == "load_file":
                # Real rosparam treats a number as a file descriptor, and closes it.
                calls = [each for each in calls if not each or not isinstance(each[0], int)]
            for arguments in calls:
                shown = CHANGING.sub("#", repr(arguments))
                print(f"{module.__name__}.{name}{shown}\t{outcome(function, arguments)}")


if __name__ == "__main__":
    main()
