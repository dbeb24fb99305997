"""The page's files: files that are loaded exist, nothing is inline, libraries match their digests, the size is limited."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path, PurePosixPath

from minirospy.web.dashboard.files import FOLDER, SECURITY, read_folder

FILES = read_folder()
VENDOR = FOLDER / "vendor"
OWN = sorted(path for path in FOLDER.rglob("*") if path.is_file() and VENDOR not in path.parents)
SCRIPTS = [path for path in OWN if path.suffix == ".js"]
assert len(SCRIPTS) > 20


def test_index_is_served_at_the_root() -> None:
    assert FILES["/"] is FILES["/index.html"]
    assert FILES["/"].content_type.startswith("text/html")


def test_every_file_of_the_folder_is_served_but_versions_and_types() -> None:
    names = {"/" + path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.is_file()}
    types = {name for name in names if name.endswith(".d.ts")}
    assert names - set(FILES) - types == {"/vendor/versions.json"}


def test_page_loads_files_that_exist() -> None:
    loaded = re.findall(r'(?:src|href)="([^"#]+)"', (FOLDER / "index.html").read_text(encoding="utf-8"))
    assert len(loaded) > 3
    assert [name for name in loaded if f"/{name}" not in FILES] == []


def test_imports_of_scripts_exist() -> None:
    for script in SCRIPTS:
        text = script.read_text(encoding="utf-8")
        names = re.findall(r'^(?:import|export) [^;]*?from "([^"]+)";$', text, re.MULTILINE)
        names += re.findall(r'new URL\("([^"]+)", import', text)
        assert text.count("\nimport ") + text.startswith("import ") <= len(names), script
        assert [name for name in names if not (script.parent / name).exists()] == [], script


def test_scripts_make_no_html_of_text() -> None:
    for script in SCRIPTS:
        found = re.findall(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function|DOMParser",
            script.read_text(encoding="utf-8"),
        )
        assert found == [], script


def test_page_has_nothing_inline() -> None:
    text = (FOLDER / "index.html").read_text(encoding="utf-8")
    assert re.findall(r"<script(?![^>]*\bsrc=)|<style|\son\w+=|\sstyle=|javascript:", text) == []
    policy = SECURITY["Content-Security-Policy"]
    assert "unsafe" not in policy
    assert "default-src 'none'" in policy


def test_vendored_files_are_those_that_are_named() -> None:
    packages = json.loads((VENDOR / "versions.json").read_text(encoding="utf-8"))
    found = {
        path.relative_to(VENDOR)
        for path in VENDOR.rglob("*")
        if path.is_file() and not path.name.endswith((".d.ts", "versions.json"))
    }
    for folder, package in packages.items():
        assert package["integrity"].startswith("sha512-")
        assert package["license"] == "MIT"
        assert "LICENSE" in package["files"]
        for name, digest in package["files"].items():
            path = Path(folder, "LICENSE.txt" if name == "LICENSE" else PurePosixPath(name).name)
            found.remove(path)
            # Git may have changed the line endings (Windows).
            body = (VENDOR / path).read_bytes().replace(b"\r\n", b"\n")
            assert hashlib.sha256(body).hexdigest() == digest, path
        if bundle := package.get("bundle"):
            path = Path(folder, bundle["file"])
            found.remove(path)
            body = (VENDOR / path).read_bytes().replace(b"\r\n", b"\n")
            assert hashlib.sha256(body).hexdigest() == bundle["sha256"], path
    assert found == set()


def test_page_is_small() -> None:
    sizes = {path: len(file.packed) for path, file in FILES.items() if path != "/"}
    on_demand = sum(size for path, size in sizes.items() if path.startswith(("/vendor/three/", "/js/scene/")))
    assert sum(sizes.values()) - on_demand < 300_000
    # These files are loaded when the 3D view is first opened.
    assert on_demand < 300_000
