"""Packages whose modules are generated from their definitions at first import."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.base.errors import NotFoundError
from minirospy.core.idl.load import message_class, service_class
from minirospy.core.idl.own_packages import COMPILED_AHEAD, own_definitions

OVERLAY = Path(__file__).parents[3] / "minirospy" / "overlay"
PACKAGE = "gazebo_msgs"


def run(program: str, *arguments: str, **variables: str) -> str:
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(
        [sys.executable, *arguments, "-c", program],
        env={**environment, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_only_packages_of_ros_are_files() -> None:
    packages = {folder.name for folder in own_definitions().iterdir() if folder.is_dir()}
    assert packages >= COMPILED_AHEAD
    for package in packages:
        modules = [*OVERLAY.glob(f"{package}/*/_[!_]*.py")]
        assert bool(modules) == (package in COMPILED_AHEAD), package


def test_module_is_made_once_and_then_cached(tmp_path: Path) -> None:
    """Python's own cache contains the result, so the second process does not need the compiler."""
    program = """
import sys
from gazebo_msgs.msg import ModelState, ModelStates
from gazebo_msgs.srv import SpawnModel, SpawnModelRequest
import gazebo_msgs.msg._LinkState as module
assert ModelState().pose.orientation.w == 0.0 and SpawnModelRequest is SpawnModel._request_class
print("minirospy.core.idl.emit" in sys.modules, module.__file__.endswith("_LinkState.py"))
"""
    prefix = str(tmp_path / "cache")
    assert run(program, PYTHONPYCACHEPREFIX=prefix) == "True True\n"
    assert run(program, PYTHONPYCACHEPREFIX=prefix) == "False True\n"


def test_folder_that_cannot_be_written_to_works(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder can be made below a file")
    program = "from gazebo_msgs.msg import WorldState; print(WorldState._md5sum)"
    assert run(program, PYTHONPYCACHEPREFIX=str(tmp_path / "file")) == "de1a9de3ab7ba97ac0e9ec01a4eb481e\n"
    assert run(program, "-B") == "de1a9de3ab7ba97ac0e9ec01a4eb481e\n"


def test_cache_of_other_definitions_is_not_used(tmp_path: Path) -> None:
    """A newer minirospy has other definitions, so modules cached by the older version must be regenerated."""
    program = "import sys, {0}.msg as m; m.UniqueID; print('minirospy.core.idl.emit' in sys.modules)"
    prefix = str(tmp_path / "cache")
    site = tmp_path / "site"
    shutil.copytree(OVERLAY / "uuid_msgs", site / "uuid_msgs", ignore=shutil.ignore_patterns("__pycache__"))
    variables = {"PYTHONPYCACHEPREFIX": prefix, "PYTHONPATH": str(site)}
    assert run(program.format("uuid_msgs"), **variables) == "True\n"
    assert run(program.format("uuid_msgs"), **variables) == "False\n"

    module = site / "uuid_msgs" / "msg" / "__init__.py"
    text = module.read_text()
    (fingerprint,) = re.findall(r"__name__, (\d+)", text)
    module.write_text(text.replace(fingerprint, "1"))
    assert run(program.format("uuid_msgs"), **variables) == "True\n"


def test_star_import_and_unknown_names() -> None:
    program = """
from geographic_msgs.msg import *
print(GeoPoint().latitude, WayPoint().id.uuid)
import geographic_msgs.msg
try:
    geographic_msgs.msg.Nothing
except AttributeError as error:
    print(error)
try:
    import geographic_msgs.msg._Nothing
except ModuleNotFoundError as error:
    print(error)
"""
    assert run(program).splitlines() == [
        "0.0 b'\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00'",
        "module 'geographic_msgs.msg' has no attribute 'Nothing'",
        "No module named 'geographic_msgs.msg._Nothing'",
    ]


def test_traceback_shows_the_line_of_the_module() -> None:
    program = """
import io, traceback
from gazebo_msgs.msg import ModelState
try:
    ModelState(pose=3).serialize(io.BytesIO())
except Exception:
    print(traceback.format_exc())
"""
    assert "self._check_types(error)" in run(program)


def test_similar_types_are_named() -> None:
    assert message_class("gazebo_msgs/ModelState")._type == "gazebo_msgs/ModelState"
    with pytest.raises(NotFoundError, match="gazebo_msgs/ModelState"):
        message_class("gazebo_msgs/ModelStat")
    with pytest.raises(NotFoundError, match="gazebo_msgs/SpawnModel"):
        service_class("gazebo_msgs/SpawnModl")
