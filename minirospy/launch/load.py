"""Launch files -> LaunchSpec. Reads files, runs nothing but ``<param command=...>``.

Source: http://wiki.ros.org/roslaunch/XML.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.parsers import expat

from minirospy import names
from minirospy.errors import LaunchError, NotFoundError
from minirospy.launch.spec import ArgDoc, LaunchSpec, NodeSpec
from minirospy.launch.substitution import Substitution, SubstitutionError, convert
from minirospy.workspace.packages import Packages

__all__ = ["describe_args", "load_files", "load_text"]

_DEEPEST_INCLUDE = 50


@dataclass
class _Element:
    tag: str
    attributes: dict[str, str]
    line: int
    children: list[_Element] = field(default_factory=list)
    text: str = ""


@dataclass(frozen=True)
class _Scope:
    """What a tag inherits from those around it."""

    namespace: str = "/"
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    private: tuple[tuple[str, Any], ...] = ()


def load_files(
    files: list[str], args: Mapping[str, str], packages: Packages, environ: Mapping[str, str] | None = None
) -> LaunchSpec:
    """Load launch files one after another, with ``args`` as on the command line. Raises LaunchError."""
    spec = LaunchSpec()
    for file in files:
        try:
            text = Path(file).read_bytes()
        except OSError as error:
            raise LaunchError(file, 0, f"cannot be read: {error.strerror}") from error
        _load(spec, text, file, args, packages, environ)
    _finish(spec)
    return spec


def load_text(
    text: str, args: Mapping[str, str], packages: Packages, environ: Mapping[str, str] | None = None
) -> LaunchSpec:
    """Load one launch file from its text, as from standard input. Raises LaunchError."""
    spec = LaunchSpec()
    _load(spec, text.encode(), "<stdin>", args, packages, environ)
    _finish(spec)
    return spec


def describe_args(file: str) -> list[ArgDoc]:
    """The arguments that a file declares, without loading what it includes. Raises LaunchError."""
    try:
        root = _parse(Path(file).read_bytes(), file)
    except OSError as error:
        raise LaunchError(file, 0, f"cannot be read: {error.strerror}") from error
    return [
        ArgDoc(attributes["name"], attributes.get("default"), attributes.get("doc"))
        for attributes in (element.attributes for element in root.children if element.tag == "arg")
        if "name" in attributes and "value" not in attributes
    ]


def _load(
    spec: LaunchSpec,
    text: bytes,
    file: str,
    args: Mapping[str, str],
    packages: Packages,
    environ: Mapping[str, str] | None,
) -> None:
    substitution = Substitution(packages, os.environ if environ is None else environ, file)
    _File(spec, file, substitution, dict(args), 0).read(_parse(text, file), _Scope())


def _finish(spec: LaunchSpec) -> None:
    seen: dict[str, NodeSpec] = {}
    for node in spec.nodes:
        other = seen.setdefault(node.name, node)
        if other is not node:
            raise LaunchError(
                node.file,
                node.line,
                f"roslaunch file contains multiple nodes named [{node.name}] "
                f"(the other one: {other.file}:{other.line})",
            )


def _parse(text: bytes, file: str) -> _Element:
    """The element tree, with line numbers. Raises LaunchError."""
    parser = expat.ParserCreate()
    stack: list[_Element] = []
    roots: list[_Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = _Element(tag, attributes, parser.CurrentLineNumber)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def end(_: str) -> None:
        stack.pop()

    def data(part: str) -> None:
        if stack:
            stack[-1].text += part

    def refuse(*_: object) -> None:
        raise LaunchError(file, parser.CurrentLineNumber, "a launch file has no document type")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = data, refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise LaunchError(
            file, error.lineno, f"Invalid roslaunch XML syntax: {expat.ErrorString(error.code)}"
        ) from None
    if roots[0].tag != "launch":
        raise LaunchError(file, roots[0].line, f"the outermost tag is <{roots[0].tag}>, it must be <launch>")
    return roots[0]


class _File:
    """Reads one file into the spec that all share."""

    def __init__(
        self, spec: LaunchSpec, file: str, substitution: Substitution, given: dict[str, str], depth: int
    ) -> None:
        self._spec = spec
        self._file = file
        self._substitution = substitution
        self._given = given
        self._depth = depth
        self._declared: set[str] = set()
        self._tags: dict[str, Callable[[_Element, _Scope], _Scope]] = {
            "arg": self._arg,
            "param": self._param,
            "rosparam": self._rosparam,
            "node": self._node,
            "remap": self._remap,
            "env": self._env,
            "group": self._group,
            "include": self._include,
            "machine": self._machine,
            "test": lambda element, scope: scope,
            "master": lambda element, scope: scope,
        }

    def read(self, root: _Element, scope: _Scope) -> None:
        self._spec.files.append(str(Path(self._file).resolve()) if self._file != "<stdin>" else self._file)
        for element in root.children:
            scope = self._read(element, scope)
        unused = set(self._given) - self._declared
        if unused and self._depth:
            raise LaunchError(
                self._file,
                root.line,
                f"unused args [{', '.join(sorted(unused))}] for include of [{self._file}]",
            )

    def _read(self, element: _Element, scope: _Scope) -> _Scope:
        """Read a tag; the scope for those after it."""
        reader = self._tags.get(element.tag)
        if reader is None:
            known = NotFoundError("tag", element.tag, self._tags)
            raise self._error(element, f"unknown tag <{element.tag}>: {known}")
        try:
            return reader(element, scope) if self._applies(element) else scope
        except (SubstitutionError, NotFoundError) as error:
            raise self._error(element, str(error)) from error

    # --- tags

    def _arg(self, element: _Element, scope: _Scope) -> _Scope:
        name = self._required(element, "name")
        value, default = self._optional(element, "value"), self._optional(element, "default")
        if value is not None and default is not None:
            raise self._error(element, f"<arg> tag must have one and only one of value/default: arg [{name}]")
        if name in self._declared:
            raise self._error(element, f"arg '{name}' has already been declared")
        self._declared.add(name)
        if value is not None:
            if name in self._given:
                raise self._error(element, f"cannot override arg '{name}', which has already been set")
            self._substitution.args[name] = value
        elif name in self._given:
            self._substitution.args[name] = self._given[name]
        elif default is not None:
            self._substitution.args[name] = default
        else:
            raise self._error(element, f"required arg '{name}' is not set: add {name}:=VALUE")
        if not self._depth and value is None:
            self._spec.args[name] = ArgDoc(name, default, element.attributes.get("doc"))
        return scope

    def _param(self, element: _Element, scope: _Scope) -> _Scope:
        name = self._required(element, "name")
        value = self._param_value(element)
        if names.is_private(name):
            # Above a node: a private parameter of every node that follows in this scope.
            return replace(scope, private=(*scope.private, (name[1:].lstrip("/"), value)))
        self._set(names.join(scope.namespace, name), value)
        return scope

    def _param_value(self, element: _Element) -> Any:
        ways = [way for way in ("value", "textfile", "binfile", "command") if way in element.attributes]
        if len(ways) != 1:
            raise self._error(
                element, "<param> tag must have one and only one of value, textfile, binfile, command"
            )
        text = self._required(element, ways[0], may_be_empty=True)
        type_ = self._optional(element, "type") or "auto"
        try:
            if ways[0] == "value":
                return convert(text.strip() if type_ not in ("str", "string") else text, type_)
            if ways[0] == "textfile":
                return convert(Path(text).read_text(encoding="utf-8"), "str" if type_ == "auto" else type_)
            if ways[0] == "binfile":
                return Path(text).read_bytes()
            return convert(self._output_of(text, element), "str" if type_ == "auto" else type_)
        except ValueError as error:
            raise self._error(element, f"param [{element.attributes['name']}]: {error}") from None
        except OSError as error:
            raise self._error(element, f"cannot read [{text}]: {error.strerror}") from None

    def _output_of(self, command: str, element: _Element) -> str:
        done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
        if done.returncode:
            why = done.stderr.strip().splitlines()[-1:] or ["no output"]
            raise self._error(element, f"command [{command}] ended with status {done.returncode}: {why[0]}")
        return done.stdout

    def _rosparam(self, element: _Element, scope: _Scope) -> _Scope:
        command = self._optional(element, "command") or "load"
        namespace = names.join(scope.namespace, self._optional(element, "ns") or "")
        param = self._optional(element, "param")
        if command == "delete":
            self._spec.clear.append(names.canonicalize(names.join(namespace, param or "")))
            return scope
        if command == "dump":
            raise self._error(element, '<rosparam command="dump"> is not supported: use `rosparam dump FILE`')
        if command != "load":
            raise self._error(element, f"<rosparam> has no command [{command}]: there are load and delete")
        for key, value in (
            self._yaml(element).items() if param is None else [(param, self._yaml(element, param))]
        ):
            if names.is_private(param or ""):
                scope = replace(scope, private=(*scope.private, (key[1:], value)))
            else:
                self._set(names.join(namespace, str(key)), value)
        return scope

    def _yaml(self, element: _Element, param: str | None = None) -> Any:
        file = self._optional(element, "file")
        text = element.text
        if file is not None:
            try:
                text = Path(file).read_text(encoding="utf-8")
            except OSError as error:
                raise self._error(element, f"cannot read [{file}]: {error.strerror}") from None
        if (self._optional(element, "subst_value") or "false").lower() in ("true", "1"):
            text = self._substitution.apply(text)
        try:
            value = convert(text, "yaml")
        except ValueError as error:
            raise self._error(element, f"<rosparam> {file or ''}: {error}") from None
        if param is None:
            if value is None:
                return {}
            if not isinstance(value, dict):
                raise self._error(element, "<rosparam> without a param attribute must hold a YAML dictionary")
        return value

    def _node(self, element: _Element, scope: _Scope) -> _Scope:
        name = self._required(element, "name")
        if not names.is_legal_base_name(name):
            raise self._error(
                element, f"<node> name [{name}] is not legal: letters, digits and _, no namespace"
            )
        if self._optional(element, "machine") not in (None, "", "localhost"):
            raise self._error(element, "nodes on other machines are not supported yet: leave machine out")
        namespace = names.join(scope.namespace, self._optional(element, "ns") or "")
        full_name = names.canonicalize(f"{namespace}/{name}")
        if self._flag(element, "clear_params"):
            self._spec.clear.append(full_name)
        inner = replace(scope, namespace=full_name + "/")
        for private, value in scope.private:
            self._set(f"{full_name}/{private}", value)
        for child in element.children:
            if child.tag not in ("param", "rosparam", "remap", "env"):
                raise self._error(child, f"<{child.tag}> has no place in a <node>")
            inner = self._read(child, inner)
        for private, value in inner.private[len(scope.private) :]:
            self._set(f"{full_name}/{private}", value)
        output = self._optional(element, "output") or "log"
        if output not in ("log", "screen"):
            raise self._error(element, f"output is 'log' or 'screen', not '{output}'")
        required, respawn = self._flag(element, "required"), self._flag(element, "respawn")
        if required and respawn:
            raise self._error(element, f"node [{name}]: respawn and required cannot both be set")
        try:
            delay = float(self._optional(element, "respawn_delay") or 0)
        except ValueError:
            raise self._error(element, "respawn_delay is a number of seconds") from None
        self._spec.nodes.append(
            NodeSpec(
                name=full_name,
                package=self._required(element, "pkg"),
                type=self._required(element, "type"),
                args=" ".join((self._optional(element, "args") or "").split()),
                output=output,
                respawn=respawn,
                respawn_delay=delay,
                required=required,
                cwd=self._optional(element, "cwd") or "ROS_HOME",
                launch_prefix=self._optional(element, "launch-prefix") or "",
                remaps=inner.remaps,
                env=inner.env,
                file=self._file,
                line=element.line,
            )
        )
        return scope

    def _remap(self, element: _Element, scope: _Scope) -> _Scope:
        pair = (self._required(element, "from"), self._required(element, "to"))
        return replace(scope, remaps=(*scope.remaps, pair))

    def _env(self, element: _Element, scope: _Scope) -> _Scope:
        pair = (self._required(element, "name"), self._required(element, "value", may_be_empty=True))
        return replace(scope, env=(*scope.env, pair))

    def _group(self, element: _Element, scope: _Scope) -> _Scope:
        inner = self._below(element, scope)
        if self._flag(element, "clear_params"):
            if inner.namespace == "/":
                raise self._error(element, "'ns' must be set for 'clear_params' to be used")
            self._spec.clear.append(names.canonicalize(inner.namespace))
        for child in element.children:
            inner = self._read(child, inner)
        return scope

    def _include(self, element: _Element, scope: _Scope) -> _Scope:
        file = self._required(element, "file")
        if self._depth >= _DEEPEST_INCLUDE:
            raise self._error(
                element, f"includes are nested deeper than {_DEEPEST_INCLUDE}: does a file include itself?"
            )
        inner = self._below(element, scope)
        pass_all = self._flag(element, "pass_all_args")
        given = dict(self._substitution.args) if pass_all else {}
        for child in element.children:
            if child.tag == "env":
                inner = self._read(child, inner)
                continue
            if child.tag != "arg":
                raise self._error(child, f"<{child.tag}> has no place in an <include>")
            if not self._applies(child):
                continue
            name = self._required(child, "name")
            value = self._optional(child, "value")
            value = self._optional(child, "default") if value is None else value
            if value is None:
                raise self._error(child, f'<arg name="{name}"> of an <include> needs a value')
            given[name] = value
        try:
            text = Path(file).read_bytes()
        except OSError as error:
            raise self._error(element, f"cannot include [{file}]: {error.strerror}") from None
        substitution = replace(self._substitution, file=file, args={})
        reader = _File(self._spec, file, substitution, given, self._depth + 1)
        root = _parse(text, file)
        if pass_all:
            reader._declared.update(given)
            reader._declared -= {e.attributes.get("name", "") for e in root.children if e.tag == "arg"}
        reader.read(root, inner)
        return scope

    def _machine(self, element: _Element, scope: _Scope) -> _Scope:
        if self._optional(element, "address") in (None, "localhost", "127.0.0.1"):
            return scope
        raise self._error(element, "other machines are not supported yet: start the nodes there by hand")

    # --- helpers

    def _below(self, element: _Element, scope: _Scope) -> _Scope:
        namespace = self._optional(element, "ns")
        return replace(scope, namespace=names.join(scope.namespace, namespace)) if namespace else scope

    def _set(self, name: str, value: Any) -> None:
        """Set a parameter; a dictionary sets its leaves, and leaves its siblings alone."""
        if isinstance(value, dict) and value:
            for key, inner in value.items():
                self._set(f"{name}/{key}", inner)
        else:
            self._spec.params[names.canonicalize(name)] = value

    def _applies(self, element: _Element) -> bool:
        both = {key for key in ("if", "unless") if key in element.attributes}
        if len(both) == 2:
            raise self._error(element, "cannot set both 'if' and 'unless' on the same tag")
        for key in both:
            return self._flag(element, key) == (key == "if")
        return True

    def _flag(self, element: _Element, key: str) -> bool:
        text = (self._optional(element, key) or "false").strip().lower()
        if text not in ("true", "1", "false", "0"):
            raise self._error(element, f"{key} is 'true' or 'false', not '{text}'")
        return text in ("true", "1")

    def _optional(self, element: _Element, key: str) -> str | None:
        text = element.attributes.get(key)
        try:
            return None if text is None else self._substitution.apply(text)
        except (SubstitutionError, NotFoundError) as error:
            raise self._error(element, str(error)) from error

    def _required(self, element: _Element, key: str, *, may_be_empty: bool = False) -> str:
        text = self._optional(element, key)
        if text is None or (not text and not may_be_empty):
            raise self._error(element, f"<{element.tag}> tag is missing required attribute: '{key}'")
        return text

    def _error(self, element: _Element, text: str) -> LaunchError:
        return LaunchError(self._file, element.line, text)
