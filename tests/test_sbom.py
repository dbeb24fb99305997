"""A wheel's bill of materials: its contents with licences; a part that differs from its description is rejected."""

from __future__ import annotations

import hashlib
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tools.sbom import VENDOR, SbomError, make_sbom

METADATA = """Metadata-Version: 2.4
Name: minirospy
Version: 0.1.0
Summary: ROS 1
License: BSD-3-Clause
Requires-Dist: PyYAML>=6.0
Requires-Dist: rich>=13
Requires-Dist: pillow>=10; extra == 'images'

# minirospy
"""
MANIFEST = (
    "<package><name>std_msgs</name><version>0.5.13</version><description>d</description>"
    "<license>BSD</license></package>"
)
SCRIPT = b"export {}"
BUNDLE = b"export{}"


def _wheel(folder: Path, **changed: str) -> Path:
    files = {
        "minirospy-0.1.0.dist-info/METADATA": METADATA,
        "minirospy/share/msgs/std_msgs/package.xml": MANIFEST,
        "minirospy/share/msgs/std_msgs/msg/Bool.msg": "bool data\n",
        f"{VENDOR}dagre/dagre.esm.js": SCRIPT.decode(),
        f"{VENDOR}dagre/dagre.min.js": BUNDLE.decode(),
        f"{VENDOR}dagre/LICENSE.txt": "MIT",
        f"{VENDOR}versions.json": json.dumps(
            {
                "dagre": {
                    "name": "@dagrejs/dagre",
                    "version": "3.1.3",
                    "license": "MIT",
                    "files": {
                        "dist/dagre.esm.js": hashlib.sha256(SCRIPT).hexdigest(),
                        "LICENSE": hashlib.sha256(b"MIT").hexdigest(),
                    },
                    "bundle": {"file": "dagre.min.js", "sha256": hashlib.sha256(BUNDLE).hexdigest()},
                }
            }
        ),
        **changed,
    }
    path = folder / "minirospy-0.1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return path


@pytest.fixture
def bom(tmp_path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(make_sbom(_wheel(tmp_path), 86_400))
    return found


def test_sbom_describes_the_wheel(bom: dict[str, Any], tmp_path: Path) -> None:
    digest = hashlib.sha256((tmp_path / "minirospy-0.1.0-py3-none-any.whl").read_bytes()).hexdigest()
    assert (bom["bomFormat"], bom["specVersion"], bom["metadata"]["timestamp"]) == (
        "CycloneDX",
        "1.5",
        "1970-01-02T00:00:00Z",
    )
    wheel = bom["metadata"]["component"]
    assert wheel["purl"] == "pkg:pypi/minirospy@0.1.0"
    assert wheel["licenses"] == [{"license": {"id": "BSD-3-Clause"}}]
    assert wheel["hashes"] == [{"alg": "SHA-256", "content": digest}]


def test_sbom_has_dependencies_without_those_of_extras(bom: dict[str, Any]) -> None:
    assert [(part["purl"], part["properties"][0]["value"]) for part in bom["components"]] == [
        ("pkg:pypi/pyyaml", ">=6.0"),
        ("pkg:pypi/rich", ">=13"),
    ]
    assert bom["dependencies"][0]["dependsOn"] == ["pkg:pypi/pyyaml", "pkg:pypi/rich"]


def test_sbom_lists_contents_with_licences(bom: dict[str, Any]) -> None:
    dagre, messages = bom["metadata"]["component"]["components"]
    assert (dagre["purl"], dagre["licenses"]) == (
        "pkg:npm/%40dagrejs/dagre@3.1.3",
        [{"license": {"id": "MIT"}}],
    )
    assert [file["name"] for file in dagre["components"]] == [
        f"{VENDOR}dagre/dagre.esm.js",
        f"{VENDOR}dagre/LICENSE.txt",
        f"{VENDOR}dagre/dagre.min.js",
    ]
    assert (messages["name"], messages["version"]) == ("std_msgs", "0.5.13")
    assert messages["licenses"] == [{"license": {"name": "BSD"}}]


def test_sbom_of_a_wheel_and_a_time_is_always_the_same(tmp_path: Path) -> None:
    wheel = _wheel(tmp_path)
    assert make_sbom(wheel, 7) == make_sbom(wheel, 7)


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        (f"{VENDOR}dagre/dagre.esm.js", "export {changed}", "not the file that"),
        (f"{VENDOR}dagre/dagre.min.js", "export{changed}", "not the file that"),
        (
            "minirospy/share/msgs/std_msgs/package.xml",
            "<package><name>std_msgs</name><version>1.0.0</version></package>",
            "its name, version or licence is missing",
        ),
    ],
)
def test_part_that_is_not_as_described_is_named(tmp_path: Path, name: str, text: str, reason: str) -> None:
    with pytest.raises(SbomError, match=reason) as found:
        make_sbom(_wheel(tmp_path, **{name: text}), 0)
    assert str(found.value).startswith(name)
