"""Build a workspace: from the packages in ``src``, generate messages and setup files in ``devel``.

No compiler runs, and no files are copied: Python programs stay in the source folders, and ``devel`` refers to them.
Unchanged parts are not regenerated. Source: http://wiki.ros.org/catkin/workspaces.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from minirospy.base.errors import BuildError, DefinitionError, NotFoundError
from minirospy.base.suggestions import did_you_mean
from minirospy.core.idl.load import Catalogue, compile_package, read_definition, top_module, write_if_changed
from minirospy.core.idl.spec import MessageSpec
from minirospy.workspace.build_order import build_order
from minirospy.workspace.dependencies import CircularDependencyError
from minirospy.workspace.manifest import naming_warning
from minirospy.workspace.options import make_options
from minirospy.workspace.packages import (
    DIST_PACKAGES,
    OF_THE_WORKSHOP,
    Packages,
    built_in_roots,
    crawl,
    is_python,
    package_name,
)
from minirospy.workspace.plan import Plan, read_plan
from minirospy.workspace.python_setup import PythonSetup, read_python_setup
from minirospy.workspace.setup_files import SetUp, setup_files
from minirospy.workspace.stand_ins import StandIns, find_stand_ins
from minirospy.workspace.unlisted import with_unlisted

__all__ = [
    "PROVIDED",
    "Workspace",
    "build",
    "find_workspace",
    "own_set_up",
    "read_plans",
    "stand_in_files",
    "write_set_up",
]

PROVIDED = frozenset(
    """
    actionlib angles camera_calibration_parsers camera_info_manager camera_info_manager_py catkin class_loader
    cmake_modules cpp_common cv_bridge diagnostic_updater dynamic_reconfigure eigen_conversions gencpp geneus
    genlisp genmsg gennodejs genpy image_geometry image_transport interactive_markers joint_state_publisher
    kdl_parser laser_geometry message_filters message_generation message_runtime nodelet pluginlib python_qt_binding
    resource_retriever robot_state_publisher rosbag rosbuild rosbash rosconsole rosgraph roslang roslaunch roslib
    roslint rosmaster rosmsg rosnode rosout rospack rosparam rospy rosservice rostest rostime rostopic rosunit
    roswtf rqt_gui rqt_gui_py rviz tf tf2 tf2_eigen tf2_geometry_msgs tf2_kdl tf2_py tf2_ros tf2_sensor_msgs
    tf_conversions urdf urdfdom xacro xmlrpcpp
    """.split()  # noqa: SIM905
)
"""Packages without messages on which Python packages depend. Either minirospy provides their functions, or they need a
compiler.
"""

_KINDS = {".msg": "message", ".srv": "service", ".action": "action"}
_RELAY = """# Made by catkin_make: {name!r} is in {folder!r}; what was generated for it is here.

import sys

if {root!r} not in sys.path:
    sys.path.insert(1, {root!r})
__path__.append({folder!r})  # what is generated is found first, as in ROS
"""
_RELAY_RUN = """__file__ = {file!r}
with open(__file__, "rb") as _source:
    exec(compile(_source.read(), __file__, "exec"))
"""


# Use the interpreter that has rospy, unless its path is too long or has white space, which shebang lines do not allow.
_SHEBANG = (
    sys.executable
    if sys.executable and not re.search(r"\s|.{120}", sys.executable)
    else "/usr/bin/env python3"
)
_PROGRAM = """#!{python}
# Made by catkin_make: {name!r} is in {folder!r}.
import sys

