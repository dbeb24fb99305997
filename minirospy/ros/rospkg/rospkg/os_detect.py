"""rospkg.os_detect: detects the operating system's name, version and codename.

All Linux distributions specify these in /etc/os-release, so one class replaces rospkg's detectors for single
distributions. The environment variable ``ROS_OS_OVERRIDE`` (``ubuntu:22.04:jammy``) takes precedence.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping

__all__ = [
    "OSX",
    "OS_ALMALINUX",
    "OS_ALPINE",
    "OS_AMAZON",
    "OS_ARCH",
    "OS_BUILDROOT",
    "OS_CENTOS",
    "OS_CLEARLINUX",
    "OS_CONDA",
    "OS_CYGWIN",
    "OS_DEBIAN",
    "OS_ELEMENTARY",
    "OS_ELEMENTARY_OLD",
    "OS_EULEROS",
    "OS_FEDORA",
    "OS_FREEBSD",
    "OS_FUNTOO",
    "OS_GENTOO",
    "OS_LINARO",
    "OS_MANJARO",
    "OS_MINT",
    "OS_MX",
    "OS_NEON",
    "OS_NIXOS",
    "OS_OPENEMBEDDED",
    "OS_OPENSUSE",
    "OS_OPENSUSE13",
    "OS_ORACLE",
    "OS_OSX",
    "OS_POP",
    "OS_QNX",
    "OS_RASPBIAN",
    "OS_RHEL",
    "OS_ROCKY",
    "OS_SAILFISHOS",
    "OS_SLACKWARE",
    "OS_TIZEN",
    "OS_UBUNTU",
    "OS_WINDOWS",
    "OS_ZORIN",
    "Debian",
    "FdoDetect",
    "FreeBSD",
    "LsbDetect",
    "OsDetect",
    "OsDetector",
    "OsNotDetected",
    "Windows",
    "read_issue",
    "read_os_release",
    "uname_get_machine",
]

OS_ALMALINUX, OS_ALPINE, OS_AMAZON, OS_ARCH, OS_BUILDROOT = (
    "almalinux",
    "alpine",
    "amazon",
    "arch",
    "buildroot",
)
OS_CENTOS, OS_CLEARLINUX, OS_CONDA, OS_CYGWIN, OS_DEBIAN = "centos", "clearlinux", "conda", "cygwin", "debian"
OS_ELEMENTARY = OS_ELEMENTARY_OLD = "elementary"
OS_EULEROS, OS_FEDORA, OS_FREEBSD, OS_FUNTOO, OS_GENTOO = "euleros", "fedora", "freebsd", "funtoo", "gentoo"
OS_LINARO, OS_MANJARO, OS_MINT, OS_MX, OS_NEON, OS_NIXOS = "linaro", "manjaro", "mint", "mx", "neon", "nixos"
OS_OPENEMBEDDED, OS_OPENSUSE, OS_OPENSUSE13, OS_ORACLE = "openembedded", "opensuse", "opensuse", "oracle"
OS_OSX, OS_POP, OS_QNX, OS_RASPBIAN, OS_RHEL, OS_ROCKY = "osx", "pop", "qnx", "raspbian", "rhel", "rocky"
OS_SAILFISHOS, OS_SLACKWARE, OS_TIZEN, OS_UBUNTU = "sailfishos", "slackware", "tizen", "ubuntu"
OS_WINDOWS, OS_ZORIN = "windows", "zorin"

_OF_FDO = {
    "almalinux": OS_ALMALINUX, "alpine": OS_ALPINE, "amzn": OS_AMAZON, "arch": OS_ARCH, "buildroot": OS_BUILDROOT,
    "centos": OS_CENTOS, "clear-linux-os": OS_CLEARLINUX, "debian": OS_DEBIAN, "elementary": OS_ELEMENTARY,
    "euleros": OS_EULEROS, "fedora": OS_FEDORA, "funtoo": OS_FUNTOO, "gentoo": OS_GENTOO, "linaro": OS_LINARO,
    "manjaro": OS_MANJARO, "linuxmint": OS_MINT, "mx": OS_MX, "neon": OS_NEON, "nixos": OS_NIXOS, "ol": OS_ORACLE,
    "opensuse-leap": OS_OPENSUSE, "opensuse-tumbleweed": OS_OPENSUSE, "opensuse": OS_OPENSUSE, "pop": OS_POP,
    "raspbian": OS_DEBIAN, "rhel": OS_RHEL, "rocky": OS_ROCKY, "sailfishos": OS_SAILFISHOS, "slackware": OS_SLACKWARE,
    "tizen": OS_TIZEN, "ubuntu": OS_UBUNTU, "zorin": OS_ZORIN,
}  # fmt: skip
"""rospkg's names of systems, keyed by their ID in /etc/os-release."""


class OsNotDetected(Exception):
    """Raised if the running OS is not the one that a detector detects, or no detector matches."""


def read_os_release(filename: str | None = None) -> dict[str, str] | None:
    """Return the values in an os-release file, or None if the file does not exist."""
    for path in (filename,) if filename else ("/etc/os-release", "/usr/lib/os-release"):
        try:
            with open(path, encoding="utf-8", errors="replace") as file:
                pairs = (line.strip().partition("=") for line in file)
                return {name: value.strip("\"'") for name, sign, value in pairs if sign and name[0] != "#"}
        except OSError:
            continue
    return None


def read_issue(filename: str = "/etc/issue") -> list[str] | None:
    """Return the words in /etc/issue, or None if the file does not exist."""
    try:
        with open(filename, encoding="utf-8", errors="replace") as file:
            return file.read().split()
    except OSError:
        return None


def uname_get_machine() -> str:
    """Return the architecture, such as ``x86_64``."""
    return platform.machine()


