"""The wheel: the files that `pip install minirospy` installs, used from an empty folder."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from base64 import urlsafe_b64encode
from collections.abc import Iterator
from pathlib import Path
from types import CodeType

import pytest
from build import ProjectBuilder
from pyproject_hooks import quiet_subprocess_runner

from hatch_build import ADDRESS_VARIABLE, compress, lean, project_urls, without_comments
from minirospy.ros.overlay_modules import overlay_files
from tools.release import faults_of_metadata, unpack

ROOT = Path(__file__).parents[1]
MAX_WHEEL_BYTES = 6_000_000  # maximum size, because the wheel is copied to small computers

USE = """
import site, sys
# As in site-packages: path lines are read.
site.addsitedir(sys.argv[1])
import rospy, actionlib_msgs.msg, RPi.GPIO, genpy, rospkg, roslib
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool
import minirospy, rospy
from minirospy.workspace.packages import Packages
print(minirospy.__file__)
print(LaserScan._md5sum, SetBool._md5sum)
from gazebo_msgs.msg import ModelStates
print(ModelStates._md5sum)
for name in ("std_msgs", "rpi_feros", "rpi_feros_bringup"):
    print(Packages().find(name))
print(Packages().find_executable("rpi_feros", "led_actuator.py")[1])
"""


ADDRESS = "https://git.example.org/robots/ours"


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the unpacked sdist of this checkout, which has an address, and only files under version control."""
    folder = tmp_path_factory.mktemp("source")
    sdist = _build(folder, "--sdist", ROOT, {ADDRESS_VARIABLE: ADDRESS})
    with tarfile.open(sdist) as archive:
        unpack(archive, folder)
    unpacked = folder / sdist.name.removesuffix(".tar.gz")
    # The build of the wheel itself must generate this folder.
    assert not (unpacked / "minirospy" / "overlay").exists()
    return unpacked


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from the sdist, as pip does."""
    return _build(tmp_path_factory.mktemp("wheel"), "--wheel", source, {ADDRESS_VARIABLE: ""})


def test_every_extra_that_is_named_exists() -> None:
    """This covers the messages that contain the pip command, and the docs."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    table = text.partition("[project.optional-dependencies]\n")[2].partition("\n\n")[0]
    extras = set(re.findall(r"^(\w+) = ", table, flags=re.MULTILINE))
    assert {"all", "dev"} < extras

    files = [*(ROOT / "minirospy").rglob("*.py"), *(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    named = {
        name
        for file in files
        for names in re.findall(r"minirospy\[([a-z0-9,]+)\]", file.read_text(encoding="utf-8"))
        for name in names.split(",")
    }
    assert named <= extras
    # All extras except those for development and the site, the GPIO that hides the virtual board, the large one for
    # notebooks, and those that lack a wheel on some system.
    assert set(
        re.findall(r'^all = \["minirospy\[(.*)\]"\]', table, flags=re.MULTILINE)[0].split(",")
    ) == extras - {"all", "dev", "docs", "fleet", "notebook", "pi", "sim"}


@pytest.mark.timeout(180)
def test_wheel_is_pure_and_complete(wheel: Path) -> None:
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())

    for name in (
        "minirospy_overlay.pth",
        "minirospy/py.typed",
        "minirospy/overlay/std_msgs/py.typed",
        "minirospy/overlay/tf/msg/_tfMessage.py",
        "minirospy/overlay/std_msgs/msg/_Bool.py",
        "minirospy/overlay/std_msgs/msg/__init__.pyi",
        "minirospy/overlay/gazebo_msgs/msg/__init__.pyi",
        "minirospy/overlay/gazebo_msgs/srv/__init__.py",
        "minirospy/share/msgs/gazebo_msgs/srv/SpawnModel.srv",
        "minirospy/overlay/sick_safetyscanners/srv/_FieldData.py",
        "minirospy/share/msgs/std_msgs/msg/Bool.msg",
        "minirospy/share/rpi_feros/package.xml",
        "minirospy/share/launch/package.xml",
        "minirospy/ros/passed_on.json",
        "minirospy/workspace/shell/ros.bash",
        "minirospy/workspace/shell/ros.bat",
        "minirospy/workspace/shell/ros.ps1",
    ):
        assert name in names
    assert {f"minirospy/overlay/{name}" for name in overlay_files()} <= names

    assert wheel.stat().st_size < MAX_WHEEL_BYTES
    assert not [name for name in names if name.startswith(("tests/", "docs/")) or "__pycache__" in name]


def test_compressed_wheel_has_the_same_files(tmp_path: Path) -> None:
    wheel = tmp_path / "x.whl"
    texts = {"b/z.py": "spam " * 2000, "a.py": Path(__file__).read_text(encoding="utf-8")}
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, text in texts.items():
            info = zipfile.ZipInfo(name, (2020, 2, 2, 0, 0, 0))
            info.external_attr = 0o100755 << 16
            archive.writestr(info, text)

    before = wheel.stat().st_size
    compress(wheel)
    assert wheel.stat().st_size < before
    assert [path.name for path in tmp_path.iterdir()] == ["x.whl"]
    with zipfile.ZipFile(wheel) as archive:
        assert {name: archive.read(name).decode() for name in archive.namelist()} == texts
        assert archive.namelist() == list(texts)
        assert {(info.date_time, info.external_attr >> 16) for info in archive.infolist()} == {
            ((2020, 2, 2, 0, 0, 0), 0o100755)
        }


def test_record_fits_the_files_of_the_wheel(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        record = next(name for name in archive.namelist() if name.endswith(".dist-info/RECORD"))
        lines = [line.rsplit(",", 2) for line in archive.read(record).decode().splitlines()]
        assert sorted(name for name, _, _ in lines) == sorted(archive.namelist())
        for name, digest, size in lines:
            if name == record:
                continue
            data = archive.read(name)
            found = urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            assert (digest, size) == (f"sha256={found}", str(len(data))), name


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("// about\n\n/** Return. */\nif (x) {\n  y(); // why\n}\n", "if (x) {\ny();\n}\n"),
        ("a('b; // c'); d(\"e) // f\");\n", "a('b; // c'); d(\"e) // f\");\n"),
        ("  d(); // `e`\n", "d(); // `e`\n"),
        ("/* a */ b(); /* c */\n", "/* a */ b(); /* c */\n"),
        # Lines in a template literal are part of its text.
        ("  a = `\n  // b\n\n  c`;\n  d();\n", "a = `\n  // b\n\n  c`;\nd();\n"),
        ("  a = `b`;\n  // c\n", "a = `b`;\n"),
        ("  a = '`';\n  // b\n", "  a = '`';\n  // b\n"),
        ("/**\n * Return `a`.\n */\nb();\n", "b();\n"),
    ],
)
def test_files_of_the_page_are_lean(text: str, wanted: str) -> None:
    assert lean(text) == wanted


