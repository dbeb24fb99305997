"""Write a wheel's bill of materials as CycloneDX 1.5 (https://cyclonedx.org/docs/1.5/json/): `python tools/sbom.py WHEEL > FILE`.

The input is only the wheel: its metadata, the page's libraries with their licences, the packages of message definitions. The
same wheel and time give the same bytes. pip will choose the versions of dependencies: the file has their ranges.
"""

from __future__ import annotations

import email
import hashlib
import json
import re
import sys
import uuid
import zipfile
from datetime import datetime, timezone
from pathlib import Path
from urllib.parse import quote
from xml.etree import ElementTree

__all__ = ["SbomError", "make_sbom"]

VENDOR = "minirospy/web/dashboard/page/vendor/"
DEFINITIONS = "minirospy/share/msgs/"

Json = dict[str, object]


class SbomError(Exception):
    """A part of the wheel differs from its description; the text names the file."""


def make_sbom(wheel: Path, seconds: int) -> str:
    """Return the text of the wheel's bill of materials, made at ``seconds`` (Unix time). Raise SbomError if a part is wrong."""
    with zipfile.ZipFile(wheel) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    (metadata,) = (data for name, data in files.items() if name.endswith(".dist-info/METADATA"))
    project = email.message_from_bytes(metadata)
    name, version = project["Name"], project["Version"]

    root = f"pkg:pypi/{name}@{version}"
    required = [_requirement(line) for line in project.get_all("Requires-Dist", []) if "extra ==" not in line]
    parts = [*_page_libraries(files), *_definitions(files)]
    bom: Json = {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": uuid.uuid5(uuid.NAMESPACE_URL, digest).urn,
        "version": 1,
        "metadata": {
            "timestamp": datetime.fromtimestamp(seconds, timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "component": {
                "type": "library",
                "bom-ref": root,
                "name": name,
                "version": version,
                "description": project["Summary"],
                "licenses": [{"license": {"id": project["License"]}}],
                "hashes": [{"alg": "SHA-256", "content": digest}],
                "purl": root,
                # These are the contents of the wheel itself; packages that pip installs with it are below.
                "components": parts,
            },
        },
        "components": required,
        "dependencies": [
            {"ref": root, "dependsOn": [part["bom-ref"] for part in required]},
            *({"ref": part["bom-ref"], "dependsOn": []} for part in required),
        ],
    }
    return json.dumps(bom, indent=1, ensure_ascii=False) + "\n"


def _requirement(line: str) -> Json:
    """Return the component of a line such as ``PyYAML>=6.0``."""
    found = re.match(r"([A-Za-z0-9._-]+)\s*(?:\[.*?\])?\s*(.*)", line)
    assert found
    name = re.sub(r"[-_.]+", "-", found[1]).lower()
    return {
        "type": "library",
        "bom-ref": f"pkg:pypi/{name}",
        "name": name,
        "scope": "required",
        "purl": f"pkg:pypi/{name}",
        "properties": [{"name": "minirospy:requirement", "value": found[2]}],
    }


def _page_libraries(files: dict[str, bytes]) -> list[Json]:
    """Return the npm libraries of the dashboard's page."""
    found: list[Json] = []
    for folder, entry in json.loads(files[f"{VENDOR}versions.json"]).items():
        inside: list[Json] = []
        described = {Path(path).name: digest for path, digest in entry["files"].items()}
        if bundle := entry.get("bundle"):
            # This is esbuild's output for those parts of the library that the page uses.
            described[bundle["file"]] = bundle["sha256"]
        for file, expected in described.items():
            name = VENDOR + folder + "/" + (f"{file}.txt" if file == "LICENSE" else file)
            if name not in files:
                raise SbomError(f"{name}: missing")
            digest = hashlib.sha256(files[name]).hexdigest()
            if digest != expected:
                raise SbomError(f"{name}: not the file that {VENDOR}versions.json describes")
            inside.append({"type": "file", "name": name, "hashes": [{"alg": "SHA-256", "content": digest}]})

        purl = f"pkg:npm/{quote(entry['name'])}@{entry['version']}"
        part: Json = {
            "type": "library",
            "bom-ref": purl,
            "name": entry["name"],
            "version": entry["version"],
            "licenses": [{"license": {"id": entry["license"]}}],
            "purl": purl,
            "components": inside,
        }
        found.append(part)
    return found


def _definitions(files: dict[str, bytes]) -> list[Json]:
    """Return the packages of message definitions, as their package.xml describes them."""
    found: list[Json] = []
    for name in sorted(files):
        if not re.fullmatch(f"{DEFINITIONS}[^/]+/package.xml", name):
            continue
        manifest = ElementTree.fromstring(files[name])
        texts = {tag: (manifest.findtext(tag) or "").strip() for tag in ("name", "version", "license")}
        if not all(texts.values()):
            raise SbomError(f"{name}: its name, version or licence is missing")
        part: Json = {
            "type": "data",
            "bom-ref": f"ros:{texts['name']}@{texts['version']}",
            "name": texts["name"],
            "version": texts["version"],
            "description": (manifest.findtext("description") or "").strip(),
            # "BSD", used in ROS's packages, is not an SPDX name.
            "licenses": [{"license": {"name": texts["license"]}}],
        }
        found.append(part)
    return found


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python tools/sbom.py WHEEL")
    print(make_sbom(Path(sys.argv[1]), int(Path(sys.argv[1]).stat().st_mtime)), end="")