class OsDetector:
    """Detects one operating system."""

    def is_os(self) -> bool:
        """Return whether this machine runs the OS that this object detects."""
        raise NotImplementedError("is_os unimplemented")

    def get_version(self) -> str:
        """Return the system's version. Raise OsNotDetected if another OS is running."""
        raise NotImplementedError("get_version unimplemented")

    def get_codename(self) -> str:
        """Return the system's codename. Raise OsNotDetected if another OS is running."""
        raise NotImplementedError("get_codename unimplemented")


class FdoDetect(OsDetector):
    """Detects a Linux distribution by its ID in os-release."""

    def __init__(self, fdo_id: str) -> None:
        release = read_os_release()
        self.release_info = release if release and release.get("ID") == fdo_id else None

    def is_os(self) -> bool:
        """Return whether this machine runs the OS that this object detects."""
        return self.release_info is not None

    def get_version(self) -> str:
        """Return VERSION_ID. Raise OsNotDetected if another OS is running."""
        return self._info().get("VERSION_ID", "")

    def get_codename(self) -> str:
        """Return VERSION_CODENAME. Raise OsNotDetected if another OS is running."""
        release = self._info()
        codename = release.get("VERSION_CODENAME", "")
        if not codename and "(" in (version := release.get("VERSION", "")):
            codename = version[version.index("(") + 1 : version.index(")")].lower()
        return codename

    def _info(self) -> Mapping[str, str]:
        if self.release_info is None:
            raise OsNotDetected("called in incorrect OS")
        return self.release_info


class LsbDetect(FdoDetect):
    """Detects a Linux distribution by its `lsb_release` name, which os-release contains in lower case."""

    def __init__(self, lsb_name: str, get_version_fn: object = None) -> None:
        self.lsb_name = lsb_name
        super().__init__(lsb_name.lower())


class Debian(LsbDetect):
    """Detects Debian."""

    def __init__(self, get_version_fn: object = None) -> None:
        super().__init__("debian", get_version_fn)


class _Platform(OsDetector):
    """Detects an OS by its name in Python's ``platform`` module."""

    system = ""

    def is_os(self) -> bool:
        """Return whether this machine runs the OS that this object detects."""
        return platform.system() == self.system

    def get_version(self) -> str:
        """Return the system's version. Raise OsNotDetected if another OS is running."""
        if not self.is_os():
            raise OsNotDetected("called in incorrect OS")
        return self._version()

    def get_codename(self) -> str:
        """Return an empty codename. Raise OsNotDetected if another OS is running."""
        if not self.is_os():
            raise OsNotDetected("called in incorrect OS")
        return ""

    def _version(self) -> str:
        return platform.release()


class Windows(_Platform):
    """Detects Windows."""

    system = "Windows"

    def _version(self) -> str:
        return platform.version()


class OSX(_Platform):
    """Detects macOS."""

    system = "Darwin"

    def __init__(self, sw_vers_file: str = "/usr/bin/sw_vers") -> None:
        self._sw_vers_file = sw_vers_file

    def _version(self) -> str:
        return platform.mac_ver()[0]


class FreeBSD(_Platform):
    """Detects FreeBSD."""

    system = "FreeBSD"

    def __init__(self, uname_file: str = "/usr/bin/uname") -> None:
        self._uname_file = uname_file


class OsDetect:
    """Detects the OS with the first detector that matches."""

    default_os_list: list[tuple[str, OsDetector]] = []

    def __init__(self, os_list: list[tuple[str, OsDetector]] | None = None) -> None:
        self._os_list = OsDetect.default_os_list if os_list is None else os_list
        self._found: tuple[str, str, str, OsDetector | None] | None = None

    @staticmethod
    def register_default(os_name: str, os_detector: OsDetector) -> None:
        """Add a detector for all later OsDetect objects."""
        OsDetect.default_os_list.append((os_name, os_detector))

    def detect_os(self, env: Mapping[str, str] | None = None) -> tuple[str, str, str]:
        """Return the system's name, version and codename. Raise OsNotDetected if no detector matches."""
        override = (os.environ if env is None else env).get("ROS_OS_OVERRIDE")
        if override:
            name, version, codename = (*override.split(":"), "", "")[:3]
            self._found = (name, version, codename, None)
        else:
            for name, detector in self._os_list:
                if detector.is_os():
                    self._found = (name, detector.get_version(), detector.get_codename(), detector)
                    break
        if self._found is None:
            raise OsNotDetected(f"Could not detect OS, tried {[name for name, _ in self._os_list]}")
        return self._found[:3]

    def get_detector(self, name: str | None = None) -> OsDetector | None:
        """Return the detector with this name, by default the one that matched.

        Raise KeyError if the name is unknown, OsNotDetected if no detector matches.
        """
        if name is None:
            self.detect_os()
            return self._found[3] if self._found else None
        for known, detector in self._os_list:
            if known == name:
                return detector
        raise KeyError(name)

    def add_detector(self, name: str, detector: OsDetector) -> None:
        """Add a detector to the end of the list."""
        self._os_list.append((name, detector))

    def get_name(self) -> str:
        """Return the system's name. Raise OsNotDetected if no detector matches."""
        return (self._found or self.detect_os())[0]

    def get_version(self) -> str:
        """Return the system's version. Raise OsNotDetected if no detector matches."""
        return (self._found or self.detect_os())[1]

    def get_codename(self) -> str:
        """Return the system's codename. Raise OsNotDetected if no detector matches."""
        return (self._found or self.detect_os())[2]


OsDetect.default_os_list += [(name, FdoDetect(fdo_id)) for fdo_id, name in _OF_FDO.items()]
OsDetect.default_os_list += [(OS_WINDOWS, Windows()), (OS_OSX, OSX()), (OS_FREEBSD, FreeBSD())]