@pytest.mark.timeout(900)  # this computes for seconds, on a busy machine for minutes
def test_modules_of_the_wheel_are_those_of_the_sources_without_lines_of_comment(wheel: Path) -> None:
    """The programs are the same, with the same line numbers in a traceback."""
    blanked = 0
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if not (source := ROOT / name).is_file() or not name.endswith(".py"):
                continue
            text, packed = source.read_text(encoding="utf-8"), archive.read(name).decode()
            if packed == text:
                continue
            blanked += 1
            ours, theirs = (list(_code(compile(each, name, "exec"))) for each in (text, packed))
            assert ours == theirs, name
    assert blanked > 100


def _code(code: CodeType) -> Iterator[object]:
    """Yield the compiled code with its line numbers, which is much faster than comparing syntax trees as text."""
    yield code, tuple(code.co_lines())
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from _code(each)


def test_comments_in_texts_and_behind_code_stay() -> None:
    text = '#!/x\n# gone\na = 1  # stays\nif a:\n    # gone\n    b = """\n# stays\n"""\nc = [\n    # gone\n    "# stays"]\n# gone'
    assert without_comments(text).splitlines() == [
        "#!/x", "", "a = 1  # stays", "if a:", "", '    b = """', "# stays", '"""', "c = [", "", '    "# stays"]', "",
    ]  # fmt: skip


