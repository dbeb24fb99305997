"""Build and check a release: `make release`. It writes sdist, wheel and SBOM to `dist/`; nothing is uploaded.

sdist and wheel are built from the files of the last commit, twice, and must be byte-identical. Then follow `twine check`, the
wheel's size and contents, and `minirospy demo` in a new environment of every Python from 3.10 on that is on PATH or in pyenv.
The exit status is 1 if anything is wrong, with each fault on one line.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Collection, Mapping
from email import message_from_string
from pathlib import Path

from hatch_build import ADDRESS_VARIABLE, project_urls
from minirospy.cli.windows import WINDOWS
from minirospy.ros.overlay_modules import overlay_files
from tools.sbom import SbomError, make_sbom

ROOT = Path(__file__).parents[1]

MAX_BYTES = 6_000_000  # maximum size, because the wheel is copied to small computers

OLDEST = (3, 10)

_INCLUDED = {
    "minirospy/share/msgs/": "msgs/",
    "minirospy/share/rpi_feros/": "rpi_feros/",
    "minirospy/share/launch/": "launch/",
}
"""Folders in the wheel with the location of their files in the sources, as in hatch_build.py."""

_VENDORED = "minirospy/web/dashboard/page/vendor/"


class ReleaseError(Exception):
    """A step has failed; the text names the step and the reason."""


def main() -> int:
    """Build and check; return the exit status."""
    try:
        urls = _given_urls()
        if changed := _run("git", "status", "--porcelain"):
            raise ReleaseError(
                f"not all is committed, but a release is built from the last commit:\n{changed}"
            )
        # Use one commit for both builds, even if another one is made meanwhile.
        commit, epoch = _run("git", "log", "-1", "--format=%H %ct").split()
        dist = ROOT / "dist"
        with tempfile.TemporaryDirectory() as scratch:
            built = _build(Path(scratch, "first"), commit, epoch)
            _compare(built, _build(Path(scratch, "second in another folder"), commit, epoch, elsewhere=True))
            _run(sys.executable, "-m", "twine", "check", "--strict", *map(str, built))
            (wheel,) = (path for path in built if path.suffix == ".whl")
            tracked = _run("git", "ls-tree", "-r", "-z", "--name-only", commit).split("\0")
            if faults := faults_of_wheel(_contents(wheel), wheel.stat().st_size, tracked):
                raise ReleaseError("\n".join(f"{wheel.name}: {fault}" for fault in faults))
            if faults := faults_of_metadata(_metadata(wheel), urls):
                raise ReleaseError("\n".join(f"{wheel.name}: {fault}" for fault in faults))

            bill = make_sbom(wheel, int(epoch))
            for python in find_pythons().values():
                _try_out(python, wheel, Path(scratch))
                print(f"{python}: installed, `minirospy demo` works", flush=True)
            shutil.rmtree(dist, ignore_errors=True)
            dist.mkdir()
            for path in built:
                shutil.copy2(path, dist)
            (dist / f"{wheel.name.partition('-py3')[0]}.cdx.json").write_text(bill, encoding="utf-8")
    except (ReleaseError, SbomError) as error:
        print(f"release: ERROR: {error}", file=sys.stderr)
        return 1

    if not urls:
        print(f"{ADDRESS_VARIABLE} is not set: PyPI would show no address of the project (docs/release.md)")
    for path in sorted(dist.iterdir()):
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        print(f"dist/{path.name}: {path.stat().st_size:,} bytes, sha256 {digest}")
    return 0


def faults_of_wheel(contents: Mapping[str, int], size: int, tracked: Collection[str]) -> list[str]:
    """Return the faults of a wheel of ``size`` bytes. ``contents`` are its files, ``tracked`` are those in the sources."""
    sources = set(tracked)
    faults = []
    if size >= MAX_BYTES:
        largest = sorted(contents, key=lambda name: -contents[name])[:3]
        faults.append(f"has {size:,} bytes, not under {MAX_BYTES:,}; the largest files: {', '.join(largest)}")

    faults += [
        f"{name}: not from a file of the sources"
        for name in sorted(contents)
        if not _is_expected(name, sources)
    ]
    faults += [
        f"{name}: missing"
        for name in sorted(sources)
        if name.startswith("minirospy/") and not name.endswith("/.gitignore") and name not in contents
    ]

    vendored = {
        name.removeprefix(_VENDORED).partition("/")[0] for name in contents if name.startswith(_VENDORED)
    }
    for folder in sorted(vendored - {"versions.json"}):
        if not contents.get(f"{_VENDORED}{folder}/LICENSE.txt"):
            faults.append(f"{_VENDORED}{folder}: its LICENSE.txt is missing or empty")
    if not any(name.endswith(".dist-info/licenses/LICENSE") and contents[name] for name in contents):
        faults.append("the licence of minirospy is missing")
    return faults


def faults_of_metadata(text: str, urls: Mapping[str, str]) -> list[str]:
    """Return the faults of a METADATA file. Its addresses should be ``urls``, and the README's links should lead there."""
    metadata = message_from_string(text)
    given = [f"{label}, {url}" for label, url in urls.items()]
    faults = []
    if (found := metadata.get_all("Project-URL", [])) != given:
        faults.append(f"its addresses are {found}, not {given}")
    if links := re.findall(r"\]\((?!https?:|#)([^)]+)\)", str(metadata.get_payload())):
        faults.append(f"its description has links into the sources: {', '.join(links)}")
    return faults


