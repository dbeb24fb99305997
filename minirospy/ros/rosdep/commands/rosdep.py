"""rosdep: list packages' dependencies that are missing on this machine, and how to install them.

Tutorials use `rosdep install --from-paths src --ignore-src -r -y`. ROS's rosdep queries a database on the network and
runs the system's package manager. This command downloads and installs nothing, because minirospy provides ROS's packages.
For any other missing dependency, it prints the command that installs it. Source:
http://docs.ros.org/en/independent/api/rosdep/html/commands.html.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from minirospy.base.errors import UsageError
from minirospy.base.installation import install_command
from minirospy.command.parser import Parser
from minirospy.command.verbs import Family, Verb

__all__ = ["FAMILY", "main"]

_PYTHON_KEY = re.compile(r"^python3?-(?P<name>.+?)(-pip)?$|^(?P<other>.+)-pip$")
_PYTHON_PACKAGES: dict[str, tuple[str, str]] = {
    "bs4": ("bs4", "beautifulsoup4"),
    "dateutil": ("dateutil", "python-dateutil"),
    "imaging": ("PIL", "pillow"),
    "opencv": ("cv2", "opencv-python"),
    "paho-mqtt": ("paho.mqtt", "paho-mqtt"),
    "pil": ("PIL", "pillow"),
    "protobuf": ("google.protobuf", "protobuf"),
    "rpi.gpio": ("RPi.GPIO", "rpi-lgpio"),
    "serial": ("serial", "pyserial"),
    "skimage": ("skimage", "scikit-image"),
    "sklearn": ("sklearn", "scikit-learn"),
    "usb": ("usb", "pyusb"),
    "yaml": ("yaml", "PyYAML"),
    "zmq": ("zmq", "pyzmq"),
}
"""(module, PyPI name) of the Python packages whose names cannot be derived from the rosdep key."""
_TOOLS = frozenset(
    """
    cmake python python3 python-catkin-pkg python3-catkin-pkg python3-catkin-pkg-modules python-catkin-tools
    python3-catkin-tools python-empy python3-empy python-mock python3-mock python-nose python3-nose python-rosdep
    python3-rosdep python-rospkg python3-rospkg python3-rospkg-modules python-setuptools python3-setuptools
    """.split()  # noqa: SIM905
)
"""Keys needed to build and test with catkin; minirospy replaces these tools."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 1 if a dependency is missing, else 0."""
    return FAMILY.main(argv)


def _parser(verb: str, description: str) -> Parser:
    parser = Parser(f"rosdep {verb}", description)

    add = parser.add_argument
    add(
        "packages",
        nargs="*",
        default=[],
        help="packages (without: those of --from-paths)",
        completer="package_names",
    )

    add(
        "--from-paths",
        nargs="+",
        type=Path,
        default=[],
        help="all packages in these folders",
        completer="folders",
    )
    add("--skip-keys", action="append", default=[], help="keys to leave out", completer="nothing")
    add("-a", "--all", action="store_true", help="all packages that rospack finds")
    add("-r", dest="tolerant", action="store_true", help="what is missing is not an error")

    for flags in (
        ("-i", "--ignore-src", "--ignore-packages-from-source"),
        ("-y", "--default-yes"),
        ("-s", "--simulate"),
        ("-q", "--quiet"),
        ("-n", "--dry-run"),
        ("-v", "--verbose"),
        ("--reinstall",),
    ):
        parser.accept(*flags, help="accepted: nothing is installed")
    for names in (("--rosdistro",), ("--os",), ("-t", "--dependency-types")):
        parser.accept(*names, nargs=None, help="accepted")
    return parser


def _missing(
    packages: Sequence[str], from_paths: Sequence[Path], skip_keys: Sequence[str], *, everything: bool
) -> dict[str, list[str]]:
    """Return the missing keys with the packages that depend on them.

    Raise NotFoundError if a package does not exist, ManifestError if its manifest is invalid, UsageError if no package is
    given or a folder does not exist.
    """
    from minirospy.workspace.build import PROVIDED
    from minirospy.workspace.manifest import Kind, read_manifest
    from minirospy.workspace.packages import Packages

    for path in from_paths:
        if not path.is_dir():
            raise UsageError(f"--from-paths: folder {path} does not exist")

    here = Packages()
    folders = Packages.below(*from_paths).folders()
    known = {*here.folders(), *folders, *PROVIDED, *_TOOLS, *" ".join(skip_keys).split()}
    if everything:
        folders.update(here.folders())
    folders.update({name: here.find(name) for name in packages})
    if not (folders or from_paths):
        raise UsageError("which packages? `rosdep install --from-paths src --ignore-src`, or their names")

    found: dict[str, list[str]] = {}
    kinds = [kind for kind in Kind if kind is not Kind.DOC]
    for name, folder in sorted(folders.items()):
        for key in read_manifest(folder, os.environ).depends(*kinds):
            if key not in known:
                found.setdefault(key, []).append(name)
    return dict(sorted(found.items()))


