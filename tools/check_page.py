"""Check the JavaScript of the dashboard's page: style (eslint, prettier) and types (tsc).

    python tools/check_page.py

npm installs the checkers in ``tools/page/node_modules``, in the versions of ``tools/page/package-lock.json``. Without a
suitable node, or if npm cannot install them outside of CI, one line reports that the page is not checked. The exit status is
0, or that of the first check that fails.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOOLS = ROOT / "tools" / "page"
MODULES = TOOLS / "node_modules"
PAGE = "minirospy/web/dashboard/page/js"
TESTS = "tests/web/page"
MIN_NODE = (20, 19)  # minimum version that eslint 10 supports
CHECKS = (
    ("eslint/bin/eslint.js", "--config", "tools/page/eslint.config.js", PAGE, TESTS),
    (
        "prettier/bin/prettier.cjs",
        "--config",
        "tools/page/package.json",
        "--log-level",
        "warn",
        "--check",
        f"{PAGE}/**/*.js",
        TESTS,
    ),
    ("typescript/bin/tsc", "--project", "tools/page/tsconfig.json"),
)


def find_node() -> str | None:
    """Return the path of a node that can run the checkers, or None if there is none."""
    node = shutil.which("node")
    if node is None:
        return None
    done = subprocess.run([node, "--version"], capture_output=True, text=True, check=False)
    found = re.match(r"v(\d+)\.(\d+)", done.stdout)
    return node if found and (int(found[1]), int(found[2])) >= MIN_NODE else None


def install() -> bool:
    """Install the checkers if they are missing or outdated; return whether they are installed."""
    lock, installed = TOOLS / "package-lock.json", MODULES / ".package-lock.json"
    if installed.exists() and installed.stat().st_mtime >= lock.stat().st_mtime:
        return True
    npm = shutil.which("npm")
    return npm is not None and subprocess.run([npm, "ci", "--silent"], cwd=TOOLS, check=False).returncode == 0


def main() -> int:
    """Run the checks; return the exit status."""
    node = find_node()
    if node is None:
        print(f"the page's JavaScript is not checked: there is no node {MIN_NODE[0]}.{MIN_NODE[1]} or newer")
        return 0
    if not install():
        print("the page's JavaScript is not checked: npm cannot install the checkers")
        return 1 if os.environ.get("CI") else 0
    for program, *words in CHECKS:
        status = subprocess.run([node, str(MODULES / program), *words], cwd=ROOT, check=False).returncode
        if status:
            return status
    return 0


if __name__ == "__main__":
    sys.exit(main())
