"""Finds the rule files that packages export: `<export><rosbag migration_rule_file="rules.bmr"/></export>`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

__all__ = ["plugin_rule_files"]

_PLUGIN_TAGS = (
    ("rosbagmigration", "rule_file"),
    ("rosbag", "migration_rule_file"),
    ("rosbag_migration_rule", "rule_file"),
)


def plugin_rule_files() -> Iterator[tuple[Path, str]]:
    """Yield the path and name of each rule file that a package exports."""
    from minirospy.base.errors import ManifestError
    from minirospy.workspace.manifest import read_manifest
    from minirospy.workspace.packages import Packages

    for package, folder in sorted(Packages().folders().items()):
        manifest = folder / "package.xml"
        try:
            if not manifest.exists() or not any(
                tag in manifest.read_text("utf-8", "replace") for tag, _ in _PLUGIN_TAGS
            ):
                continue
            exports = read_manifest(manifest).exports
        except (ManifestError, OSError):
            continue
        for export in exports:
            for tag, attribute in _PLUGIN_TAGS:
                if export.tag == tag and attribute in export.attributes:
                    file = export.attributes[attribute]
                    if tag == "rosbagmigration":
                        print(
                            f"WARNING: The package: [{package}] is using a deprecated rosbagmigration export.\n"
                            "    The export in the manifest should be changed to:\n"
                            f'    <rosbag migration_rule_file="{file}"/>\n',
                            file=sys.stderr,
                        )
                    yield folder / file, file
