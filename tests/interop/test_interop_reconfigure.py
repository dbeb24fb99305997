"""dynamic_reconfigure: generators, servers, clients and dynparam from minirospy and Debian, in every combination."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.interop.conftest import PATIENCE, REAL_PYTHON, environment, start, stop

HERE = Path(__file__).parent
CFG = HERE / "Lamp.cfg"
REAL_SHARE = Path("/usr/share/dynamic_reconfigure")
OUR_SHARE = HERE.parents[1] / "msgs" / "dynamic_reconfigure"
PYTHONS = {"ours": sys.executable, "rospy": REAL_PYTHON}
DYNPARAM = {
    "ours": OUR_SHARE / "scripts" / "dynparam",
    "rospy": Path("/usr/lib/dynamic_reconfigure/dynparam"),
}

SHOWN = """
import json, sys
sys.path.append(sys.argv[1])
from lamp.cfg import LampConfig as c
def plain(value):
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items() if k not in ("srcline", "srcfile")}
    if isinstance(value, list):
        return [plain(each) for each in value]
    return plain(eval(value)) if isinstance(value, str) and value.startswith("{") else value
names = ["config_description", "min", "max", "defaults", "level", "type", "all_level"]
names += [name for name in dir(c) if name.startswith("Lamp_")]
print(json.dumps([plain(getattr(c, name)) for name in names]))
"""


def generate(stack: str, folder: Path) -> Path:
    """Run a stack's generator on the .cfg file; return the folder of the Python modules."""
    share = {"ours": OUR_SHARE, "rospy": REAL_SHARE}[stack]
    modules = folder / "python"
    (modules / "lamp").mkdir(parents=True)
    (modules / "lamp" / "__init__.py").touch()
    places = [folder / "share", folder / "include" / "lamp", modules / "lamp"]
    subprocess.run([PYTHONS[stack], str(CFG), str(share), *map(str, places)], check=True, cwd=folder)
    return modules


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the folders of lamp.cfg.LampConfig from each generator."""
    return {stack: generate(stack, tmp_path_factory.mktemp(stack)) for stack in PYTHONS}


def test_generated_modules_say_the_same(modules: dict[str, Path]) -> None:
    said = {
        (stack, made): json.loads(subprocess.check_output([python, "-c", SHOWN, str(folder)], text=True))
        for stack, python in PYTHONS.items()
        for made, folder in modules.items()
    }
    first = said["rospy", "rospy"]
    assert first[3]["label"] == "Lampe für Zoë"
    assert all(each == first for each in said.values())


def test_generated_documents_say_the_same(modules: dict[str, Path]) -> None:
    texts = {}
    for stack, folder in modules.items():
        documents = sorted((folder.parent / "share" / "docs").iterdir())
        text = "\n".join(f"{path.name}\n{path.read_text(encoding='utf-8')}" for path in documents)
        texts[stack] = re.sub(r"std::numeric_limits<double>::infinity\(\)", "inf", text)
    assert texts["ours"] == texts["rospy"]


@pytest.fixture
def serve(modules: dict[str, Path]) -> Iterator[Callable[[str, str], subprocess.Popen[str]]]:
    """Start a server: ``serve(stack, uri)``."""
    with ExitStack() as running:

        def run(stack: str, uri: str) -> subprocess.Popen[str]:
            program = start(
                [PYTHONS[stack], str(HERE / "reconfigure_peer.py"), "serve", str(modules[stack])], uri, stack
            )
            running.callback(stop, program)
            return program

        yield run


def lines_until(program: subprocess.Popen[str], word: str) -> list[str]:
    """Return a program's output up to a line that starts with a word."""
    assert program.stdout
    lines: list[str] = []
    while not lines or not lines[-1].startswith(word):
        line = program.stdout.readline()
        assert line, lines
        lines.append(line)
    return lines


