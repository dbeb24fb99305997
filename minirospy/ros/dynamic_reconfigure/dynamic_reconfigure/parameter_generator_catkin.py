"""dynamic_reconfigure.parameter_generator_catkin: the API for .cfg files, Python programs that define parameters.

As in ROS, catkin_make passes four folders to the .cfg file: dynamic_reconfigure's own, and those for documentation, C++
headers and Python modules. The .cfg file writes no C++ header, because minirospy does not compile C++.
Source: http://wiki.ros.org/dynamic_reconfigure/Tutorials/HowToWriteYourFirstCfgFile.
"""

from __future__ import annotations

import inspect as inspect
import os as os
import re
import sys
import textwrap as textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Literal, TypeAlias

from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import Entry, Value, generated

__all__ = [
    "ParameterGenerator",
    "Template",
    "bool_t",
    "check_description",
    "check_name",
    "double_t",
    "inspect",
    "int_t",
    "os",
    "re",
    "str_t",
    "sys",
    "textwrap",
]

str_t = "str"
bool_t = "bool"
int_t = "int"
double_t = "double"

_PYTHON_TYPES: dict[str, type[Value]] = {str_t: str, int_t: int, double_t: float, bool_t: bool}
_CPP_TYPES = {str_t: "std::string", int_t: "int", double_t: "double", bool_t: "bool"}
_CPP_CONSTANTS = {
    str_t: "const char * const",
    int_t: "const int",
    double_t: "const double",
    bool_t: "const bool",
}
_ValueKey: TypeAlias = Literal["value", "default", "min", "max"]
_NAME = re.compile(r"[a-zA-Z][a-zA-Z0-9_]*\Z")

_USAGE = """This program describes parameters; it is not called by itself.

catkin_make runs it: name it in CMakeLists.txt, before catkin_package(),

    generate_dynamic_reconfigure_options(cfg/NAME.cfg)

See http://wiki.ros.org/dynamic_reconfigure/Tutorials"""


def check_description(description: str) -> None:
    """Raise Exception if a description contains a quote, as ROS does: its C++ header cannot represent one."""
    if "'" in description or '"' in description:
        raise Exception(f"quotes not allowed in description string `{description}`")


def check_name(name: str) -> None:
    """Raise Exception if a parameter name is invalid."""
    if not _NAME.match(name):
        raise Exception(
            f"The name of field '{name}' does not follow the ROS naming conventions, "
            "see http://wiki.ros.org/ROS/Patterns/Conventions"
        )


