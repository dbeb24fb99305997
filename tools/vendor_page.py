"""Refresh the libraries of the dashboard's page from npm: `python tools/vendor_page.py`, then check `git diff`.

``versions.json`` in the folder has each package, its version, npm's digest of its archive, and the files to take, with
the SHA-256 of each. For a new version: change it there, delete its "integrity", and run this. npm must be installed.

The esbuild version given there combines a package with a "bundle" into one file, which contains only the exports that a
script next to this one takes from the package. The page has no build step: the file is in the repository.
"""

from __future__ import annotations

import base64
import hashlib
import json
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "minirospy" / "web" / "dashboard" / "page" / "vendor"


def main() -> int:
    """Fetch every package; return the exit status."""
    packages = json.loads((FOLDER / "versions.json").read_text(encoding="utf-8"))
    for folder, package in packages.items():
        with tempfile.TemporaryDirectory() as scratch:
            name = f"{package['name']}@{package['version']}"
            done = subprocess.run(
                ["npm", "pack", "--silent", name], cwd=scratch, check=True, capture_output=True, text=True
            )
            archive = Path(scratch, done.stdout.split()[-1])
            digest = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
            integrity = f"sha512-{digest}"
            if package.setdefault("integrity", integrity) != integrity:
                print(f"{name}: the archive is not the one that versions.json names", file=sys.stderr)
                return 1
            with tarfile.open(archive) as tar:
                for path in package["files"]:
                    member = tar.extractfile(f"package/{path}")
                    assert member, path
                    body = _without_map(member.read())
                    target = FOLDER / folder / _file_name(path)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    target.write_bytes(body)
                    package["files"][path] = hashlib.sha256(body).hexdigest()
                if bundle := package.get("bundle"):
                    tar.extractall(Path(scratch, "node_modules"), filter="data")
                    Path(scratch, "node_modules", "package").rename(Path(scratch, "node_modules", folder))
                    body = _bundle(bundle, Path(scratch))
                    (FOLDER / folder / bundle["file"]).write_bytes(body)
                    bundle["sha256"] = hashlib.sha256(body).hexdigest()
        print(f"{folder}: {name}")
    (FOLDER / "versions.json").write_text(json.dumps(packages, indent=2) + "\n", encoding="utf-8")
    return 0


def _bundle(bundle: dict[str, str], scratch: Path) -> bytes:
    """Return a minified module with the entry's exports; the package is in ``scratch/node_modules``."""
    entry = Path(shutil.copy(Path(__file__).parent / bundle["entry"], scratch))
    words = ["npx", "--yes", f"esbuild@{bundle['esbuild']}", entry.name, "--bundle", "--minify"]
    options = ["--format=esm", "--target=es2022", "--legal-comments=none", "--log-level=error"]
    return subprocess.run([*words, *options], cwd=scratch, check=True, capture_output=True).stdout


def _file_name(path: str) -> str:
    name = Path(path).name
    return "LICENSE.txt" if name.startswith("LICENSE") else name


def _without_map(body: bytes) -> bytes:
    """Remove the line that names a source map: a browser would request it, and it is not vendored."""
    kept = [line for line in body.split(b"\n") if not line.startswith(b"//# sourceMappingURL=")]
    return b"\n".join(kept)


if __name__ == "__main__":
    sys.exit(main())
