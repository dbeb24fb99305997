"""Loads launch files into a LaunchSpec. Reads files, and runs the commands in ``<param command=...>``, but no nodes.

Source: http://wiki.ros.org/roslaunch/XML.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from minirospy.base import names
from minirospy.base.errors import LaunchError
from minirospy.base.suggestions import nearest
from minirospy.ros.roslaunch.launcher.document import Tag, parse_document
from minirospy.ros.roslaunch.launcher.files import (
    hidden_hint,
    near_files,
    read_bytes,
    read_launch_file,
    wrong_substitution,
)
from minirospy.ros.roslaunch.launcher.parameters import param_value, rosparam_values
from minirospy.ros.roslaunch.launcher.spec import (
    ArgDoc,
    LaunchSpec,
    MachineSpec,
    NodeSpec,
    ParameterCommand,
    TestSpec,
)
from minirospy.ros.roslaunch.launcher.substitution import Substitution
from minirospy.workspace.packages import Packages

__all__ = [
    "STDIN",
    "LaunchSource",
    "Problems",
    "load_files",
    "load_sources",
    "load_text",
]

STDIN = "<stdin>"
_MAX_INCLUDE_DEPTH = 50
# Maximum number of files per launch:
# in a chain of 26 files, each including the next one twice, 67,108,863 files would be read.
MAX_INCLUDES = 10_000

Problems = list[LaunchError]


class _TooManyIncludesError(LaunchError):
    """Raised if a launch includes more than the maximum number of files."""


class LaunchSource(NamedTuple):
    """A launch file, its content (None: read the file) and the values of its args."""

    file: str
    text: bytes | None
    args: Mapping[str, str]


@dataclass(frozen=True)
class _Scope:
    """The settings that a tag inherits from enclosing tags. ``private`` holds parameters set for all following nodes.

    ``machine`` is the default machine. Unlike other settings, it still applies after the end of the group or include that
    declares it.
    """

    namespace: str = "/"
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    private: tuple[tuple[str, object], ...] = ()
    machine: str = ""


@dataclass
class _Args:
    """The values of a file's args: ``given`` by name, or ``passed`` by an including file with ``pass_all_args``."""

    given: dict[str, str]
    passed: dict[str, str] = field(default_factory=dict)
    declared: set[str] = field(default_factory=set)
    hands_on_all: bool = False


def load_files(
    files: list[str], args: Mapping[str, str], packages: Packages, environ: Mapping[str, str] | None = None
) -> LaunchSpec:
    """Load launch files in order with the command line's ``args``. Raise LaunchError if a file is invalid."""
    return load_sources([LaunchSource(file, None, args) for file in files], packages, environ)


def load_text(
    text: str, args: Mapping[str, str], packages: Packages, environ: Mapping[str, str] | None = None
) -> LaunchSpec:
    """Load one launch file from a string, for example from stdin. Raise LaunchError if the text is invalid."""
    return load_sources([LaunchSource(STDIN, text.encode(), args)], packages, environ)


def load_sources(
    sources: Sequence[LaunchSource],
    packages: Packages,
    environ: Mapping[str, str] | None = None,
    problems: Problems | None = None,
    spec: LaunchSpec | None = None,
) -> LaunchSpec:
    """Load launch files in order. Raise LaunchError on an error, or append all errors to ``problems`` if it is given.

    If ``spec`` is given, add the content to it, without checking that its nodes' names are unique.
    """
    is_checked = spec is None
    spec = LaunchSpec() if spec is None else spec
    anonymous: dict[str, str] = {}
    used: set[str] = set()
    environ = os.environ if environ is None else environ

    for file, text, args in sources:
        substitution = Substitution(packages, environ, file, dict(args), anonymous, used)
        reader = _File(spec, substitution, _Args(dict(args)), 0, problems)
        try:
            reader.read(read_launch_file(file) if text is None else text, _Scope())
        except LaunchError as error:
            reader.report(error)

    for name in used:
        # Treat a used arg as declared, so that roslaunch does not warn if the command line sets it.
        spec.args.setdefault(name, ArgDoc(name, None, None))

    if is_checked:
        _check_names(spec, problems)
    return spec


