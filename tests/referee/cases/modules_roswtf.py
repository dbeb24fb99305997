"""roswtf's context, its checks of the environment, and its output, in plugins and programs."""

import os

import roswtf
import roswtf.context
import roswtf.environment as environment
from referee import outcome, printed, show
from roswtf.context import WtfContext, WtfException
from roswtf.model import WtfError, WtfWarning

show(WtfException.__mro__[1:2], WtfContext.__slots__)
variables = {
    "PATH": "/bin",
    "ROS_ROOT": "/x/ros",
    "ROS_PACKAGE_PATH": "/nope1:/nope2",
    "PYTHONPATH": "/nope/roslib:/nope3/roslib",
    "ROS_HOME": "/nope",
}
context = WtfContext.from_env(variables)
show(context.env, context.ros_root, context.ros_package_path, context.pythonpath, context.pkg, context.pkgs)
show(
    type(context.rospack).__name__,
    type(context.rosstack).__name__,
    context.ros_master_uri == os.environ["ROS_MASTER_URI"],
)
environment.wtf_check_environment(context)
show([each.msg for each in context.warnings])
show([(each.msg, each.return_val) for each in context.errors])
printed("results", lambda: roswtf.print_results(context))
printed("no results", lambda: roswtf.print_results(WtfContext()))
context.warnings = [WtfWarning("w1 x", "w1 %(pkg)s", ["x"])]
printed("yaml", lambda: roswtf.yaml_results(context))
context.errors = [WtfError("e")]
printed("results", lambda: roswtf.print_results(context))

show("# single checks")
open("file", "w").close()
for value in (None, "/", "/nope", os.path.abspath("file")):
    outcome(str(value)[:5], lambda v=value: environment._writable_dir_check(None, v, "NAME"))
for value in ("/x/ros", "/x/ros/", "/x/rosbuild", "/x/other", ""):
    outcome(f"root {value}", lambda v=value: environment.ros_root_check(None, v))


class Context:
    """The attributes that the checks read."""

    def __init__(self, **env):
        self.env = env
        self.ros_root, self.pythonpath = "/x/ros", env.get("PYTHONPATH")
        self.ros_master_uri = env.get("ROS_MASTER_URI", "")


for env in (
    {"PATH": "/bin"},
    {"PATH": "/usr/bin:/x/ros"},
    {"ROSCONSOLE_CONFIG_FILE": "/nope"},
    {"ROSCONSOLE_CONFIG_FILE": "file"},
    {"ROS_MASTER_URI": "http://localhost:1"},
    {"ROS_MASTER_URI": "http://no.such.host.invalid:1"},
    {"ROS_MASTER_URI": "x"},
    {"ROS_MASTER_URI": "http://h:1:2"},
    {"ROS_LOG_DIR": "/nope", "ROS_TEST_RESULTS_DIR": "/nope"},
    {"PYTHONPATH": "/a/roslib"},
):
    for check in (
        environment.path_check,
        environment.rosconsole_config_file_check,
        environment.ros_master_uri_hostname,
        environment.ros_home_check,
        environment.ros_log_dir_check,
        environment.ros_test_results_dir_check,
        environment.pythonpath_check,
    ):
        outcome(f"{check.__name__} {env}", lambda c=check, e=env: c(Context(**e)))

show("# packages")
for make in (lambda: WtfContext.from_package("nope"), lambda: WtfContext.from_stack("nope")):
    try:
        make()
    except WtfException as error:
        show(str(error).partition("\n")[0])
try:
    WtfContext.from_roslaunch(["/nope.launch"])
except WtfException as error:
    show(str(error).partition("]")[0])
context = WtfContext.from_package("std_msgs")
show(
    context.pkg,
    os.path.basename(context.pkg_dir),
    os.path.basename(context.manifest_file),
    context.stack,
    context.pkgs[0],
    "std_msgs" in context.pkgs,
)
