# ruff: noqa: E501, BLE001
"""Private names, and names of the generator, that programs use nevertheless."""

import os
import sys

import genmsg
import genpy.generator
import roslib.packages
import rospkg.environment
import rospy
import rospy.topics
import rostopic
from geometry_msgs.msg import Pose, PoseArray
from referee import show

ROOT = os.path.join(os.environ["ROS_HOME"], "private")
for name in ("a/x.txt", "a/b/x.txt", "a/.git/x.txt", "c/x.txt", "c/y.txt"):
    os.makedirs(os.path.dirname(os.path.join(ROOT, name)), exist_ok=True)
    open(os.path.join(ROOT, name), "w").close()
os.symlink(os.path.join(ROOT, "c"), os.path.join(ROOT, "a", "link"))


def outcome(label, function, *arguments):
    try:
        found = function(*arguments)
    except Exception as error:
        found = type(error).__name__
    show(label, str(found).replace(ROOT, "ROOT").replace(os.path.expanduser("~"), "HOME"))


outcome("find", lambda: sorted(roslib.packages._find_resource(os.path.join(ROOT, "a"), "x.txt")))
outcome("find nothing", roslib.packages._find_resource, ROOT, "z.txt")
outcome("find filtered", roslib.packages._find_resource, ROOT, "y.txt", lambda path: False)
outcome("subfolder", roslib.packages._get_pkg_subdir_by_dir, ROOT, "new")
outcome("is there", os.path.isdir, os.path.join(ROOT, "new"))
outcome("no subfolder", roslib.packages._get_pkg_subdir_by_dir, ROOT, "other", False)
outcome("is there", os.path.isdir, os.path.join(ROOT, "other"))

for both in ((None, None), ("/r", None), (None, "/a:/b"), ("/r", "/a::/b:"), ("", "")):
    outcome(f"paths {both}", rospkg.environment._compute_package_paths, *both)
for path in ("", "/a", "~/a", "a~"):
    outcome(f"path {path!r}", rospkg.environment._resolve_path, path)
    outcome(f"paths {path!r}", rospkg.environment._resolve_paths, f"{path}:/b:~/c")

for name in ("String", "std_msgs/String", "a/b/c"):
    outcome(f"type {name}", genpy.generator.compute_pkg_type, "my_msgs", name)
for name in ("x", "from", "self", "a.b", "a.lambda", "print", "None"):
    outcome(f"field {name}", genpy.generator._remap_reserved, name)
spec = genmsg.msg_loader.load_msg_from_string(
    genmsg.MsgContext.create_default(), "int32 if=3\nint32 from\nstring name\n", "my_msgs/Odd"
)
safe = genpy.generator.make_python_safe(spec)
show(safe.names, safe.types, [(each.name, each.val) for each in safe.constants], safe.full_name)
show(rospy.topics._logger.name)

poses = PoseArray(poses=[Pose(), Pose()])
poses.poses[1].position.x = 3
sys.stderr = sys.stdout
for pattern in ("", "/", "poses", "/poses[1]/position/x", "/poses[:]/position/x", "poses[5]", "/nope", "/header/nope", "~p", "a b",
                "/poses[", "/poses[]", "/poses[a]", "/poses[b:1]", "/poses[1:b]", "/poses[::b]", "/poses[0:1:1:1]", "poses[0:9:2]", "poses[1:]/position/x", "//poses[0]//position"):  # fmt: skip
    function = rostopic.msgevalgen(pattern)
    show(f"field {pattern!r}", "none" if function is None else str(function(poses)).split())