sys.path[0] = {folder!r}
"""


class Workspace(NamedTuple):
    """The folders that belong to a workspace."""

    root: Path
    source: Path
    build: Path
    devel: Path
    install: Path

    @classmethod
    def at(cls, root: Path) -> Workspace:
        """Return the workspace with root folder ``root`` and the default folder layout."""
        return cls(root, *(root / name for name in ("src", "build", "devel", "install")))


def find_workspace(start: Path) -> Path:
    """Return the workspace that contains ``start``.

    This is the nearest folder that was built before, else the nearest whose ``src`` contains ``start``. Raise BuildError if
    there is no such folder.
    """
    start = start.resolve()
    for folder in (start, *start.parents):
        if (folder / ".catkin_workspace").is_file() or (folder / ".catkin_tools").is_dir():
            return folder
    for folder in (start, *start.parents):
        # A folder such as ~ may have an unrelated src folder; its other subfolders then do not belong to a workspace.
        is_inside = start == folder or start.is_relative_to(folder / "src")
        if is_inside and (folder / "src").is_dir() and not (folder / "package.xml").is_file():
            return folder
    raise BuildError(str(start), 0, "not in a workspace: make one with `mkdir src`, and put packages into it")


def read_plans(source: Path, variables: Mapping[str, str] | None = None) -> list[Plan]:
    """Return the plans for all packages below a folder, in build order.

    ``variables`` are passed to read_plan; packages in CATKIN_BLACKLIST_PACKAGES are skipped. Raise BuildError if a
    package name is duplicated or dependencies form a cycle, or ManifestError or DefinitionError if a file is invalid.
    """
    plans: dict[str, Plan] = {}
    left_out = (variables or {}).get("CATKIN_BLACKLIST_PACKAGES", "").split(";")
    for folder in crawl(source):
        if package_name(folder) in left_out:
            continue
        plan = read_plan(folder, variables)
        if plan.name in plans:
            raise BuildError(
                str(folder / "package.xml"),
                0,
                f"two packages are called [{plan.name}]: here and in "
                f"{plans[plan.name].folder}; an empty file CATKIN_IGNORE in one of the folders hides it",
            )
        plans[plan.name] = plan
    return _ordered(with_unlisted(plans))


def _ordered(plans: Mapping[str, Plan]) -> list[Plan]:
    """Sort plans topologically, so that each follows its build dependencies. Raise BuildError if there is a cycle."""
    also = {name: {*plan.message_depends, *(need for need, _ in plan.needs)} for name, plan in plans.items()}
    try:
        names = build_order({name: plan.manifest for name, plan in plans.items()}, also)
    except CircularDependencyError as error:
        raise BuildError(
            str(plans[error.circle[0]].folder / "package.xml"),
            0,
            f"packages depend on each other in a circle: {' -> '.join(error.circle)}",
        ) from error
    return [plans[name] for name in names]


class Report(NamedTuple):
    """The result of building one package.

    ``made`` describes the generated parts, and is empty if nothing has changed. ``stand_ins`` lists the names of
    minirospy's programs and modules that replace compiled ones.
    """

    plan: Plan
    made: str
    changed: bool
    warnings: tuple[str, ...]
    stand_ins: str = ""


def build(
    workspace: Workspace,
    plans: Sequence[Plan],
    outside: Packages,
    chosen: Collection[str] | None = None,
    report: Callable[[Report], None] = lambda each: None,
) -> None:
    """Build packages (``chosen``, or all) into the devel folder. Call ``report`` with the result of each.

    ``outside``: the packages in other workspaces and in minirospy. Raise BuildError if a package cannot be built, or
    DefinitionError if a definition is invalid.
    """
    builder = _Builder(workspace, plans, outside)
    for plan in plans:
        if chosen is None or plan.name in chosen:
            report(builder.package(plan))
    if chosen is None:
        builder.remove_gone()


def own_set_up(prefix: Path, sources: tuple[Path, ...], parents: tuple[Path, ...]) -> SetUp:
    """Return the data for the setup files of a workspace that uses this minirospy installation."""
    return SetUp(
        prefix=prefix,
        sources=sources,
        parents=parents,
        programs=Path(sys.executable).parent,
        share=built_in_roots(),
        functions=Path(__file__).parent / "shell",
    )


def write_set_up(
    prefix: Path, sources: tuple[Path, ...], environment: Mapping[str, str] = os.environ
) -> None:
    """Write a workspace's setup files. The workspaces sourced in ``environment`` become its parents.

    If no workspace is sourced, the parents of the previous build remain.
    """
    # A workspace is not its own parent, even if its setup file is sourced.
    own = {
        prefix,
        *(prefix.parent / name for name in ("devel", "install", "devel_isolated", "install_isolated")),
    }
    sourced = map(Path, filter(None, environment.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)))
    parents = [path for path in sourced if path not in own and (path / ".catkin").is_file()]
    note = prefix / ".minirospy_parents"
    if not parents and note.is_file():
        parents = [Path(line) for line in note.read_text(encoding="utf-8").splitlines()]
    write_if_changed(note, "".join(f"{path}\n" for path in parents))
    for name, text in setup_files(own_set_up(prefix, sources, tuple(parents))).items():
        path = prefix / name
        if write_if_changed(path, text) and name == "env.sh":
            path.chmod(0o755)


class _Builder:
    """Builds the packages of a workspace, one after the other."""

    def __init__(self, workspace: Workspace, plans: Sequence[Plan], outside: Packages) -> None:
        self._workspace = workspace
        self._plans = {plan.name: plan for plan in plans}
        self._modules = workspace.devel / DIST_PACKAGES
        self._stamps = workspace.build / "minirospy"
        self._folders = {**outside.folders(), **{plan.name: plan.folder for plan in plans}}
        self._catalogue = Catalogue(self._folders, {plan.name: plan.definitions for plan in plans})
        # Generated code depends on the definitions, the CMakeLists.txt files, and the code of the message compiler.
        ours = Path(__file__).parents[1]
        compiler = [
            *(ours / "core" / "idl").glob("*.py"),
            *(ours / "ros" / "dynamic_reconfigure" / "dynamic_reconfigure").glob("*.py"),
        ]
        made_of = [path for plan in plans for path in (*plan.definitions, *_option_files(plan))]
        # A skipped package need not have a CMakeLists.txt.
        made_of += [plan.cmake_lists for plan in plans if plan.cmake_lists.is_file()]
        self._key = _key([*made_of, *compiler])

    def package(self, plan: Plan) -> Report:
        warnings = self._check_needs(plan) + plan.warnings
        stamp = self._stamps / f"{plan.name}.json"
        setup = read_python_setup(plan.folder) if plan.has_setup else None
        warnings += setup.warnings if setup else ()

        stand_ins = find_stand_ins(plan)
        relays = {
            **_relays(setup, self._workspace.devel),
            **_programs(plan, setup, self._workspace.devel),
            **stand_in_files(plan, stand_ins, self._workspace.devel),
        }
        changed = [path for path, text in relays.items() if write_if_changed(path, text)]
        for path in changed:
            if path.suffix != ".py" or path.read_bytes().startswith(b"#!"):
                path.chmod(0o755)

        outputs = list(relays)
        if plan.definitions or plan.options:
            before = _read_stamp(stamp)
            if (
                before.get("key") == self._key
                and before.get("outside_key") == self._outside_key(before.get("outside", []))
                and all(map(os.path.exists, before["outputs"]))
                and not changed
            ):
                return Report(plan, "", False, warnings, stand_ins.names())
            warnings += self._check_messages(plan)
            modules = self._compile(plan, bool(setup and plan.name in setup.packages))
            changed += [path for path, text in modules.items() if write_if_changed(path, text)]
            outputs += modules
        if plan.options:
            options, more = make_options(plan, self._workspace.devel)
            outputs += options
            changed += options
            warnings += more

        outside = sorted(self._closure(plan.message_depends) - self._plans.keys())
        self._finish(stamp, outputs, outside)
        return Report(plan, _counts(plan, setup), bool(changed), warnings, stand_ins.names())

    def remove_gone(self) -> None:
        """Remove the build outputs of packages that are no longer in the workspace."""
        for stamp in self._stamps.glob("*.json"):
            if stamp.stem not in self._plans:
                self._remove(_read_stamp(stamp).get("outputs", []))
                stamp.unlink()

    def _compile(self, plan: Plan, has_relay: bool) -> dict[Path, str]:
        """Return the modules generated for a package, as a dict from file to source text.

        Raise DefinitionError if a definition is invalid, or BuildError if a type is missing.
        """
        folder = self._modules / plan.name
        try:
            texts = compile_package(self._catalogue, plan.name)
        except DefinitionError as error:
            # If a type contains itself, the error names the type, so replace the name with the type's file.
            files = {f"{plan.name}/{path.stem}": str(path) for path in plan.definitions}
            raise DefinitionError(files.get(error.file, error.file), error.line, error.text) from error
        modules = {folder / name: text for name, text in texts.items()}
        if not has_relay:
            modules[folder / "__init__.py"] = top_module(plan.name, texts)
        return modules

    def _outside_key(self, names: Iterable[str]) -> str:
        """Return a fingerprint of the messages in other workspaces; it changes if one of their files does."""
        known = [name for name in names if name in self._folders]
        return _key(
            path
            for name in known
            for kind in ("msg", "action")
            for path in self._catalogue.files(name, kind).values()
        )

    def _finish(self, stamp: Path, outputs: Iterable[Path], outside: list[str]) -> None:
        """Record the outputs, and remove outputs of the previous build that are no longer generated."""
        names = sorted(map(str, outputs))
        self._remove(set(_read_stamp(stamp).get("outputs", [])) - set(names))
        note = {
            "key": self._key,
            "outputs": names,
            "outside": outside,
            "outside_key": self._outside_key(outside),
        }
        write_if_changed(stamp, json.dumps(note, indent=1))

    def _remove(self, names: Iterable[str]) -> None:
        for name in names:
            path = Path(name)
            path.unlink(missing_ok=True)
            for folder in path.parents:
                # A folder that contains only Python's cache is removed, too.
                if folder == self._modules or not folder.is_dir() or any(folder.glob("*.py")):
                    break
                for cached in folder.glob("__pycache__/*.pyc"):
                    cached.unlink()
                for empty in (folder / "__pycache__", folder):
                    if empty.is_dir() and not any(empty.iterdir()):
                        empty.rmdir()

    # --- checks

    def _check_needs(self, plan: Plan) -> tuple[str, ...]:
        """Return warnings about the package's name, and about find_package() for packages that do not exist."""
        warnings = [warning] if (warning := naming_warning(plan.name)) else []
        hidden = next((root / plan.name for root in built_in_roots() if package_name(root / plan.name)), None)
        if hidden and plan.name not in OF_THE_WORKSHOP and (hidden / "msg").is_dir() and not plan.definitions:
            warnings.append(
                f"{plan.cmake_lists.parent}: it hides the package {plan.name} in {hidden}, and has none of its messages: "
                "give yours another name"
            )
        known = self._folders.keys() | PROVIDED
        for name, line in plan.needs:
            if name not in known:
                warnings.append(
                    f"{plan.cmake_lists}:{line}: package [{name}] is not installed; going on without it"
                    + did_you_mean(name, sorted(known), 1)
                )
        return tuple(warnings)

    def _check_messages(self, plan: Plan) -> tuple[str, ...]:
        """Check that each type in a package's definitions exists, and that CMakeLists.txt declares the type's package."""
        for name in plan.message_depends:
            if name not in self._folders:
                raise BuildError(
                    str(plan.cmake_lists),
                    _line_of(plan.cmake_lists, name),
                    f"generate_messages(DEPENDENCIES {name}): no such package"
                    + did_you_mean(name, sorted(self._folders), 1),
                )

        allowed = {plan.name, *self._closure(plan.message_depends)}
        for file in plan.definitions:
            for spec in self._specs(plan, file):
                self._check_fields(file, spec, allowed)

        named = set(plan.manifest.depends())
        return tuple(
            f"{plan.manifest.path}: messages of [{plan.name}] contain types of [{name}]: add <depend>{name}</depend>"
            for name in plan.message_depends
            if name not in named
        )

    def _specs(self, plan: Plan, file: Path) -> list[MessageSpec]:
        if file.suffix == ".msg":
            return [self._catalogue.message(f"{plan.name}/{file.stem}")]
        if file.suffix == ".srv":
            service = self._catalogue.service(f"{plan.name}/{file.stem}")
            return [service.request, service.response]
        return list(self._catalogue.action(f"{plan.name}/{file.stem}").messages)

    def _check_fields(self, file: Path, spec: MessageSpec, allowed: Collection[str]) -> None:
        for field in spec.fields:
            if field.type.is_primitive:
                continue
            base = field.type.base
            package = base.partition("/")[0]
            if package not in allowed:
                raise BuildError(
                    str(file),
                    _line_of(file, field.name),
                    f"[{base}] is of package [{package}]: name it in generate_messages(DEPENDENCIES {package}) in "
                    f"CMakeLists.txt, and with <depend>{package}</depend> in package.xml",
                )
            try:
                self._catalogue.message(base)
            except NotFoundError as error:
                raise BuildError(str(file), _line_of(file, field.name), str(error)) from error

    def _closure(self, names: Iterable[str]) -> set[str]:
        """Return the packages in ``names`` and, recursively, the packages whose messages their messages contain."""
        found: set[str] = set()
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name in found or name not in self._folders:
                continue
            found.add(name)
            if name in self._plans:
                waiting += self._plans[name].message_depends
            else:
                waiting += {
                    field.type.base.partition("/")[0]
                    for message in self._catalogue.messages(name)
                    for field in message.fields
                    if not field.type.is_primitive
                }
        return found


