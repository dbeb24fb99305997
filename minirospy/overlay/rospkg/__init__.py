"""rospkg, filled in by minirospy: where packages are, and what they need."""

from minirospy.workspace.rospkg import MANIFEST_FILE as MANIFEST_FILE
from minirospy.workspace.rospkg import PACKAGE_FILE as PACKAGE_FILE
from minirospy.workspace.rospkg import STACK_FILE as STACK_FILE
from minirospy.workspace.rospkg import InvalidManifest as InvalidManifest
from minirospy.workspace.rospkg import Manifest as Manifest
from minirospy.workspace.rospkg import ResourceNotFound as ResourceNotFound
from minirospy.workspace.rospkg import RosPack as RosPack
from minirospy.workspace.rospkg import RosStack as RosStack
from minirospy.workspace.rospkg import expand_to_packages as expand_to_packages
from minirospy.workspace.rospkg import get_etc_ros_dir as get_etc_ros_dir
from minirospy.workspace.rospkg import get_log_dir as get_log_dir
from minirospy.workspace.rospkg import get_package_name as get_package_name
from minirospy.workspace.rospkg import get_ros_home as get_ros_home
from minirospy.workspace.rospkg import get_ros_package_path as get_ros_package_path
from minirospy.workspace.rospkg import get_ros_paths as get_ros_paths
from minirospy.workspace.rospkg import get_ros_root as get_ros_root
from minirospy.workspace.rospkg import get_stack_version_by_dir as get_stack_version_by_dir
from minirospy.workspace.rospkg import get_test_results_dir as get_test_results_dir
from minirospy.workspace.rospkg import list_by_path as list_by_path
from minirospy.workspace.rospkg import on_ros_path as on_ros_path
from minirospy.workspace.rospkg import parse_manifest_file as parse_manifest_file
from rospkg import common as common
from rospkg import environment as environment
from rospkg import manifest as manifest
from rospkg import rospack as rospack

__version__ = "1.4.0"
