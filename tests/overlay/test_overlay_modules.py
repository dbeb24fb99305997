"""The modules of `overlay/` are generated from those of `ros/`: each exports the names in the `__all__` of its source."""

from __future__ import annotations

import ast
import importlib
import math
import os
import subprocess
import sys
import xmlrpc.client
from pathlib import Path
from typing import Any

import pytest

from minirospy.ros import overlay_modules
from minirospy.ros.overlay_modules import (
    PACKAGE,
    Origin,
    exported,
    modules,
    overlay_files,
    read_passed_on,
    write_overlay,
)

OVERLAY = PACKAGE / "overlay"
NAMES = sorted(
    set(modules()) - {"RPi._GPIO"}
)  # which has RPi.GPIO's list, and resolves its names with a function


def names_of(path: Path) -> list[str]:
    """Return the names in the literal `__all__` of a file."""
    found = [
        ast.literal_eval(statement.value)
        for statement in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "__all__"
    ]
    return found[0] if found else []


@pytest.mark.filterwarnings("ignore:roslib.rospack is deprecated")
def test_modules_offer_what_their_sources_name() -> None:
    sources = modules()
    for name in NAMES:
        module = importlib.import_module(name)
        listed = names_of(sources[name])
        assert [each for each in listed if not hasattr(module, each)] == [], name
        later = getattr(module, "__all__", [])[len([each for each in listed if each[0] != "_"]) :]
        assert sorted(set(getattr(module, "__all__", [])) - set(later)) == sorted(
            each for each in listed if each[0] != "_"
        ), name
        assert set(later) == set(overlay_modules._passed_on(name, listed)), name


def test_star_brings_what_it_brings_in_real_ros() -> None:
    assert len(read_passed_on()) > 50
    for name in sorted(read_passed_on()):
        names: dict[str, object] = {}
        exec(f"from {name} import *", names)
        assert set(overlay_modules._passed_on(name, [])) <= names.keys(), name


def test_name_from_elsewhere_is_the_object_there() -> None:
    import rosmaster.util
    import rosnode

    assert (rosnode.rosgraph, rosnode.sys) == (importlib.import_module("rosgraph"), sys)
    assert rosmaster.util.ServerProxy is xmlrpc.client.ServerProxy
    assert "os" not in vars(importlib.import_module("rospy.timer"))  # not in that of ROS either


def test_names_from_elsewhere_are_imported_at_first_use() -> None:
    program = "import sys, rosnode; print('optparse' in sys.modules); rosnode.OptionParser; print('optparse' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path[:] = {sys.path!r}; {program}"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["False", "True"]


def test_every_package_with_a_python_module_is_offered() -> None:
    # In a ROS package's folder, `import` of its name offers the folder of the same name.
    named = {
        folder.name
        for folder in (PACKAGE / "ros").iterdir()
        if (folder / folder.name / "__init__.py").exists()
    }
    assert named > {"rosbag", "rospy", "tf2_ros"}
    assert named <= set(NAMES)
    assert {"PyKDL", "RPi.GPIO", "camera_info_manager", "urdf_parser_py.urdf"} <= set(NAMES)


def test_each_folder_of_the_tables_exists() -> None:
    for top, internal in overlay_modules._INTERNAL.items():
        folder = modules()[top].parent
        for name in internal.split():
            assert (folder / f"{name}.py").exists() or (folder / name).is_dir(), f"{top}.{name}"
            assert f"{top}.{name}" not in modules()


