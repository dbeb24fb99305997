"""rospkg, provided by minirospy: where packages are, and what they need."""

from minirospy.ros.rospkg.rospkg import __version__ as __version__
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE as MANIFEST_FILE
from minirospy.ros.rospkg.rospkg.common import PACKAGE_FILE as PACKAGE_FILE
from minirospy.ros.rospkg.rospkg.common import STACK_FILE as STACK_FILE
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound as ResourceNotFound
from minirospy.ros.rospkg.rospkg.environment import get_etc_ros_dir as get_etc_ros_dir
from minirospy.ros.rospkg.rospkg.environment import get_log_dir as get_log_dir
from minirospy.ros.rospkg.rospkg.environment import get_ros_home as get_ros_home
from minirospy.ros.rospkg.rospkg.environment import get_ros_package_path as get_ros_package_path
from minirospy.ros.rospkg.rospkg.environment import get_ros_paths as get_ros_paths
from minirospy.ros.rospkg.rospkg.environment import get_ros_root as get_ros_root
from minirospy.ros.rospkg.rospkg.environment import get_test_results_dir as get_test_results_dir
from minirospy.ros.rospkg.rospkg.environment import on_ros_path as on_ros_path
from minirospy.ros.rospkg.rospkg.manifest import InvalidManifest as InvalidManifest
from minirospy.ros.rospkg.rospkg.manifest import Manifest as Manifest
from minirospy.ros.rospkg.rospkg.manifest import parse_manifest_file as parse_manifest_file
from minirospy.ros.rospkg.rospkg.rospack import RosPack as RosPack
from minirospy.ros.rospkg.rospkg.rospack import RosStack as RosStack
from minirospy.ros.rospkg.rospkg.rospack import expand_to_packages as expand_to_packages
from minirospy.ros.rospkg.rospkg.rospack import get_package_name as get_package_name
from minirospy.ros.rospkg.rospkg.rospack import get_stack_version_by_dir as get_stack_version_by_dir
from minirospy.ros.rospkg.rospkg.rospack import list_by_path as list_by_path
from rospkg import common as common
from rospkg import environment as environment
from rospkg import manifest as manifest
from rospkg import rospack as rospack
