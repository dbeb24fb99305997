"""catkin_pkg.python_setup: derives the arguments for setup() from package.xml.

Source: http://docs.ros.org/en/noetic/api/catkin/html/user_guide/setup_dot_py.html.
"""

from __future__ import annotations

import sys

from minirospy.ros.catkin_pkg.catkin_pkg.package import InvalidPackage, Person, parse_package

__all__ = [
    "InvalidPackage",
    "generate_distutils_setup",
    "get_global_bin_destination",
    "get_global_etc_destination",
    "get_global_include_destination",
    "get_global_lib_destination",
    "get_global_libexec_destination",
    "get_global_python_destination",
    "get_global_share_destination",
    "get_package_bin_destination",
    "get_package_etc_destination",
    "get_package_include_destination",
    "get_package_lib_destination",
    "get_package_python_destination",
    "get_package_share_destination",
    "parse_package",
]


def generate_distutils_setup(package_xml_path: str = ".", **kwargs: object) -> dict[str, object]:
    """Return the arguments for setup(). Raise InvalidPackage if a given argument differs from package.xml."""
    package = parse_package(package_xml_path)
    found: dict[str, object] = {
        "name": package.name,
        "version": package.version,
        **_persons("maintainer", package.maintainers),
        **_persons("author", package.authors),
        "description": package.plaintext_description,
        "license": ", ".join(package.licenses),
    }
    website = next((url.url for url in package.urls if url.type == "website"), None)
    if website is not None:
        found["url"] = website
    for name, value in kwargs.items():
        if name in found and found[name] != value:
            raise InvalidPackage(
                f'The keyword argument "{name}" does not match the information from package.xml: '
                f'"{value}" != "{found[name]}"',
                package_xml_path,
            )
        found[name] = value
    return found


def _persons(kind: str, persons: list[Person]) -> dict[str, object]:
    if len(persons) != 1:
        return {kind: ", ".join(map(str, persons))}
    email = persons[0].email
    return {kind: persons[0].name, **({f"{kind}_email": email} if email is not None else {})}


def get_global_bin_destination() -> str:
    """Return the folder shared by all packages' commands, relative to the install prefix."""
    return "bin"


def get_global_etc_destination() -> str:
    """Return the folder shared by all packages' configuration files, relative to the install prefix."""
    return "etc"


def get_global_include_destination() -> str:
    """Return the folder shared by all packages' header files, relative to the install prefix."""
    return "include"


def get_global_lib_destination() -> str:
    """Return the folder shared by all packages' libraries, relative to the install prefix."""
    return "lib"


def get_global_libexec_destination() -> str:
    """Return the folder shared by all packages' programs, relative to the install prefix."""
    return "lib"


def get_global_share_destination() -> str:
    """Return the folder shared by all packages' data files, relative to the install prefix."""
    return "share"


def get_global_python_destination() -> str:
    """Return the folder for Python modules, relative to the install prefix."""
    return f"lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"


def get_package_bin_destination(pkgname: str) -> str:
    """Return the folder for a package's programs, relative to the install prefix."""
    return "lib/" + pkgname


def get_package_etc_destination(pkgname: str) -> str:
    """Return the folder for a package's configuration files, relative to the install prefix."""
    return "etc/" + pkgname


def get_package_include_destination(pkgname: str) -> str:
    """Return the folder for a package's header files, relative to the install prefix."""
    return "include/" + pkgname


def get_package_share_destination(pkgname: str) -> str:
    """Return the folder for a package's data files, relative to the install prefix."""
    return "share/" + pkgname


def get_package_lib_destination(_pkgname: str) -> str:
    """Return the folder for a package's libraries, relative to the install prefix."""
    return get_global_lib_destination()


def get_package_python_destination(pkgname: str) -> str:
    """Return the folder for a package's Python modules, relative to the install prefix."""
    return get_global_python_destination() + "/" + pkgname