def _module(key: str) -> tuple[str, str] | None:
    """Return the module and PyPI name for a rosdep key, or None if the key is not for a Python package."""
    match = _PYTHON_KEY.match(key)
    if match is None:
        return None
    name: str = match["name"] or match["other"]
    return _PYTHON_PACKAGES.get(name, (name.replace("-", "_"), name))


def _is_installed(key: str) -> bool:
    module = _module(key)
    try:
        return module is not None and importlib.util.find_spec(module[0]) is not None
    except (ImportError, ValueError):
        return False


def _says(keys: dict[str, list[str]]) -> Iterator[str]:
    """Yield a line for each key: the packages that depend on it and how to install it."""
    for key, packages in keys.items():
        module = _module(key)
        how = install_command(module[1]) if module else "no package of Python or of ROS here"
        yield f"{key} (of {', '.join(packages)}): {how}"


def _install_parser() -> Parser:
    return _parser(
        "install", "Print how what packages need is installed. Nothing is fetched, nothing is installed."
    )


def _install(
    packages: Sequence[str], from_paths: Sequence[Path], skip_keys: Sequence[str], all: bool, tolerant: bool
) -> int:
    keys = _missing(packages, from_paths, skip_keys, everything=all)
    missing = {key: needed_by for key, needed_by in keys.items() if not _is_installed(key)}
    if not missing:
        print("#All required rosdeps installed successfully")
        return 0

    for line in _says(missing):
        print(line)
    print("rosdep: not installed; nodes in Python may do without what is not of Python", file=sys.stderr)
    return 0 if tolerant else 1


def _check_parser() -> Parser:
    return _parser("check", "Check whether all that packages need is there.")


def _check(
    packages: Sequence[str], from_paths: Sequence[Path], skip_keys: Sequence[str], all: bool, tolerant: bool
) -> int:
    keys = _missing(packages, from_paths, skip_keys, everything=all)
    missing = {key: needed_by for key, needed_by in keys.items() if not _is_installed(key)}
    if not missing:
        print("All system dependencies have been satisfied")
        return 0

    print("System dependencies have not been satisfied:")
    for line in _says(missing):
        print(line)
    return 1


def _keys_parser() -> Parser:
    return _parser("keys", "List what packages need that is not a package here.")


def _keys(
    packages: Sequence[str], from_paths: Sequence[Path], skip_keys: Sequence[str], all: bool, tolerant: bool
) -> None:
    for key in _missing(packages, from_paths, skip_keys, everything=all):
        print(key)


def _resolve_parser() -> Parser:
    parser = Parser("rosdep resolve", "Print what a key means: a package of Python.")
    parser.add_argument(
        "keys", nargs="+", metavar="key", help="as in package.xml: python3-serial", completer="nothing"
    )
    return parser


def _resolve(keys: Sequence[str]) -> int:
    status = 0
    for key in keys:
        module = _module(key)
        if module:
            print(f"#pip\n{module[1]}")
        else:
            print(f"rosdep: ERROR: no package of Python is known for [{key}]", file=sys.stderr)
            status = 1
    return status


class _IgnoringParser(Parser):
    """Accepts and ignores any arguments."""

    def parse(self, words: Sequence[str]) -> dict[str, object]:
        """Ignore the words and return no arguments."""
        return {}


def _nothing_parser(verb: str) -> Parser:
    return _IgnoringParser(f"rosdep {verb}", "Nothing: this rosdep has no database.")


def _nothing() -> None:
    print("Nothing to do: minirospy brings along what ROS needs, and no database is asked")


FAMILY = Family(
    "rosdep",
    "rosdep command",
    (
        Verb("check", "Check whether all that packages need is there", _check_parser, _check),
        Verb("init", "Nothing: this rosdep has no database", partial(_nothing_parser, "init"), _nothing),
        Verb("install", "Say how what is missing is installed", _install_parser, _install),
        Verb("keys", "List the dependencies that are not packages here", _keys_parser, _keys),
        Verb("resolve", "Print what a key means", _resolve_parser, _resolve),
        Verb("update", "Nothing: this rosdep has no database", partial(_nothing_parser, "update"), _nothing),
    ),
)