def test_folder_has_what_would_be_written_now() -> None:
    """`make` regenerates it if a source changes; `python -m minirospy.ros.overlay_modules` does so without make."""
    for name, text in overlay_files().items():
        assert (OVERLAY / name).read_text(encoding="utf-8") == text, name


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of an emulated package `pack` without modules."""
    monkeypatch.setattr(overlay_modules, "PACKAGE", tmp_path / "minirospy")
    monkeypatch.setattr(overlay_modules, "_ALSO", {})
    for cached in (overlay_modules.modules, overlay_modules._by_source, overlay_modules._read):
        monkeypatch.setattr(overlay_modules, cached.__name__, cached.__wrapped__)
    folder = tmp_path / "minirospy" / "ros" / "pack" / "pack"
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text('"""A package."""\n')
    return folder


def test_new_package_is_one_folder(sources: Path, tmp_path: Path) -> None:
    (sources / "tool.py").write_text('"""A module."""\n__all__ = ["_hidden", "run"]\n')
    target = tmp_path / "overlay"
    written = write_overlay(target)
    assert {"pack/__init__.py", "pack/tool.py", "pack/py.typed"} <= set(written)
    assert (target / "pack" / "tool.py").read_text() == (
        '"""pack.tool, provided by minirospy: generated from minirospy/ros/pack/pack/tool.py."""\n\n'
        "from minirospy.ros.pack.pack.tool import (\n    _hidden as _hidden, run as run,\n)\n\n"
        '__all__ = [\n    "run",\n]\n'
    )


def test_module_without_names_is_only_a_module(sources: Path, tmp_path: Path) -> None:
    assert list(exported(sources / "__init__.py")) == []
    write_overlay(tmp_path / "overlay")
    text = (tmp_path / "overlay" / "pack" / "__init__.py").read_text()
    assert text.splitlines()[1:] == [
        "",
        "from minirospy.ros.submodules import offer_standard_library as _offer_standard_library",
        "",
        "_offer_standard_library()",
    ]


def test_names_are_imported_from_where_they_are_defined(sources: Path) -> None:
    (sources / "first.py").write_text(
        "from typing import Any\nfrom math import pi\n__all__ = ['pi', 'run']\n"
    )
    (sources / "second.py").write_text(
        "from typing import TYPE_CHECKING\n"
        "import time as time\n"
        "from minirospy.ros.pack.pack.first import run as start\n"
        "if TYPE_CHECKING:\n    from minirospy.ros.pack.pack.first import pi as pi\n"
        "__all__ = ['start']\n"
    )
    (sources / "__init__.py").write_text("from minirospy.ros.pack.pack import first as first\n")
    # Imports in the form `x as x` are exported, too; Any and TYPE_CHECKING are not.
    assert exported(sources / "second.py") == {
        "start": Origin("minirospy.ros.pack.pack.first", "run"),
        "pi": Origin("math", "pi"),
        "time": Origin("time", ""),
    }
    assert exported(sources / "__init__.py") == {"first": Origin("pack", "first")}


def test_missing_name_is_an_attribute_error(
    sources: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        overlay_modules, "read_passed_on", lambda: {"pack": {"": "os dom=xml.dom", "math": "pi tau=e run"}}
    )
    (sources / "__init__.py").write_text("__all__ = ['run']\nrun = 1\n")
    text = overlay_files()["pack/__init__.py"]
    start = text.index("import typing")
    names: dict[str, Any] = {"__all__": ["run"], "__name__": "pack"}
    exec(text[start:], names)
    assert names["__all__"] == ["run", "dom", "os", "pi", "tau"]
    found = names["__getattr__"]
    assert (found("os"), found("tau")) == (os, math.e)
    assert names["os"] is os
    with pytest.raises(AttributeError, match="module 'pack' has no attribute 'nope'"):
        found("nope")


@pytest.mark.parametrize(
    "how", ["def __getattr__(name): ...", "__getattr__ = find", "from math import pi as __getattr__"]
)
def test_function_for_missing_names_is_passed_on(sources: Path, how: str) -> None:
    (sources / "__init__.py").write_text(how + "\n")
    assert list(exported(sources / "__init__.py")) == ["__getattr__"]


def test_module_of_an_earlier_build_goes(sources: Path, tmp_path: Path) -> None:
    target = tmp_path / "overlay"
    (sources / "old.py").touch()
    write_overlay(target)
    others = target / "pack" / "msg" / "__init__.py"
    others.parent.mkdir()
    others.write_text('"""pack: generated by minirospy from its definitions."""\n')
    (sources / "old.py").unlink()
    kept = target / "pack" / "py.typed"
    before = os.stat(kept).st_mtime_ns
    write_overlay(target)
    assert not (target / "pack" / "old.py").exists()
    assert others.exists()
    assert os.stat(kept).st_mtime_ns == before
    assert "old" not in (target / "pack" / "__init__.py").read_text()
