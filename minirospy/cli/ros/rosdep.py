"""rosdep: what packages need that is no package here, and how it is installed.

Tutorials say `rosdep install --from-paths src --ignore-src -r -y`. rosdep asks a database on the network and calls the
system's package manager. Here nothing is fetched and nothing is installed: what ROS itself brings along is minirospy's,
and of the rest it is said what is missing, and what to type for it.
Source: http://docs.ros.org/en/independent/api/rosdep/html/commands.html.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from minirospy.cli.command import Parser
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import UsageError

__all__ = ["main"]

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
"""Name in a key of rosdep -> (module, name on PyPI), where both are not that name."""
_TOOLS = frozenset(
    """
    cmake python python3 python-catkin-pkg python3-catkin-pkg python3-catkin-pkg-modules python-catkin-tools
    python3-catkin-tools python-empy python3-empy python-mock python3-mock python-nose python3-nose python-rosdep
    python3-rosdep python-rospkg python3-rospkg python3-rospkg-modules python-setuptools python3-setuptools
    """.split()  # noqa: SIM905
)
"""What builds and tests with catkin ask for, and minirospy does itself."""


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status is 1 where something is missing."""
    verbs = (
        Verb("check", "Check whether all that packages need is there", _check),
        Verb("init", "Nothing: there is no database to set up", _nothing),
        Verb("install", "Say how what is missing is installed", _install),
        Verb("keys", "List what packages need that is no package here", _keys),
        Verb("resolve", "Print what a key means", _resolve),
        Verb("update", "Nothing: there is no database to update", _nothing),
    )
    return Family("rosdep", "rosdep command", verbs).main(argv)


def _parser(verb: str, description: str) -> Parser:
    parser = Parser(f"rosdep {verb}", description=description)
    parser.add_argument("packages", nargs="*", default=[], help="packages (without: those of --from-paths)")
    parser.add_argument(
        "--from-paths", nargs="+", type=Path, default=[], help="all packages in these folders"
    )
    parser.add_argument("--skip-keys", action="append", default=[], help="keys to leave out")
    parser.add_argument("-a", "--all", action="store_true", help="all packages that rospack finds")
    parser.add_argument("-r", action="store_true", help="what is missing is no error")
    for flags in (
        ("-i", "--ignore-src", "--ignore-packages-from-source"),
        ("-y", "--default-yes"),
        ("-s", "--simulate"),
        ("-q", "--quiet"),
        ("-n", "--dry-run"),
        ("-v", "--verbose"),
        ("--reinstall",),
    ):
        parser.add_argument(
            *flags, action="store_true", help="accepted: nothing is installed, nothing is asked"
        )
    for names in (("--rosdistro",), ("--os",), ("-t", "--dependency-types")):
        parser.add_argument(*names, action="append", help="accepted")
    return parser


def _missing(parser: Parser, argv: Sequence[str]) -> tuple[dict[str, list[str]], bool]:
    """Key -> the packages that ask for it, of all keys that are not here; and whether that is no error.

    Raises NotFoundError, ManifestError, UsageError.
    """
    from minirospy.workspace.build import PROVIDED
    from minirospy.workspace.manifest import Kind, read_manifest
    from minirospy.workspace.packages import Packages

    options = parser.parse_args(argv)
    for path in options.from_paths:
        if not path.is_dir():
            raise UsageError(f"--from-paths: there is no folder {path}")
    here = Packages()
    folders = Packages.below(*options.from_paths).folders()
    known = {*here.folders(), *folders, *PROVIDED, *_TOOLS, *" ".join(options.skip_keys).split()}
    if options.all:
        folders.update(here.folders())
    folders.update({name: here.find(name) for name in options.packages})
    if not (folders or options.from_paths):
        raise UsageError("which packages? `rosdep install --from-paths src --ignore-src`, or their names")
    found: dict[str, list[str]] = {}
    kinds = [kind for kind in Kind if kind is not Kind.DOC]
    for name, folder in sorted(folders.items()):
        for key in read_manifest(folder, os.environ).depends(*kinds):
            if key not in known:
                found.setdefault(key, []).append(name)
    return dict(sorted(found.items())), options.r


def _module(key: str) -> tuple[str, str] | None:
    """The module and the name on PyPI that a key stands for; None where it is no key of Python."""
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
    """A line for each key that is not installed: who asks for it, and what to do."""
    for key, packages in keys.items():
        module = _module(key)
        how = (
            f"{sys.executable} -m pip install {module[1]}"
            if module
            else "no package of Python or of ROS here"
        )
        yield f"{key} (of {', '.join(packages)}): {how}"


def _install(argv: Sequence[str]) -> int:
    parser = _parser(
        "install", "Say how what packages need is installed. Nothing is fetched, nothing is installed."
    )
    keys, is_no_error = _missing(parser, argv)
    missing = {key: packages for key, packages in keys.items() if not _is_installed(key)}
    if not missing:
        print("#All required rosdeps installed successfully")
        return 0
    for line in _says(missing):
        print(line)
    print("rosdep: not installed; nodes in Python may do without what is not of Python", file=sys.stderr)
    return 0 if is_no_error else 1


def _check(argv: Sequence[str]) -> int:
    keys, _ = _missing(_parser("check", "Check whether all that packages need is there."), argv)
    missing = {key: packages for key, packages in keys.items() if not _is_installed(key)}
    if not missing:
        print("All system dependencies have been satisfied")
        return 0
    print("System dependencies have not been satisfied:")
    for line in _says(missing):
        print(line)
    return 1


def _keys(argv: Sequence[str]) -> int:
    for key in _missing(_parser("keys", "List what packages need that is no package here."), argv)[0]:
        print(key)
    return 0


def _resolve(argv: Sequence[str]) -> int:
    parser = Parser("rosdep resolve", description="Print what a key means: a package of Python.")
    parser.add_argument("keys", nargs="+", metavar="key", help="as in package.xml: python3-serial")
    status = 0
    for key in parser.parse_args(argv).keys:
        module = _module(key)
        if module:
            print(f"#pip\n{module[1]}")
        else:
            print(f"rosdep: ERROR: no package of Python is known for [{key}]", file=sys.stderr)
            status = 1
    return status


def _nothing(argv: Sequence[str]) -> int:
    print("Nothing to do: minirospy brings along what ROS needs, and no database is asked")
    return 0
