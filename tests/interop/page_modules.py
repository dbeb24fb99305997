"""Run a script with the page's pure modules under node, and return its result, which is passed as JSON."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import Any

import pytest

from minirospy.web.dashboard.files import FOLDER
from tests.interop.conftest import PATIENCE

__all__ = ["needs_node", "run_script"]

needs_node = pytest.mark.skipif(
    not shutil.which("node"), reason="node is not installed: apt-get install nodejs"
)


def run_script(names: str, module: str, body: str) -> Any:
    """Return the result of a function body that uses these names of a page module, such as ``js/layout.js``."""
    source = (FOLDER / module).as_uri()
    script = (
        f"import {{ {names} }} from {json.dumps(source)};\n"
        f"const result = await (async () => {{ {body} }})();\n"
        "console.log(JSON.stringify(result ?? null));"
    )
    done = subprocess.run(
        ["node", "--input-type=module", "-e", script],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