def played(
    serve: Callable[[str, str], subprocess.Popen[str]], uri: str, server: str, client: str, modules: Path
) -> str:
    """Return the output of a server and of a client, run together."""
    serving = serve(server, uri)
    before = lines_until(serving, "ready")
    done = subprocess.run(
        [PYTHONS[client], str(HERE / "reconfigure_peer.py"), "change", str(modules)],
        env=environment(uri, client),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert serving.stdin
    serving.stdin.write("\n")
    serving.stdin.flush()
    after = lines_until(serving, "updated")
    return "".join([*before, done.stdout, *after])


@pytest.mark.parametrize(("server", "client"), [("ours", "ours"), ("ours", "rospy"), ("rospy", "ours")])
def test_server_and_client_behave_as_real_ones(
    server: str,
    client: str,
    real_master: str,
    serve: Callable[[str, str], subprocess.Popen[str]],
    modules: dict[str, Path],
) -> None:
    if os.environ.get("RECORD"):
        expected = played(serve, real_master, "rospy", "rospy", modules["rospy"])
        (HERE / "reconfigure.txt").write_text(expected, encoding="utf-8")
        pytest.skip("recorded")
    expected = (HERE / "reconfigure.txt").read_text(encoding="utf-8")
    assert played(serve, real_master, server, client, modules[client]) == expected


@pytest.fixture(scope="session")
def cpp_peer(modules: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile the C++ server with the header that ROS generates; return the program."""
    compiler = shutil.which("g++")
    assert compiler
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "roscpp", "dynamic_reconfigure"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split()
    program = tmp_path_factory.mktemp("cpp") / "server"
    source = str(HERE / "reconfigure_peer.cpp")
    headers = modules["rospy"].parent / "include"
    subprocess.run([compiler, "-Wall", f"-I{headers}", "-o", str(program), source, *flags], check=True)
    return program


@pytest.fixture
def cpp_server(cpp_peer: Path, real_master: str) -> Iterator[subprocess.Popen[str]]:
    """Start the C++ server."""
    server = start([str(cpp_peer)], real_master, "roscpp")
    yield server
    stop(server)


def test_client_and_dynparam_of_ours_drive_a_server_in_cpp(
    cpp_server: subprocess.Popen[str], real_master: str, modules: dict[str, Path]
) -> None:
    lines_until(cpp_server, "ready")
    done = subprocess.run(
        [sys.executable, str(HERE / "reconfigure_peer.py"), "change", str(modules["ours"])],
        env=environment(real_master, "ours"),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert any(line.startswith("{'brightness': 0.25} -> ({'angle'") for line in lines)
    assert any("'color': '#0f0'" in line and "'hue': 0.125" in line for line in lines)
    assert any("{'mode': 'Morse', 'is_on': 1} -> " in line and "'brightness': 0.75" in line for line in lines)
    assert "('inner', False" in done.stdout
    assert dynparam("ours", real_master, "set", "/lamp", "{'power': 1000, 'groups': {'inner': true}}") == (
        "",
        0,
    )
    shown = eval(dynparam("ours", real_master, "get", "/lamp")[0])
    assert shown["power"] == 60
    assert shown["groups"]["groups"]["Color_Choice"]["groups"]["inner"]["state"] is True


def dynparam(stack: str, uri: str, *words: str, share: Path = OUR_SHARE) -> tuple[str, int]:
    """Return dynparam's output and its exit status."""
    done = subprocess.run(
        [PYTHONS[stack], str(DYNPARAM[stack]), *words],
        env={**environment(uri, stack), "ROS_PACKAGE_PATH": str(REAL_SHARE)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return done.stdout, done.returncode


@pytest.mark.parametrize(("server", "tool"), [("ours", "rospy"), ("rospy", "ours"), ("ours", "ours")])
def test_dynparam_prints_the_same_as_the_real_one(
    server: str,
    tool: str,
    real_master: str,
    serve: Callable[[str, str], subprocess.Popen[str]],
    tmp_path: Path,
) -> None:
    lines_until(serve(server, real_master), "ready")
    file = tmp_path / "values.yaml"

    def run(*words: str) -> tuple[str, int]:
        return dynparam(tool, real_master, *words)

    def value(name: str) -> object:
        (shown, _) = run("get", "/lamp")
        return eval(shown)[name]

    assert run("list") == ("/lamp\n", 0)
    assert run("set", "/lamp", "power", "50") == ("", 0)
    assert value("power") == 50
    assert run("set", "/lamp", "{'power': 40, 'label': blue}") == ("", 0)
    assert (value("power"), value("label")) == (40, "blue")
    assert run("set", "/lamp", "mode", "Morse") == ("", 0)
    assert (value("mode"), value("brightness")) == (2, 0.75)
    assert run("set", "/lamp", "angle", "-1.5") == ("", 0)
    assert run("set", "/lamp", "wattage", "1") == (
        "error updating parameters: don't know parameter: wattage\n",
        0,
    )
    assert run("dump", "/lamp", str(file)) == ("", 0)
    assert run("set", "/lamp", "{'power': 1, 'angle': 2}") == ("", 0)
    if server == "rospy":
        # ROS's server also rejects nested group states, which its own dynparam sends.
        assert run("load", "/lamp", str(file))[1] == 1
        return
    for other in ("rospy", "ours"):
        assert dynparam(other, real_master, "load", "/lamp", str(file))[1] == 0
        assert (value("power"), value("angle")) == (40, -1.5)
    assert run("set_from_parameters", "/lamp", "_power:=3") == ("", 0)
    assert value("power") == 3