def _given_urls() -> dict[str, str]:
    """Return the addresses that the metadata should have. Raise ReleaseError if the variable has no address."""
    address = os.environ.get(ADDRESS_VARIABLE, "").strip()
    try:
        return project_urls(address) if address else {}
    except ValueError as error:
        raise ReleaseError(str(error)) from error


def _is_expected(name: str, sources: Collection[str]) -> bool:
    if name in sources or name.partition("/")[0].endswith(".dist-info"):
        return True
    for folder, source in _INCLUDED.items():
        if name.startswith(folder):
            return source + name.removeprefix(folder) in sources

    _, _, module = name.partition("minirospy/overlay/")
    if module in overlay_files() or any(
        name.startswith(f"minirospy/ros/{window.package or window.command}/") for window in WINDOWS
    ):
        return True

    # The remaining modules are generated from msgs/.
    package = module.partition("/")[0]
    return f"msgs/{package}/package.xml" in sources and name.endswith((".py", ".pyi", "/py.typed"))


def _contents(wheel: Path) -> dict[str, int]:
    with zipfile.ZipFile(wheel) as archive:
        return {each.filename: each.file_size for each in archive.infolist()}


def _metadata(wheel: Path) -> str:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (each for each in archive.namelist() if each.endswith(".dist-info/METADATA"))
        return archive.read(name).decode()


def unpack(archive: tarfile.TarFile, folder: Path) -> None:
    """Unpack an archive as data, which is the default from Python 3.14 on, and is not supported in the first 3.10 and 3.11."""
    archive.extraction_filter = getattr(tarfile, "data_filter", lambda member, _: member)
    archive.extractall(folder)


def _build(folder: Path, commit: str, epoch: str, *, elsewhere: bool = False) -> list[Path]:
    """Build a commit, the wheel from the unpacked sdist; return both files.

    With ``elsewhere``, build as in another user's shell, with another time zone, language, file mode and set order.
    """
    source = folder / "minirospy"
    archive = subprocess.run(["git", "archive", commit], cwd=ROOT, check=True, capture_output=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        unpack(tar, source)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder / "dist"), str(source)]
    other = {"TZ": "Asia/Kathmandu", "LC_ALL": "C", "PYTHONHASHSEED": "4711"} if elsewhere else {}
    before = os.umask(0o077) if elsewhere else None
    try:
        _run(*command, environ={**os.environ, "SOURCE_DATE_EPOCH": epoch, **other})
    finally:
        if before is not None:
            os.umask(before)
    return sorted((folder / "dist").iterdir())


def _compare(first: list[Path], second: list[Path]) -> None:
    for one, other in zip(first, second, strict=True):
        if one.read_bytes() != other.read_bytes():
            raise ReleaseError(f"{one.name}: two builds of one commit differ")


def find_pythons() -> dict[str, str]:
    """Return the path of one interpreter for each version from OLDEST on.

    The keys are versions such as "3.13", or "3.13t" for a build without the GIL.
    """
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    names = [f"python3.{minor}{build}" for minor in range(OLDEST[1], 20) for build in ("", "t")]
    found = [
        *(path for path in map(shutil.which, names) if path),
        *map(str, pyenv.glob("3.*/bin/python")),
        sys.executable,
    ]
    ask = "import sys, sysconfig, ensurepip\n"
    ask += "print(*sys.version_info[:2], sysconfig.get_config_var('Py_GIL_DISABLED') or 0)"
    versions: dict[tuple[int, int, int], str] = {}
    for path in found:
        done = subprocess.run(
            [path, "-c", ask],
            capture_output=True,
            text=True,
            check=False,
        )
        # pyenv also has commands for versions that are not selected. Debian's versions lack ensurepip without python3-venv.
        if done.returncode == 0:
            major, minor, is_free = map(int, done.stdout.split())
            versions.setdefault((major, minor, is_free), path)
    return {
        f"{major}.{minor}{'t' * is_free}": path
        for (major, minor, is_free), path in sorted(versions.items())
        if (major, minor) >= OLDEST
    }


def _try_out(python: str, wheel: Path, scratch: Path) -> None:
    """Install the wheel into a new environment, and run the demo there. Raise ReleaseError if that fails."""
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        venv = Path(folder, "venv")
        _run(python, "-m", "venv", str(venv))
        bin_folder = venv / ("Scripts" if os.name == "nt" else "bin")
        environ = {
            key: value
            for key, value in os.environ.items()
            if not key.startswith(("PYTHON", "ROS_", "MINIROSPY_"))
        }
        environ |= {"ROS_HOME": str(Path(folder, "ros")), "MINIROSPY_LOCAL": "1"}
        pip = [str(bin_folder / "python"), "-m", "pip", "--disable-pip-version-check"]
        _run(*pip, "install", "--quiet", str(wheel), environ=environ, cwd=folder)
        _run(*pip, "check", environ=environ, cwd=folder)
        shown = _run(str(bin_folder / "minirospy"), "demo", "--presses", "2", environ=environ, cwd=folder)
        if "2: button 1 released -> LED on GPIO 7 off" not in shown:
            raise ReleaseError(f"{python}: minirospy demo does not switch the LED:\n{shown}")


def _run(*command: str, environ: Mapping[str, str] | None = None, cwd: str | Path = ROOT) -> str:
    """Run a command and return its output. Raise ReleaseError with the output if the command fails."""
    done = subprocess.run(
        command,
        env=environ,
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode:
        raise ReleaseError(
            f"`{' '.join(command)}` ends with status {done.returncode}:\n{done.stdout}{done.stderr}"
        )
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
