"""rospkg.manifest, provided by minirospy: a package.xml as rospkg shows it."""

from minirospy.ros.rospkg.rospkg.manifest import (
    Depend,
    Export,
    InvalidManifest,
    Manifest,
    RosDep,
    parse_manifest_file,
)

__all__ = ["Depend", "Export", "InvalidManifest", "Manifest", "RosDep", "parse_manifest_file"]
