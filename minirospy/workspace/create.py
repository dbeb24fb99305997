"""Create a package: a package.xml and a CMakeLists.txt that contain common entries as comments, for the user to edit.

Source: http://wiki.ros.org/catkin/commands/catkin_create_pkg, http://wiki.ros.org/catkin/package.xml.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape, quoteattr

from minirospy.base.errors import UsageError

__all__ = ["NewPackage", "create_package"]

_NAME = re.compile(r"^[a-zA-Z0-9][a-zA-Z0-9_-]*$")


class NewPackage(NamedTuple):
    """The description of a package to create."""

    name: str
    depends: Sequence[str] = ()
    version: str = "0.0.0"
    description: str = ""
    licenses: Sequence[str] = ()
    authors: Sequence[str] = ()
    maintainers: Sequence[str] = ()
    user: str = "user"
    meta: bool = False


def create_package(parent: Path, package: NewPackage) -> list[Path]:
    """Create a package's folder below ``parent``; return the files and folders created.

    Raise UsageError if the description is invalid or the package exists.
    """
    if not _NAME.match(package.name):
        raise UsageError(
            f"[{package.name}] is not a name for a package: lower-case letters, digits and underscores, a letter first"
        )

    for depend in package.depends:
        if not _NAME.match(depend):
            raise UsageError(f"[{depend}] is not the name of a package to depend on")

    if not re.match(r"^\d+\.\d+\.\d+$", package.version):
        raise UsageError(f"[{package.version}] is not a version: three numbers, as in 0.1.0")

    folder = parent / package.name
    if (folder / "package.xml").exists() or (folder / "CMakeLists.txt").exists():
        raise UsageError(f"{folder} is a package already")

    made = [folder / "package.xml", folder / "CMakeLists.txt"]
    folder.mkdir(parents=True, exist_ok=True)
    made[0].write_text(_package_xml(package), encoding="utf-8")
    made[1].write_text(
        _META.format(name=package.name) if package.meta else _cmake_lists(package), encoding="utf-8"
    )

    if package.meta:
        return made
    if "roscpp" in package.depends:
        # The folder for the package's C++ headers.
        made.append(folder / "include" / package.name)
    made.append(folder / "src")

    for path in made[2:]:
        path.mkdir(parents=True, exist_ok=True)
    return made


def _person(tag: str, person: str, user: str) -> str:
    """Return the XML tag of a person, given as a name or as ``Name <mail>``. A maintainer must have an e-mail address."""
    match = re.match(r"^(.*?)\s*<([^<>]+)>$", person)
    name, mail = (match[1], match[2]) if match else (person, "")
    if not mail and tag == "maintainer":
        mail = f"{person if person.isalnum() else user}@todo.todo"
    attribute = f" email={quoteattr(mail)}" if mail else ""
    return f"  <{tag}{attribute}>{escape(name)}</{tag}>"


def _package_xml(package: NewPackage) -> str:
    lines = [
        '<?xml version="1.0"?>',
        '<package format="2">',
        f"  <name>{package.name}</name>",
        f"  <version>{package.version}</version>",
        f"  <description>{escape(package.description or f'The {package.name} package')}</description>",
        "",
        "  <!-- Who looks after the package: one or more -->",
        *(_person("maintainer", person, package.user) for person in package.maintainers or [package.user]),
        "",
        "  <!-- One or more of: BSD, MIT, Apache-2.0, GPLv3, ... -->",
        *(f"  <license>{escape(license_)}</license>" for license_ in package.licenses or ["TODO"]),
        "",
        *(_person("author", person, package.user) for person in package.authors),
        "  <!-- Which packages this one needs. <depend> means all three of build_depend,",
        "       build_export_depend and exec_depend.",
        "       A package that defines messages, services or actions needs also:",
        "         <build_depend>message_generation</build_depend>",
        "         <exec_depend>message_runtime</exec_depend>",
        "       Needed by the tests only: <test_depend>rostest</test_depend> -->",
        "  <buildtool_depend>catkin</buildtool_depend>",
        *(
            f"  <{kind}>{depend}</{kind}>"
            for kind in (
                ("exec_depend",) if package.meta else ("build_depend", "build_export_depend", "exec_depend")
            )
            for depend in package.depends
        ),
        "",
        "  <export>",
        "    <metapackage/>"
        if package.meta
        else "    <!-- What other tools want to know of this package -->",
        "  </export>",
        "</package>",
        "",
    ]

    return "\n".join(lines)


def _cmake_lists(package: NewPackage) -> str:
    components = "".join(f"  {depend}\n" for depend in package.depends)
    found = (
        f"find_package(catkin REQUIRED COMPONENTS\n{components})"
        if components
        else "find_package(catkin REQUIRED)"
    )
    return _CMAKE.format(name=package.name, find_package=found, depends=" ".join(package.depends) or "rospy")


_META = """cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED)
catkin_metapackage()
"""

_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project({name})

## The packages that this one needs to be built
{find_package}

## A package with Python modules (src/{name}/__init__.py and a setup.py that names them):
# catkin_python_setup()

###############################################
## Messages, services and actions of our own ##
###############################################
## 1. write them into the folders msg, srv, action
## 2. package.xml: <build_depend>message_generation</build_depend>
##    and <exec_depend>message_runtime</exec_depend>, and a <depend> for each package
##    whose messages they contain
## 3. above: message_generation and those packages in find_package(... COMPONENTS ...)
## 4. here: take away the # in front of what is needed, and name each file

## Generate messages in the 'msg' folder
# add_message_files(
#   FILES
#   Message1.msg
# )

## Generate services in the 'srv' folder
# add_service_files(
#   FILES
#   Service1.srv
# )

## Generate actions in the 'action' folder
# add_action_files(
#   FILES
#   Action1.action
# )

## Generate all of them, with the packages whose messages they contain
# generate_messages(
#   DEPENDENCIES
#   std_msgs
# )

#####################################
## For packages that need this one ##
#####################################
catkin_package(
#  INCLUDE_DIRS include
#  LIBRARIES {name}
#  CATKIN_DEPENDS {depends}
#  DEPENDS system_lib
)

###########
## Build ##
###########
include_directories(
# include
  ${{catkin_INCLUDE_DIRS}}
)

#############
## Install ##
#############
## Programs that `rosrun` finds after `catkin_make install`
# catkin_install_python(PROGRAMS
#   scripts/my_python_script.py
#   DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}}
# )

## Other files, such as launch files
# install(DIRECTORY launch
#   DESTINATION ${{CATKIN_PACKAGE_SHARE_DESTINATION}}
# )

#############
## Testing ##
#############
## A folder or file of tests for pytest
# catkin_add_nosetests(test)
"""
