"""Finds the arguments that a launch file declares, without loading the files that it includes."""

from __future__ import annotations

import os
from collections.abc import Mapping

from minirospy.base.errors import LaunchError
from minirospy.ros.roslaunch.launcher.document import Tag, parse_document
from minirospy.ros.roslaunch.launcher.files import read_launch_file
from minirospy.ros.roslaunch.launcher.spec import ArgDoc
from minirospy.ros.roslaunch.launcher.substitution import Substitution
from minirospy.workspace.packages import Packages

__all__ = ["describe_args", "resolved_arg_docs"]


def describe_args(file: str) -> list[ArgDoc]:
    """Return the arguments that a file declares, without loading its includes.

    Raise LaunchError if the file cannot be read or parsed.
    """
    root = parse_document(read_launch_file(file), file)
    return [
        ArgDoc(attributes["name"], attributes.get("default"), attributes.get("doc"))
        for attributes in (element.attributes for element in root.children if element.tag == "arg")
        if "name" in attributes and "value" not in attributes
    ]


def resolved_arg_docs(file: str, args: Mapping[str, str], packages: Packages) -> list[ArgDoc]:
    """Return describe_args() with the defaults resolved for ``args``.

    Declarations that an ``if`` or ``unless`` excludes are left out. A default that cannot be resolved is returned
    unresolved. Raise LaunchError if the file cannot be read or parsed.
    """
    substitution = Substitution(packages, os.environ, file, dict(args))
    found: dict[str, ArgDoc] = {}
    for tag in Tag(parse_document(read_launch_file(file), file), file, substitution).children():
        attributes = tag.element.attributes
        name, default = attributes.get("name"), attributes.get("default")
        if tag.name != "arg" or name is None:
            continue
        try:
            if not tag.applies():
                continue
            value, default = tag.optional("value"), tag.optional("default")
        except LaunchError:
            value = attributes.get("value")
        if value is None:
            found.setdefault(name, ArgDoc(name, default, attributes.get("doc")))
            value = default
        if value is not None:
            substitution.args.setdefault(name, value)
    return list(found.values())