def _option_files(plan: Plan) -> set[Path]:
    """Return a package's .cfg files, and the modules in the same folders, which the .cfg files may import."""
    folders = {path.parent for path in plan.options}
    return {*plan.options, *(module for folder in folders for module in folder.glob("*.py"))}


def _key(files: Iterable[Path]) -> str:
    """Return a fingerprint of files, made of their names, modification times and sizes."""
    import hashlib

    marks = []
    for path in sorted(files):
        status = path.stat()
        marks.append(f"{path} {status.st_mtime_ns} {status.st_size}")
    return hashlib.sha256("\n".join(marks).encode()).hexdigest()


def _read_stamp(stamp: Path) -> dict[str, Any]:
    try:
        found = json.loads(stamp.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and isinstance(found.get("outputs"), list) else {}


def _programs(plan: Plan, setup: PythonSetup | None, devel: Path) -> dict[Path, str]:
    """Return stub programs for the devel space, as {file: source}. Each runs a program in a source folder.

    These stubs put the programs from setup.py on PATH, and let real ROS run a program that is not executable itself.
    """
    places = {devel / "bin" / path.name: path for path in (setup.scripts if setup else ())}
    for rule in plan.installs:
        if rule.python and not rule.optional:
            sources = [plan.folder / name for name in rule.sources]
            places.update({devel / rule.destination / path.name: path for path in sources})
    return {place: _program(path) for place, path in places.items() if is_python(path)}


def _program(path: Path) -> str:
    """Return the source of a stub that runs the program ``path``."""
    head = _PROGRAM.format(python=_SHEBANG, name=path.name, folder=str(path.parent))
    return head + _RELAY_RUN.format(file=str(path))


def stand_in_files(plan: Plan, found: StandIns, prefix: Path) -> dict[Path, str]:
    """Return stubs that run minirospy's programs and modules in place of a package's compiled ones.

    The result is a dict from file below ``prefix`` to text.
    """
    texts = {prefix / "lib" / plan.name / name: _program(path) for name, path in found.programs.items()}
    for name, path in found.modules.items():
        end = "/__init__.py" if path.name == "__init__.py" else ".py"
        head = f"# Made by catkin_make: minirospy's {name!r} stands in for the compiled one.\n\n"
        texts[prefix / DIST_PACKAGES / (name.replace(".", "/") + end)] = head + _RELAY_RUN.format(
            file=str(path)
        )
    return texts


def _relays(setup: PythonSetup | None, devel: Path) -> dict[Path, str]:
    """Return stub modules for the devel space, as {file: source}. Each loads a module in a source folder."""
    if setup is None:
        return {}
    modules = devel / DIST_PACKAGES
    relays = {}
    for name, folder in setup.packages.items():
        text = _RELAY.format(name=name, folder=str(folder), root=str(folder.parent))
        if (folder / "__init__.py").is_file():
            text += _RELAY_RUN.format(file=str(folder / "__init__.py"))
        relays[modules / name / "__init__.py"] = text
    for name, file in setup.modules.items():
        text = f"# Made by catkin_make: {name!r} is in {str(file)!r}.\n\n"
        relays[modules / f"{name}.py"] = text + _RELAY_RUN.format(file=str(file))
    return relays


def _counts(plan: Plan, setup: PythonSetup | None) -> str:
    """Summarize the contents of a package, as in ``2 messages, 1 service, package foo``."""
    words = []
    for suffix, word in _KINDS.items():
        count = sum(path.suffix == suffix for path in plan.definitions)
        if count:
            words.append(f"{count} {word}{'' if count == 1 else 's'}")
    if plan.options:
        words.append(f"{len(plan.options)} configuration{'' if len(plan.options) == 1 else 's'}")
    if setup:
        words += [f"Python package {name}" for name in setup.packages]
        words += [f"Python module {name}" for name in setup.modules]
    return ", ".join(words)


def _line_of(file: Path, name: str) -> int:
    """Return the number of the first line in a file that contains a word, or 1 if no line does."""
    word = re.compile(rf"(?<![\w]){re.escape(name)}(?![\w])")
    for number, line in enumerate(read_definition(file).split("\n"), 1):
        if word.search(line.split("#", 1)[0]):
            return number
    return 1