def test_description_has_no_link_into_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PyPI shows the README without the files next to it, here without an address for its links."""
    monkeypatch.delenv(ADDRESS_VARIABLE, raising=False)
    folder = ProjectBuilder(ROOT, runner=quiet_subprocess_runner).prepare("wheel", tmp_path)
    assert folder
    text = Path(folder, "METADATA").read_text(encoding="utf-8")
    assert "# minirospy" in text
    assert not re.findall(r"\]\((?!https?:|#)", text)
    assert "threats and limits (docs/security.md)" in text
    assert "![" not in text


@pytest.mark.timeout(300)
def test_one_address_is_in_sdist_and_wheel(source: Path, wheel: Path) -> None:
    """The address is set when the sdist is made, so that a wheel that others build from it has the same metadata."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        text = archive.read(name).decode()
    assert text == (source / "PKG-INFO").read_text(encoding="utf-8")
    assert faults_of_metadata(text, project_urls(ADDRESS)) == []
    assert f"[threats and limits]({ADDRESS}/blob/HEAD/docs/security.md)" in text


def _build(target: Path, kind: str, source: Path, environ: dict[str, str]) -> Path:
    """Build an sdist or a wheel into a new folder; return the file."""
    command = [sys.executable, "-m", "build", kind, "--no-isolation", "--outdir", str(target), str(source)]
    done = subprocess.run(command, env={**os.environ, **environ}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (found,) = (path for path in target.iterdir() if path.is_file())
    return found


@pytest.mark.timeout(180)
def test_wheel_works_in_a_new_environment(wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / "site-packages"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        # -S: ignore the checkout's .pth files; the libraries are added explicitly.
        [sys.executable, "-S", "-c", USE, str(site)],
        env={**environment, "PYTHONPATH": _libraries(tmp_path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == str(site / "minirospy" / "__init__.py")
    assert lines[1] == "90c7ef2dc6895d81024acba2ac42f369 09fb03525b03e7ea1fd3992bafd87e16"

    assert lines[2] == "48c080191eb15c41858319b4d8a609c2"

    share = site / "minirospy" / "share"
    assert [Path(line) for line in lines[3:]] == [
        share / "msgs" / "std_msgs",
        share / "rpi_feros",
        share / "launch",
        share / "rpi_feros" / "scripts" / "led_actuator.py",
    ]


@pytest.mark.timeout(180)
def test_folder_of_pip_target_offers_rospy(wheel: Path, tmp_path: Path) -> None:
    """Python reads no `.pth` file in such a folder, but a program run by `minirospy python` can import rospy nevertheless."""
    folder = tmp_path / "folder"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    program = tmp_path / "node.py"
    program.write_text("import rospy, std_msgs.msg, RPi.GPIO; print(rospy.__file__)")

    done = _run_wheel(tmp_path, [str(folder)], "python", "-S", str(program))

    rospy = folder / "minirospy" / "overlay" / "rospy" / "__init__.py"
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{rospy}\n", "")


@pytest.mark.timeout(180)
def test_archive_is_refused(wheel: Path, tmp_path: Path) -> None:
    """An archive as created by `python -m zipapp`."""
    done = _run_wheel(tmp_path, [str(wheel)], "demo")

    assert (done.returncode, done.stdout) == (2, "")
    start = f"minirospy: ERROR: minirospy cannot run from the archive {wheel}: "
    assert done.stderr.startswith(start)
    assert done.stderr.count("\n") == 1


def _run_wheel(folder: Path, path: list[str], *words: str) -> subprocess.CompletedProcess[str]:
    """Run `minirospy` with a path that no `.pth` file extends."""
    # -S: ignore the checkout's .pth files; the libraries are added explicitly.
    return subprocess.run(
        [sys.executable, "-S", "-m", "minirospy", *words],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*path, _libraries(folder)])},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def _libraries(folder: Path) -> str:
    """Return a folder with minirospy's dependencies, and nothing else from the environment."""
    libraries = folder / "libraries"
    libraries.mkdir()
    for name in ("yaml", "msgpack", "psutil", "rich"):
        package = Path(__import__(name).__file__).parent
        shutil.copytree(package, libraries / name)
    return str(libraries)
