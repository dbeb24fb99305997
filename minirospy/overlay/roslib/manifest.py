"""roslib.manifest, provided by minirospy: the manifest.xml of rosbuild."""

from minirospy.ros.roslib.roslib.manifest import (
    Depend,
    Export,
    Manifest,
    ManifestException,
    ROSDep,
    VersionControl,
    load_manifest,
    manifest_file,
    parse,
    parse_file,
)
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE

__all__ = [
    "MANIFEST_FILE",
    "Depend",
    "Export",
    "Manifest",
    "ManifestException",
    "ROSDep",
    "VersionControl",
    "load_manifest",
    "manifest_file",
    "parse",
    "parse_file",
]
