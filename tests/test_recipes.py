"""packaging/: the recipes agree with pyproject.toml."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import yaml

from minirospy.cli.registry import console_scripts

ROOT = Path(__file__).parents[1]
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")

CONDA_NAMES = {"msgpack": "msgpack-python"}  # conda-forge names by PyPI name, if they differ


def _section(title: str) -> str:
    """Return the lines of a table in pyproject.toml, for which Python 3.10 has no parser."""
    return PROJECT.partition(f"[{title}]\n")[2].partition("\n[")[0]


def _value(name: str) -> str:
    return re.findall(rf'^{name} = "(.*)"$', _section("project"), flags=re.MULTILINE)[0]  # type: ignore[no-any-return]


def _recipe() -> dict[str, Any]:
    text = (ROOT / "packaging" / "conda" / "meta.yaml").read_text(encoding="utf-8")
    variables = dict(re.findall(r'{% set (\w+) = "(.*)" %}', text))
    text = re.sub(r"{%.*%}", "", text)
    text = re.sub(r"{{ (\w+) }}", lambda found: variables.get(found[1], found[1]), text)
    recipe: dict[str, Any] = yaml.safe_load(text)
    return recipe


def test_conda_recipe_has_name_and_version_of_the_project() -> None:
    recipe = _recipe()
    assert recipe["package"] == {"name": "minirospy", "version": _value("version")}
    assert recipe["source"]["url"].endswith(f"/minirospy-{_value('version')}.tar.gz")
    assert recipe["about"]["license"] == "BSD-3-Clause"


def test_conda_recipe_requires_what_the_wheel_requires() -> None:
    required = re.findall(
        r'"([A-Za-z0-9_-]+)(.*?)"', _section("project").partition("\ndependencies = [")[2].partition("]")[0]
    )
    assert len(required) > 4
    expected = {f"python {_value('requires-python')}"}
    expected |= {f"{CONDA_NAMES.get(name.lower(), name.lower())} {versions}" for name, versions in required}
    recipe = _recipe()
    assert set(recipe["requirements"]["run"]) == expected

    (builder,) = re.findall(r'requires = \["(\w+)(.*)"\]', _section("build-system"))
    assert set(recipe["requirements"]["host"]) == {
        f"python {_value('requires-python')}",
        "pip",
        " ".join(builder),
    }


def test_conda_recipe_has_every_command() -> None:
    expected = [f"{name} = {target}" for name, target in console_scripts().items()]
    assert _recipe()["build"]["entry_points"] == expected


def test_lists_of_commands_are_those_of_the_registry() -> None:
    done = subprocess.run(
        [sys.executable, "tools/commands.py", "--check"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_dockerfile_installs_the_wheel_of_a_release() -> None:
    text = (ROOT / "packaging" / "Dockerfile").read_text(encoding="utf-8")
    assert "COPY dist/minirospy-*-py3-none-any.whl" in text
    # A program in a container must receive signals itself, so a shell must not run the command.
    assert re.search(r'^CMD \["roscore"\]$', text, flags=re.MULTILINE)
    assert text.index("USER ros") < text.index("CMD ")