def _check_names(spec: LaunchSpec, problems: Problems | None) -> None:
    seen: dict[str, NodeSpec] = {}
    # A <test> and a node may share a name; they conflict only if the test's program registers under that name.
    for node in spec.nodes:
        other = seen.setdefault(node.name, node)
        if other is not node:
            error = LaunchError(
                node.file,
                node.line,
                f"roslaunch file contains multiple nodes named [{node.name}] "
                f"(the other one: {other.file}:{other.line})",
            )
            if problems is None:
                raise error
            problems.append(error)


class _File:
    """Reads a file into the shared spec. Errors are appended to ``problems``, or raised if it is None."""

    def __init__(
        self,
        spec: LaunchSpec,
        substitution: Substitution,
        args: _Args,
        depth: int,
        problems: Problems | None,
    ) -> None:
        self._spec = spec
        self._file = substitution.file
        self._substitution = substitution
        self._args = args
        self._depth = depth
        self._problems = problems

        self._tags: dict[str, Callable[[Tag, _Scope], _Scope]] = {
            "arg": self._arg,
            "param": self._param,
            "rosparam": self._rosparam,
            "node": self._node,
            "test": self._test,
            "remap": self._remap,
            "env": self._env,
            "group": self._group,
            "include": self._include,
            "machine": self._machine,
            "master": self._master,
        }

    def read(self, text: bytes, scope: _Scope) -> _Scope:
        """Read the file; return the scope at its end. Raise LaunchError on an error unless errors are collected."""
        path = str(Path(self._file).resolve()) if self._file != STDIN else self._file
        self._spec.add_file(path, self._file)
        root = Tag(parse_document(text, self._file), self._file, self._substitution)
        self._warn_of_attributes(root)
        if root.has("deprecated"):
            self._spec.add_warning(root.error(f"DEPRECATED: {root.element.attributes['deprecated']}"))
        for tag in root.children():
            scope = self._read(tag, scope)
        return scope

    def report(self, error: LaunchError) -> None:
        """Raise an error, or append it to ``problems`` if errors are collected."""
        if self._problems is None:
            raise error
        self._problems.append(error)

    def _read(self, tag: Tag, scope: _Scope, allowed: tuple[str, ...] | None = None) -> _Scope:
        """Read a tag; return the scope for the tags that follow."""
        reader = self._tags.get(tag.name)
        if reader is None or (allowed is not None and tag.name not in allowed):
            near = [] if reader else nearest(tag.name, allowed or self._tags)
            hint = f": did you mean <{near[0]}>?" if near else ""
            where = "" if allowed is None else " here"
            text = f"unrecognized tag {tag.name}"
            if allowed is not None:
                text = f"WARN: unrecognized '{tag.name}' child tag in the parent tag element"
            self._spec.add_warning(tag.error(f"unrecognized tag <{tag.name}>{where}{hint}"), text)
            return scope
        self._warn_of_attributes(tag)
        try:
            if tag.name == "arg" and not self._depth:
                # Treat the arg as declared even if the tag's `if` is false: see load_sources().
                self._substitution.used.add(tag.element.attributes.get("name", ""))
            return reader(tag, scope) if tag.applies() else scope
        except _TooManyIncludesError:
            # Abort loading: otherwise every open file would report the error for each of its includes.
            raise
        except LaunchError as error:
            self.report(error)
            return scope

    # --- args, groups, includes and the settings of a scope

    def _arg(self, tag: Tag, scope: _Scope) -> _Scope:
        name, value, default = _arg_texts(tag)
        args, values = self._args, self._substitution.args
        if name in args.declared:
            raise tag.error(f"arg '{name}' has already been declared")
        args.declared.add(name)

        if not self._depth and value is None:
            self._spec.args[name] = ArgDoc(name, default, tag.element.attributes.get("doc"))
        if value is not None:
            if name in args.given and not args.hands_on_all:
                raise tag.error(f"cannot override arg '{name}', which has already been set")
            values[name] = value
        elif name in args.given or name in args.passed:
            values[name] = args.given.get(name, args.passed.get(name, ""))
        elif default is not None:
            values[name] = default
        elif self._depth:
            self._substitution.unset[name] = f"requires the '{name}' arg to be set: give it in the <include>"
        else:
            self._substitution.unset[name] = f"requires the '{name}' arg to be set: add {name}:=VALUE"
        return scope

    def _group(self, tag: Tag, scope: _Scope) -> _Scope:
        inner = self._below(tag, scope)
        self._clear(tag, inner)
        # An arg declared in a group is valid only inside that group.
        declared, args = set(self._args.declared), dict(self._substitution.args)
        for child in tag.children():
            inner = self._read(child, inner)
        self._args.declared, self._substitution.args = declared, args
        return replace(scope, machine=inner.machine)

    def _include(self, tag: Tag, scope: _Scope) -> _Scope:
        file = tag.required("file")
        if self._depth >= _MAX_INCLUDE_DEPTH:
            raise tag.error(
                f"includes are nested deeper than {_MAX_INCLUDE_DEPTH}: does a file include itself?"
            )

        if len(self._spec.includes) >= MAX_INCLUDES:
            raise _TooManyIncludesError(
                self._file,
                tag.line,
                f"more than {MAX_INCLUDES} files are included: do files include others twice?",
            )

        inner = self._below(tag, scope)
        self._clear(tag, inner)
        hands_on_all = tag.flag("pass_all_args")
        passed = dict(self._substitution.args) if hands_on_all else {}
        given: dict[str, str] = {}
        for child in tag.children():
            if child.name != "arg":
                inner = self._read(child, inner, ("arg", "env"))
            elif child.applies():
                self._warn_of_attributes(child)
                name, value, default = _arg_texts(child)
                if name in given and not hands_on_all:
                    raise child.error(f"arg '{name}' has already been declared")
                if value is None:
                    # A passed value takes precedence over a default.
                    value = given.get(name, passed.get(name, default))
                if value is None:
                    raise child.error(f'<arg name="{name}"> of an <include> needs a value')
                given[name] = value
        self._spec.includes.append((self._file, file))
        try:
            text = read_bytes(file)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            hint = (
                near_files(file) + hidden_hint(file, self._substitution.packages) + wrong_substitution(file)
            )
            raise tag.error(f"cannot include [{file}]: {why}{hint}") from None

        substitution = replace(self._substitution, file=file, args={**passed, **given}, unset={})
        args = _Args(given, passed, hands_on_all=hands_on_all)
        inner = _File(self._spec, substitution, args, self._depth + 1, self._problems).read(text, inner)
        self._spec.end_include(file)
        unused = set(given) - args.declared
        if unused and not hands_on_all:
            raise tag.error(f"unused args [{', '.join(sorted(unused))}] for include of [{file}]")
        return replace(scope, machine=inner.machine)

    def _remap(self, tag: Tag, scope: _Scope) -> _Scope:
        pair = (tag.required("from"), tag.required("to"))
        for key, name in zip(("from", "to"), pair, strict=True):
            if not names.is_legal_name(names.canonicalize(name)):
                raise tag.error(f"remap {key} [{name}] is not a valid ROS name")
        # If a name is remapped twice, the later remapping wins and moves to the end.
        others = tuple(remap for remap in scope.remaps if remap[0] != pair[0])
        return replace(scope, remaps=(*others, pair))

    def _env(self, tag: Tag, scope: _Scope) -> _Scope:
        pair = (tag.required("name"), tag.required("value", may_be_empty=True))
        return replace(scope, env=(*scope.env, pair))

    def _machine(self, tag: Tag, scope: _Scope) -> _Scope:
        for key in ("ros-root", "ros-package-path", "ros-ip", "ros-host-name"):
            if tag.has(key):
                raise tag.error(
                    f"<machine>: '{key}' is not supported since ROS Fuerte: use env-loader instead"
                )
        for child in tag.children():
            if child.name == "env":
                raise child.error(
                    "<machine>: <env> tag is not supported since ROS Fuerte: use env-loader instead"
                )
            self._spec.add_warning(child.error(f"unrecognized '{child.name}' tag in <machine> tag"))

        timeout = tag.number("timeout", 10.0)
        if timeout <= 0:
            raise tag.error(f"'timeout' must be a positive number: [{timeout:g}]")
        machine = MachineSpec(
            name=tag.required("name"),
            address=tag.required("address"),
            env_loader=tag.optional("env-loader") or "",
            user=tag.optional("user") or "",
            password=tag.optional("password") or "",
            ssh_port=tag.number_or_empty("ssh-port", 22, int),
            timeout=timeout,
            file=self._file,
            line=tag.line,
        )

        self._spec.add_machine(machine)
        default = (tag.optional("default") or "false").lower()
        if default not in ("false", "true", "never"):
            raise tag.error(f"default must be one of 'false', 'true', 'never', not '{default}'")
        return replace(scope, machine=machine.name) if default == "true" else scope

    def _master(self, tag: Tag, scope: _Scope) -> _Scope:
        self._spec.add_warning(tag.error("ignoring defunct <master /> tag"))
        return scope

    # --- parameters

    def _param(self, tag: Tag, scope: _Scope) -> _Scope:
        name = tag.required("name")
        value = self._value(tag)
        if names.is_private(name):
            return replace(scope, private=(*scope.private, (name[1:].lstrip("/"), value)))
        self._set(tag, names.join(scope.namespace, name), value, self._file)
        return scope

    def _value(self, tag: Tag) -> object:
        if tag.has("command"):
            self._spec.runs_command(tag.required("command", may_be_empty=True))
        return param_value(tag, self._spec.add_warning)

    def _param_of_node(self, tag: Tag, full_name: str) -> None:
        """Set a ``<param>`` inside a ``<node>`` as a private parameter, even if its name starts with a slash or tilde."""
        self._set(tag, f"{full_name}/{tag.required('name').lstrip('~/')}", self._value(tag))

    def _rosparam(self, tag: Tag, scope: _Scope) -> _Scope:
        command = tag.choice("command", ("load", "dump", "delete"))
        ns, param = tag.optional("ns") or "", tag.optional("param") or ""
        namespace = names.join(scope.namespace, ns)

        if command == "load":
            is_private = names.is_private(ns) or (not ns and names.is_private(param))
            if not is_private:
                for name, value in rosparam_values(tag, namespace, param):
                    self._set(tag, name, value)
                return scope
            values = rosparam_values(tag, "/" + ns.lstrip("~/"), param.lstrip("~/"))
            return replace(scope, private=(*scope.private, *((name[1:], value) for name, value in values)))

        name = names.canonicalize(names.join(namespace, param)) or "/"
        file = tag.optional("file")
        if command == "delete" and file is not None:
            raise tag.error("<rosparam>: 'file' attribute is invalid with 'delete' command")
        if command == "delete" and name == "/":
            raise tag.error(
                '<rosparam command="delete"> needs a param or ns: it would delete every parameter'
            )
        if command == "dump" and not file:
            raise tag.error('<rosparam command="dump"> needs a file')
        self._spec.add_command(ParameterCommand(name, file))
        return scope

    def _set(self, tag: Tag, name: str, value: object, file: str | None = None) -> None:
        self._spec.add_param(names.canonicalize(name), value, tag.error, file)

    def _warn_of_attributes(self, tag: Tag) -> None:
        for error, key in tag.unknown_attributes():
            self._spec.add_warning(error, f"[{self._file}] unknown <{tag.name}> attribute '{key}'")

    # --- nodes

    def _node(self, tag: Tag, scope: _Scope) -> _Scope:
        name = tag.required("name")
        if not names.is_legal_base_name(name):
            if "/" in name:
                raise tag.error(f"node name cannot contain a namespace: [{name}]: use ns")
            if names.is_private(name):
                raise tag.error(f"cannot turn [{name}] into a global name")
            self._spec.add_warning(tag.error(f"illegal <node> name '{name}': letters, digits and _ alone"))
        self._spec.add_node(self._process(tag, scope, name))
        return scope

    def _test(self, tag: Tag, scope: _Scope) -> _Scope:
        for key in ("output", "respawn"):
            if tag.has(key):
                raise tag.error(f"<test> tags cannot have '{key}' attribute")
        test_name = tag.required("test-name", may_be_empty=True)
        name = tag.optional("name") or test_name
        if "/" in name:
            raise tag.error(f"<test> name [{name}] cannot contain a namespace: use ns")
        if names.is_private(name):
            raise tag.error(f"cannot turn [{name}] into a global name")
        node = self._process(tag, scope, name)
        seconds = tag.number_or_empty("time-limit", 60.0, float)
        if seconds <= 0:
            raise tag.error("'time-limit' must be a positive number of seconds")
        self._spec.add_test(TestSpec(test_name, node, seconds, tag.number_or_empty("retry", 0, int)))
        return scope

    def _process(self, tag: Tag, scope: _Scope, name: str) -> NodeSpec:
        """Read the attributes common to ``<node>`` and ``<test>``."""
        required, respawn = tag.flag("required"), tag.flag("respawn")
        if required and respawn:
            raise tag.error(f"node [{name}]: respawn and required cannot both be set to true")

        scope = self._below(tag, scope)
        full_name = names.canonicalize(f"{scope.namespace}/{name}")
        if tag.flag("clear_params"):
            if not name:
                raise tag.error("<node> tag must have a 'name' attribute to use 'clear_params' attribute")
            self._spec.add_clear(full_name)
        inner = replace(scope, namespace=full_name + "/", private=())
        params: list[Tag] = []
        for child in tag.children():
            if child.name == "param":
                params.append(child)
            else:
                inner = self._read(child, inner, ("param", "rosparam", "remap", "env"))
        # As in ROS, a <param> takes precedence over a <rosparam>, both in the node and in an enclosing group.
        for private, value in scope.private:
            self._set(tag, f"{full_name}/{private}", value)
        for child in params:
            self._read_own_param(child, full_name)
        for private, value in inner.private:
            self._set(tag, f"{full_name}/{private}", value)
        return NodeSpec(
            name=full_name if name else full_name.rstrip("/") + "/",
            package=tag.required("pkg"),
            type=tag.required("type"),
            args=tag.optional("args") or "",
            output=tag.choice("output", ("log", "screen")) if tag.has("output") else "",
            respawn=respawn,
            respawn_delay=tag.number("respawn_delay", 0.0),
            required=required,
            cwd=_folder(tag),
            launch_prefix=tag.optional("launch-prefix") or "",
            machine=tag.optional("machine") or scope.machine,
            remaps=inner.remaps,
            env=inner.env,
            file=self._file,
            line=tag.line,
        )

    def _read_own_param(self, tag: Tag, full_name: str) -> None:
        self._warn_of_attributes(tag)
        try:
            if tag.applies():
                self._param_of_node(tag, full_name)
        except LaunchError as error:
            self.report(error)

    # --- helpers

    def _below(self, tag: Tag, scope: _Scope) -> _Scope:
        namespace = tag.optional("ns")
        if namespace is None:
            return scope
        if not namespace:
            raise tag.error(f"<{tag.name}> tag has an empty 'ns' attribute")
        if names.is_private(namespace):
            raise tag.error(f"cannot turn [{namespace}] into a global name")
        return replace(scope, namespace=names.join(scope.namespace, namespace))

    def _clear(self, tag: Tag, inner: _Scope) -> None:
        if not tag.flag("clear_params"):
            return
        if not tag.has("ns") or inner.namespace.strip("/") == "":
            raise tag.error("'ns' attribute must be set in order to use 'clear_params'")
        self._spec.add_clear(names.canonicalize(inner.namespace))


def _folder(tag: Tag) -> str:
    """Return a node's ``cwd``, or "" if it is not set. Raise LaunchError if it is invalid."""
    text = tag.optional("cwd")
    if text is None:
        return ""
    # ROS also accepts this value in lower case.
    return "ROS_HOME" if text == "ros_home" else tag.choice("cwd", ("ROS_HOME", "node"))


def _arg_texts(tag: Tag) -> tuple[str, str | None, str | None]:
    """Return an ``<arg>``'s name, value and default. Raise LaunchError without a name, or with both value and default."""
    name, value, default = tag.required("name"), tag.optional("value"), tag.optional("default")
    if value is not None and default is not None:
        raise tag.error(f"<arg> tag must have one and only one of value/default: arg [{name}]")
    return name, value, default
