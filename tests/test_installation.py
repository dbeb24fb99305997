"""The command that installs a missing library: for pip, pipx, uv and the system's Python, in any shell."""

from __future__ import annotations

import importlib.machinery
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from minirospy.base import installation
from minirospy.base.installation import install_command
from minirospy.web.serve import LIBRARIES

ROOT = Path(__file__).parents[1]

RECEIPT = """\
[tool]
requirements = [
    { name = "minirospy", extras = ["web", "mcap"], path = "/tmp/minirospy-0.1.0-py3-none-any.whl" },
    { name = "zstandard", specifier = ">=0.20" },
    { name = "minirospy", extras = ["serial"] },
    { name = "mcap", extras = ["all"] },
]
entrypoints = [
    { name = "catkin", install-path = "/home/me/.local/bin/catkin", from = "minirospy" },
]
"""
"""The format used by uv 0.13."""


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of an environment in which this process appears to run."""
    folder = tmp_path / "minirospy"
    folder.mkdir()
    monkeypatch.setattr(sys, "prefix", str(folder))
    return folder


def hide_pip(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.util.find_spec

    def found(name: str, package: str | None = None) -> importlib.machinery.ModuleSpec | None:
        return None if name == "pip" else real(name, package)

    monkeypatch.setattr(importlib.util, "find_spec", found)


def test_pip_of_the_interpreter_on_the_path(
    prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "python.exe" if os.name == "nt" else "python"
    program = tmp_path / name
    program.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(program))
    assert install_command("minirospy[web]") == 'python -m pip install "minirospy[web]"'
    assert install_command("lz4", "numpy", upgrade=True) == "python -m pip install --upgrade lz4 numpy"


@pytest.mark.skipif(os.name == "nt", reason="words of sh")
def test_pip_of_an_interpreter_that_is_not_on_the_path(
    prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "executable", "/home/me/my robots/.venv/bin/python")
    words = shlex.split(install_command("minirospy[web]"))
    assert words == ["/home/me/my robots/.venv/bin/python", "-m", "pip", "install", "minirospy[web]"]


def test_system_python_needs_the_option_of_pep_668(
    prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "EXTERNALLY-MANAGED").touch()
    monkeypatch.setattr(sysconfig, "get_path", lambda name: str(tmp_path))
    assert install_command("lz4").endswith(" -m pip install lz4"), "a venv of it"
    monkeypatch.setattr(sys, "base_prefix", sys.prefix)
    assert install_command("lz4").endswith(" -m pip install --break-system-packages lz4")


def test_pipx_runs_its_own_pip(prefix: Path) -> None:
    (prefix / "pipx_metadata.json").write_text("{}")
    assert install_command("minirospy[web]") == 'pipx runpip minirospy install "minirospy[web]"'
    assert install_command("lz4", upgrade=True) == "pipx runpip minirospy install --upgrade lz4"


def test_uv_tool_keeps_what_was_installed_with_it(prefix: Path) -> None:
    receipt = prefix / "uv-receipt.toml"
    receipt.write_text('[tool]\nrequirements = [{ name = "minirospy" }]\nentrypoints = []\n')
    assert install_command("minirospy[web]") == 'uv tool install "minirospy[web]"'
    assert install_command("numpy", "lz4") == "uv tool install minirospy --with numpy --with lz4"

    receipt.write_text(RECEIPT)
    assert install_command("minirospy[fleet]", upgrade=True) == (
        'uv tool install --upgrade "minirospy[web,mcap,serial,fleet]" --with "zstandard>=0.20" --with "mcap[all]"'
    )


def test_environment_without_pip_is_one_of_uv(prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hide_pip(monkeypatch)
    monkeypatch.setattr(sys, "executable", "/home/me/.venv/bin/python")
    expected = 'uv pip install --python /home/me/.venv/bin/python "minirospy[web]"'
    assert install_command("minirospy[web]") == expected


def test_path_of_windows_is_a_command_in_cmd_and_in_powershell(
    prefix: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # In PowerShell, a line that starts with a quote is an expression.
    monkeypatch.setattr(installation, "IS_WINDOWS", True)
    monkeypatch.setattr(sys, "executable", r"C:\Program Files\Python (x86)\python.exe")
    expected = r'C:\"Program Files"\"Python (x86)"\python.exe -m pip install "minirospy[web]"'
    assert install_command("minirospy[web]") == expected


def test_no_module_has_a_command_of_its_own() -> None:
    own = [
        str(path.relative_to(ROOT))
        for path in sorted((ROOT / "minirospy").rglob("*.py"))
        if "overlay" not in path.parts and path.name != "installation.py"
        for line in path.read_text(encoding="utf-8").splitlines()
        if "pip install" in line
        and not line.lstrip().startswith(('"""', "``", "#"))
        and "--target" not in line
    ]
    assert own == []


def test_build_with_an_old_python_names_the_version_in_one_line() -> None:
    """pip builds before it compares requires-python."""
    code = "import runpy, sys; sys.version_info = (3, 8, 10); runpy.run_path('hatch_build.py')"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "minirospy needs Python 3.10 or newer, this is 3.8 (docs/install.md)\n"


def test_dashboard_needs_nothing_but_the_dependencies() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    required = text.partition("\ndependencies = [")[2].partition("]")[0]
    assert [name for name in LIBRARIES if f'"{name}>=' not in required] == []


@pytest.mark.skipif(not shutil.which("make"), reason="make is not installed")
def test_demo_installs_no_packages_for_developers(tmp_path: Path) -> None:
    done = subprocess.run(
        ["make", "-n", "demo", f"VENV={tmp_path.as_posix()}/venv"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    # The second make, which -n runs too, prints the same line.
    (installed,) = {line for line in done.stdout.splitlines() if "pip install" in line}
    assert installed.endswith("--editable .")
    assert "--quiet" not in installed


def test_no_page_promises_a_release_on_pypi() -> None:
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    promised = [
        f"{page.relative_to(ROOT)}: {line}"
        for page in pages
        for line in page.read_text(encoding="utf-8").splitlines()
        # minirospy[mcap] adds an extra to an installation; minirospy-0.1.0-py3-none-any.whl is a file.
        if re.search(r"(pip|pipx|uv tool) install minirospy(?![-[\w])|uvx minirospy", line)
        and "once it is released" not in line
    ]
    assert promised == []