class ParameterGenerator:
    """Defines a node's parameters, organized in groups. ``generate`` writes the generated files."""

    minval: Mapping[str, Value] = {int_t: -0x80000000, double_t: -float("inf"), str_t: "", bool_t: False}
    maxval: Mapping[str, Value] = {int_t: 0x7FFFFFFF, double_t: float("inf"), str_t: "", bool_t: True}
    defval: Mapping[str, Value] = {int_t: 0, double_t: 0.0, str_t: "", bool_t: False}

    class Group:
        """A group of parameters that user interfaces show together. May have subgroups."""

        def __init__(
            self, gen: ParameterGenerator, name: str, type: str, state: bool, id: int, parent: int
        ) -> None:
            """Create a group.

            ``type``: how the group is shown ("", "collapse", "tab", "hide", "apply"); ``state``: whether it is open.
            """
            self.gen = gen
            self.name = name.replace(" ", "_")
            self.type = type
            self.state = state
            self.id = id
            self.parent = parent
            self.groups: list[ParameterGenerator.Group] = []
            self.parameters: list[Entry] = []
            self.srcfile, self.srcline = _source_line()
            gen._groups()[id] = self

        def get_group(self, id: int) -> ParameterGenerator.Group:
            """Return the group with this ID. Raise KeyError if there is none."""
            return self.gen._groups()[id]

        def add_group(self, name: str, type: str = "", state: bool = True) -> ParameterGenerator.Group:
            """Add a subgroup and return it."""
            group = self.gen.Group(self.gen, name, type, state, len(self.gen._groups()), self.id)
            self.groups.append(group)
            return group

        def add(
            self,
            name: str,
            paramtype: str,
            level: int,
            description: str,
            default: Value | None = None,
            min: Value | None = None,
            max: Value | None = None,
            edit_method: str = "",
        ) -> None:
            """Add a parameter; ``level`` is the bit mask passed to the server's callback when the parameter changes.

            Raise Exception for an invalid name or limits on a str or bool parameter, TypeError if a value has the wrong type.
            """
            if paramtype in (str_t, bool_t) and (max is not None or min is not None):
                raise Exception(f"Max or min specified for {name}, which is of '{paramtype}' type")
            check_name(name)
            srcfile, srcline = _source_line()
            param: Entry = {
                "name": name,
                "type": paramtype,
                "default": default,
                "level": level,
                "description": description,
                "min": min,
                "max": max,
                "srcline": srcline,
                "srcfile": srcfile,
                "edit_method": edit_method,
            }
            gen = self.gen
            gen.fill_type(param)
            gen.check_type_fill_default(param, "default", gen.defval[paramtype])
            gen.check_type_fill_default(param, "max", gen.maxval[paramtype])
            gen.check_type_fill_default(param, "min", gen.minval[paramtype])
            self.parameters.append(param)

        def get_parameters(self) -> list[Entry]:
            """Return the parameters in this group and in all its subgroups."""
            return [*self.parameters, *(each for group in self.groups for each in group.get_parameters())]

        def get_parents(self) -> list[str]:
            """Return the names of this group's ancestors, outermost first, then its own name."""
            above = self.get_group(self.parent).get_parents() if self.id else []
            return [*above, self.name]

        def get_field(self) -> str:
            """Return the name of the C++ member variable for this group."""
            *above, name = self.get_parents()
            return "::".join([*map(str.upper, above), name.lower()])

        def get_class(self, parent: bool = False) -> str:
            """Return the name of this group's C++ class, or of the enclosing class if ``parent`` is true."""
            names = [name.upper() for name in self.get_parents()]
            return "::".join(names[:-1] if parent else names)

        def to_dict(self) -> dict[str, object]:
            """Return this group's description for the generated module."""
            return {
                "name": self.name,
                "type": self.type,
                "state": self.state,
                "cstate": "true" if self.state else "false",
                "id": self.id,
                "parent": self.parent,
                "parameters": self.parameters,
                "groups": [group.to_dict() for group in self.groups],
                "srcline": self.srcline,
                "srcfile": self.srcfile,
                "class": self.get_class(),
                "parentclass": self.get_class(parent=True),
                "parentname": self.get_group(self.parent).name,
                "field": self.get_field(),
                "upper": self.name.upper(),
                "lower": self.name.lower() if self.id else "groups",
            }

    def __init__(self) -> None:
        """Read the output folders from the command line. Raise SystemExit if they are missing."""
        self.group = self.Group(self, "Default", "", True, 0, 0)
        self.constants: list[Entry] = []
        if len(sys.argv) < 5:
            raise SystemExit(_USAGE)
        self.dynconfpath, self.binary_dir, self.cpp_gen_dir, self.py_gen_dir = sys.argv[1:5]

    def _groups(self) -> dict[int, ParameterGenerator.Group]:
        """Return the groups keyed by ID.

        Create the dict here, because ddynamic_reconfigure_python's subclass does not call __init__.
        """
        groups: dict[int, ParameterGenerator.Group] = self.__dict__.setdefault("_groups_by_id", {})
        return groups

    def pytype(self, drtype: str) -> type[Value]:
        """Return the Python type for a parameter type. Raise KeyError if the type is unknown."""
        return _PYTHON_TYPES[drtype]

    def check_type(self, param: Entry, field: _ValueKey) -> None:
        """Raise TypeError if a value does not have the parameter's type. Convert an int to a float for a double."""
        value, wanted = param[field], self.pytype(param["type"])
        if type(value) is not wanted and (wanted is not float or type(value) is not int):
            raise TypeError(f"'{param['name']}' has type {param['type']}, but {field} is {value!r}")
        param[field] = float(value) if type(value) is int and wanted is float else value

    def fill_type(self, param: Entry) -> None:
        """Add the C++ types to a parameter or constant. Raise TypeError if its type is unknown."""
        if param["type"] not in _CPP_TYPES:
            raise TypeError(
                f"'{param['name']}' has type {param['type']!r}: a type is {', '.join(_CPP_TYPES)}"
            )
        param["ctype"] = _CPP_TYPES[param["type"]]
        param["cconsttype"] = _CPP_CONSTANTS[param["type"]]

    def check_type_fill_default(self, param: Entry, field: _ValueKey, default: Value) -> None:
        """Replace None with ``default``; check any other value with :meth:`check_type`."""
        if param[field] is None:
            param[field] = default
        else:
            self.check_type(param, field)

    def const(self, name: str, type: str, value: Value, descr: str) -> Entry:
        """Add a constant ``NAME_name`` to the module, and return it for use in ``enum``.

        Raise Exception for an invalid description, TypeError if the value does not have the type ``type``.
        """
        srcfile, srcline = _source_line()
        constant: Entry = {
            "name": name,
            "type": type,
            "value": value,
            "srcline": srcline,
            "srcfile": srcfile,
            "description": descr,
        }
        check_description(descr)
        self.fill_type(constant)
        self.check_type(constant, "value")
        self.constants.append(constant)
        return constant

    def enum(self, constants: Sequence[Entry], description: str) -> str:
        """Return the ``edit_method`` for a parameter that accepts only these constants.

        Raise Exception if the constants have different types, or the description is invalid.
        """
        if len({constant["type"] for constant in constants}) != 1:
            raise Exception("Inconsistent types in enum!")
        check_description(description)
        return repr({"enum": constants, "enum_description": description})

    def add(
        self,
        name: str,
        paramtype: str,
        level: int,
        description: str,
        default: Value | None = None,
        min: Value | None = None,
        max: Value | None = None,
        edit_method: str = "",
    ) -> None:
        """Add a parameter to the root group; see ``Group.add``."""
        self.group.add(name, paramtype, level, description, default, min, max, edit_method)

    def add_group(self, name: str, type: str = "", state: bool = True) -> ParameterGenerator.Group:
        """Add a group to the root group and return it."""
        return self.group.add_group(name, type, state)

    def generate(self, pkgname: str, nodename: str, name: str) -> None:
        """Write NAMEConfig.py and its documentation, for a .cfg file named ``name``."""
        self.pkgname, self.nodename, self.name = pkgname, nodename, name
        self.msgname = f"{name}Config"
        print(f"Generating reconfiguration files for {name} in {pkgname}")

        documents = Path(self.binary_dir) / "docs"
        for path, text in (
            (documents / f"{self.msgname}.dox", generated.parameters_document(self.group)),
            (documents / f"{self.msgname}.wikidoc", generated.wiki_document(self.group)),
            (
                documents / f"{self.msgname}-usage.dox",
                generated.usage_document(self.group, pkgname, nodename),
            ),
            (Path(self.py_gen_dir) / "cfg" / f"{self.msgname}.py", self._module()),
        ):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        (Path(self.py_gen_dir) / "cfg" / "__init__.py").touch()

    def _module(self) -> str:
        return generated.python_module(self.pkgname, self.name, self.group.to_dict(), self.constants)


def _source_line() -> tuple[str, int]:
    """Return the .cfg file's name and the line that is running, to be recorded in a parameter's description."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename == __file__:
        frame = frame.f_back
    return Path(frame.f_code.co_filename).name, frame.f_lineno
