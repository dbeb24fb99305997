"""Mutation testing: insert small faults into pure modules, the journal and access, and check that a test detects each one.

    make mutants                                  # all rooms
    python tests/mutants.py journal --show        # one, with the source of every survivor
    python tests/mutants.py wire --sample 200     # some of its mutants, always the same ones

One pytest session collects the tests and runs them once, recording which lines each test executes. Then every mutant gets
a fork of that session: the code of the mutated function is replaced in place, and the tests that execute the mutated line
run, the quickest first, until one fails. So a mutant costs milliseconds and the working tree is never touched. Messages
of exceptions and of log lines are not mutated, nor are annotations and docstrings.

Needs os.fork: Linux and macOS.
"""

from __future__ import annotations

import argparse
import ast
import copy
import gc
import importlib
import os
import random
import signal
import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType, FunctionType, ModuleType
from typing import Any

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "minirospy"


@dataclass(frozen=True)
class Room:
    """Mutated modules, and the tests that should detect the mutants."""

    modules: Sequence[str]
    tests: Sequence[str]
    deselected: Sequence[str] = ()
    """Parts of the names of excluded tests, which start other processes that would run the original code."""


ROOMS = {
    "graph": Room(
        ["core/graph/*.py"],
        [
            "tests/core/graph",
            "tests/runtime/master/test_master.py",
            "tests/runtime/master/test_master_journal.py",
            "tests/ros/actionlib/test_statuses.py",
        ],
        ["two_hundred_nodes", "double_start"],
    ),
    "wire": Room(["core/wire/*.py"], ["tests/core/wire"]),
    "journal": Room(
        ["runtime/master/journal.py", "base/private_files.py"],
        [
            "tests/runtime/master/test_journal.py",
            "tests/base/test_private_files.py",
        ],
        ["roscore"],
    ),
    "clients": Room(
        [
            "web/access.py",
            "web/foxglove/parsing.py",
            "web/json_text.py",
            "web/rosbridge/protocol.py",
            "web/tokens.py",
            "web/server/account.py",
            "web/server/admission.py",
            "web/server/frames.py",
            "web/server/jobs.py",
            "web/server/liveness.py",
            "web/server/queue.py",
            "web/server/rate.py",
            "web/server/turns.py",
            "web/server/websocket.py",
            "web/dashboard/codes.py",
            "core/images/sizes.py",
        ],
        [
            "tests/web/test_access.py",
            "tests/web/test_account.py",
            "tests/web/test_admission.py",
            "tests/web/test_connection_rate.py",
            "tests/web/test_foxglove_protocol.py",
            "tests/web/test_json_text.py",
            "tests/web/test_rosbridge_protocol.py",
            "tests/web/test_send_queue.py",
            "tests/web/test_served_files.py",
            "tests/web/test_tokens.py",
            "tests/web/test_turns.py",
            "tests/web/test_websocket.py",
            "tests/web/dashboard/test_codes.py",
            "tests/core/images/test_sizes.py",
        ],
    ),
}

_SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.FloorDiv,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}

_IMPOSSIBLE = 42  # exit status of a fork that could not install its mutant

Mutate = Callable[[ast.AST], ast.AST | None]
"""Returns a node's replacement, or None if the node itself was changed."""


# --- finding mutants


@dataclass(frozen=True)
class Mutant:
    """One fault: ``number`` is the position of the mutated node in a walk of the module."""

    module: str
    number: int
    line: int
    what: str
    apply: Mutate

    def __str__(self) -> str:
        return f"{self.module.replace('.', '/')}.py:{self.line}: {self.what}"


def find_mutants(module: str, tree: ast.Module) -> Iterator[Mutant]:
    """Yield every fault for a module."""
    skipped: set[int] = set()
    for number, node in enumerate(ast.walk(tree)):
        if id(node) in skipped:
            continue
        skipped |= {id(each) for part in _untested(node) for each in ast.walk(part)}
        if id(node) in skipped:
            continue
        for what, apply in _faults(node):
            line: int = getattr(node, "lineno", 0)
            yield Mutant(module, number, line, what, apply)


def _untested(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of a node that are not mutated."""
    match node:
        case ast.arg(annotation=ast.expr() as annotation) | ast.AnnAssign(annotation=annotation):
            yield annotation
        case ast.Raise(exc=ast.Call() as call):
            yield from (each for each in ast.walk(call) if _is_text(each))
        case ast.Call(func=ast.Attribute(value=ast.Name(id="_log"))):
            yield node
        case ast.Call(func=ast.Name(id="getattr"), args=[ast.Name(id="os"), *_]):
            # Skip code for some systems only.
            yield node
        case ast.Call(func=ast.Name(id="TypeVar")):
            yield node
        case ast.Compare(left=ast.Attribute(value=ast.Name(id="sys"), attr="platform")):
            # Skip the name of another system, which is not this one's with any other text either.
            yield from node.comparators
        case ast.Expr(value=ast.Constant()) | ast.ImportFrom() | ast.Import():
            yield node
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            yield node
        case ast.If(test=ast.Compare(left=ast.Attribute(value=ast.Name(id="sys"), attr="platform"))):
            # Skip code for another system.
            yield from (node.test, *(node.body if sys.platform != "win32" else node.orelse))
        case ast.Assign(targets=[ast.Name(id="__all__")]):
            yield node
        case ast.ClassDef():
            # A class body's statements run once, before there is a mutant.
            yield from (each for each in node.body if not isinstance(each, ast.FunctionDef))
            yield from (*node.bases, *node.decorator_list, *(each.value for each in node.keywords))

    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        yield from (*node.decorator_list, *node.args.defaults, *filter(None, node.args.kw_defaults))
        if node.returns:
            yield node.returns


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _faults(node: ast.AST) -> Iterator[tuple[str, Mutate]]:
    match node:
        case ast.If(test=ast.Compare(left=ast.Attribute(value=ast.Name(id="sys"), attr="platform"))):
            return
        case ast.Compare(ops=operators):
            for place, operator in enumerate(operators):
                yield _swap(operator, lambda new, place=place: _in_list("ops", place, new))
        case ast.BoolOp(op=operator) | ast.BinOp(op=operator) | ast.AugAssign(op=operator):
            if type(operator) in _SWAPS:
                yield _swap(operator, lambda new: _field("op", new))
        case ast.UnaryOp(op=ast.Not()):
            yield "not removed", lambda node: node.operand  # type: ignore[attr-defined]
        case ast.If() | ast.While() | ast.IfExp():
            yield "condition negated", _negate
        case ast.Constant(value=bool() as value):
            yield f"{value} -> {not value}", _field("value", not value)
        case ast.Constant(value=int() | float() as number):
            yield f"{number} -> {number + 1}", _field("value", number + 1)
        case ast.Constant(value=str() | bytes() as text):
            changed = text + "X" if isinstance(text, str) else text + b"X"
            yield f"{text!r} -> {changed!r}", _field("value", changed)
        case ast.Return(value=ast.expr() as found) if not _is_none(found):
            yield "returns None", _field("value", ast.Constant(None))
        case ast.Expr(value=ast.Call() | ast.Await() | ast.Yield() | ast.YieldFrom()):
            yield "statement removed", lambda node: ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]) | ast.Delete() | ast.Raise():
            yield "statement removed", lambda node: ast.Pass()
        case ast.Break() | ast.Continue():
            other = ast.Continue if isinstance(node, ast.Break) else ast.Break
            yield "break and continue swapped", lambda node: other()

    if isinstance(node, ast.AugAssign):
        yield "statement removed", lambda node: ast.Pass()


def _swap(operator: ast.AST, put: Callable[[ast.AST], Mutate]) -> tuple[str, Mutate]:
    new = _SWAPS[type(operator)]()
    return f"{type(operator).__name__} -> {type(new).__name__}", put(new)


def _field(name: str, value: Any) -> Mutate:
    return lambda node: setattr(node, name, value)


def _in_list(name: str, place: int, value: Any) -> Mutate:
    return lambda node: getattr(node, name).__setitem__(place, value)


def _negate(node: Any) -> None:
    node.test = ast.UnaryOp(ast.Not(), node.test)


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


# --- putting one into the running program


def install(
    mutant: Mutant, tree: ast.Module, path: str, functions: dict[tuple[int, str], list[FunctionType]]
) -> bool:
    """Change the running module's code; return whether that was possible. ``functions`` contains them by line and name.

    It is not possible if the fault removes a function's only use of an outer variable, such as super().
    """
    mutated = copy.deepcopy(tree)
    node = next(each for number, each in enumerate(ast.walk(mutated)) if number == mutant.number)
    new = mutant.apply(node)
    if new is not None:
        _Replace(node, ast.copy_location(new, node)).visit(mutated)
    ast.fix_missing_locations(mutated)

    module = compile(mutated, path, "exec")
    is_installed = True
    for code in _codes(module):
        for function in functions.get((code.co_firstlineno, code.co_name), ()):
            if function.__code__.co_freevars == code.co_freevars:
                function.__code__ = code
            else:
                is_installed = False
    _clear_caches(mutant.module)
    statement = next((each for each in mutated.body if _holds(each, mutant.line)), None)
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        _assign(sys.modules[f"minirospy.{mutant.module}"], statement, path)
    return is_installed


def _clear_caches(module: str) -> None:
    for each in vars(sys.modules[f"minirospy.{module}"]).values():
        if hasattr(each, "cache_clear"):
            each.cache_clear()


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old = old
        self._new = new

    def visit(self, node: ast.AST) -> Any:
        return self._new if node is self._old else self.generic_visit(node)


def _codes(code: CodeType) -> Iterator[CodeType]:
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield each
            yield from _codes(each)


def _holds(statement: ast.stmt, line: int) -> bool:
    return statement.lineno <= line <= (statement.end_lineno or statement.lineno)


def _assign(module: ModuleType, statement: ast.stmt, path: str) -> None:
    """Run a module's mutated assignment, and set its value in the modules that import the name."""
    before = dict(vars(module))
    exec(compile(ast.Module([statement], []), path, "exec"), vars(module))
    for name, old in before.items():
        if vars(module)[name] is old:
            continue
        for other in list(sys.modules.values()):
            if (
                getattr(other, "__name__", "").startswith(("minirospy.", "tests."))
                and vars(other).get(name) is old
            ):
                setattr(other, name, vars(module)[name])


# --- running


class Mutants:
    """A pytest plugin that takes over the session after collection."""

    def __init__(self, room: Room, options: argparse.Namespace) -> None:
        self._room = room
        self._options = options
        self._trees = {}
        for pattern in room.modules:
            for path in sorted(PACKAGE.glob(pattern)):
                name = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
                self._trees[name] = (str(path), ast.parse(path.read_bytes()))
        self._files = {path: name for name, (path, _) in self._trees.items()}
        self._lines: dict[tuple[str, int], set[int]] = defaultdict(set)
        self._seconds: dict[int, float] = {}
        self.survivors: list[Mutant] = []
        self.results: Counter[str] = Counter()

    def pytest_sessionstart(self) -> None:
        """Reduce the number of generated examples, and use the same examples for each mutant.

        The tests' own profile is loaded by now.
        """
        settings.register_profile(
            "mutants", settings(), max_examples=30, derandomize=True, database=None, deadline=None
        )
        settings.load_profile("mutants")

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Exclude the tests that start other processes."""
        items[:] = [item for item in items if not any(part in item.name for part in self._room.deselected)]

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the tests once, then run the relevant ones for each mutant."""
        for index, item in enumerate(session.items):
            self._record(session, index, item)
        session._setupstate.teardown_exact(None)
        if session.testsfailed:
            raise pytest.UsageError("the tests have to pass before mutants are worth trying")

        mutants = [mutant for name, (_, tree) in self._trees.items() for mutant in find_mutants(name, tree)]
        if self._options.sample:
            chosen = random.Random(1).sample(range(len(mutants)), min(self._options.sample, len(mutants)))
            mutants = [mutants[index] for index in sorted(chosen)]
        self._run_all(session, mutants)
        return True

    def _record(self, session: pytest.Session, index: int, item: pytest.Item) -> None:
        """Run a test and record the lines that it executes."""
        files, lines = self._files, self._lines

        def on_call(frame: FrameType, event: str, arg: object) -> Any:
            name = files.get(frame.f_code.co_filename)
            if name is None:
                return None

            def on_line(frame: FrameType, event: str, arg: object) -> Any:
                lines[name, frame.f_lineno].add(index)
                return on_line

            return on_line

        # Clear the caches, because cached results are computed only in the first test.
        for name in self._trees:
            importlib.import_module(f"minirospy.{name}")
            _clear_caches(name)
        start_time = time.perf_counter()
        threading.settrace(on_call)
        sys.settrace(on_call)
        try:
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        finally:
            sys.settrace(None)
            threading.settrace(None)  # type: ignore[arg-type]
        self._seconds[index] = time.perf_counter() - start_time

    def _run_all(self, session: pytest.Session, mutants: Sequence[Mutant]) -> None:
        functions = self._functions()
        waiting = list(reversed(mutants))
        running: dict[int, tuple[Mutant, float]] = {}
        gc.freeze()
        while waiting or running:
            while waiting and len(running) < self._options.jobs:
                mutant = waiting.pop()
                tests = self._tests(mutant, session)
                if not tests:
                    self._count(mutant, "no test executes it")
                    continue
                pid = os.fork()
                if not pid:
                    self._child(session, mutant, tests, functions)
                limit = 10.0 + 5 * sum(self._seconds[each] for each in tests)
                running[pid] = (mutant, time.monotonic() + limit)
            self._reap(running)

    def _reap(self, running: dict[int, tuple[Mutant, float]]) -> None:
        for pid, (mutant, end) in list(running.items()):
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                del running[pid]
                if os.waitstatus_to_exitcode(status) != _IMPOSSIBLE:
                    self._count(mutant, "killed" if status else "survived")
            elif time.monotonic() > end:
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)
                del running[pid]
                self._count(mutant, "killed by the time limit")
        time.sleep(0.002)

    def _count(self, mutant: Mutant, result: str) -> None:
        self.results[result] += 1
        if result in ("survived", "no test executes it"):
            self.survivors.append(mutant)
            print(f"{result}: {mutant}", flush=True)
            if self._options.show:
                path = Path(self._trees[mutant.module][0])
                print(
                    f"    {path.read_text(encoding='utf-8').splitlines()[mutant.line - 1].strip()}",
                    flush=True,
                )

    def _functions(self) -> dict[str, dict[tuple[int, str], list[FunctionType]]]:
        found: dict[str, dict[tuple[int, str], list[FunctionType]]] = {
            name: defaultdict(list) for name in self._trees
        }
        for name in self._trees:
            importlib.import_module(f"minirospy.{name}")
        for each in gc.get_objects():
            if type(each) is FunctionType and each.__code__.co_filename in self._files:
                code = each.__code__
                found[self._files[code.co_filename]][code.co_firstlineno, code.co_name].append(each)
        return found

    def _tests(self, mutant: Mutant, session: pytest.Session) -> list[int]:
        """Return the tests that execute the statement, the quickest first; for code run at import, all of the module's."""
        tree = self._trees[mutant.module][1]
        statement: ast.AST = tree
        inside = None

        while True:
            children = [
                each
                for each in ast.iter_child_nodes(statement)
                if isinstance(each, ast.stmt | ast.excepthandler | ast.match_case)
            ]
            within = [each for each in children if _span(each)[0] <= mutant.line <= _span(each)[1]]
            if not within:
                break
            statement = within[0]
            if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
                inside = statement

        if inside is None:
            found = {
                index
                for (name, _), indexes in self._lines.items()
                if name == mutant.module
                for index in indexes
            }
            # A test of a documented limit executes no line of the module.
            tested = "_" + mutant.module.rpartition(".")[2]
            found |= {index for index, item in enumerate(session.items) if item.path.stem.endswith(tested)}
        else:
            first, last = _span(statement)
            if isinstance(statement, ast.If | ast.While | ast.For | ast.With):
                # The lines before the body: a condition may be longer than one line.
                last = max(mutant.line, statement.body[0].lineno - 1)
            elif isinstance(statement, ast.Try | ast.Match):
                last = mutant.line
            found = {
                index
                for line in range(first, last + 1)
                for index in self._lines.get((mutant.module, line), ())
            }

        return sorted(found, key=self._seconds.__getitem__)

    def _child(
        self,
        session: pytest.Session,
        mutant: Mutant,
        tests: Sequence[int],
        functions: dict[str, dict[tuple[int, str], list[FunctionType]]],
    ) -> None:
        """Run the tests with the mutant installed; exit with 1 as soon as one fails."""
        status = 1

        try:
            nowhere = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(nowhere, stream)
            path, tree = self._trees[mutant.module]
            # The reporter's stream is a copy of stdout.
            session.config.pluginmanager.unregister(name="terminalreporter")
            if not install(mutant, tree, path, functions[mutant.module]):
                status = _IMPOSSIBLE
                return

            for index in tests:
                item = session.items[index]
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
                if session.testsfailed:
                    break
            else:
                status = 0
        finally:
            os._exit(status)


def _span(node: ast.AST) -> tuple[int, int]:
    """Return the first and last line of a statement, handler or case."""
    if isinstance(node, ast.match_case):
        return node.pattern.lineno, node.body[-1].end_lineno or 0
    return getattr(node, "lineno", 0), getattr(node, "end_lineno", 0) or 0


def run_room(name: str, options: argparse.Namespace) -> float:
    """Try the mutants of a room; return the percentage that was killed."""
    room, start_time = ROOMS[name], time.monotonic()
    plugin = Mutants(room, options)
    # Use importlib mode; rewriting asserts only helps people who read the output.
    arguments = [
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:xdist",
        "-p",
        "no:randomly",
        "--timeout=0",
        "--assert=plain",
    ]
    status = pytest.main([*arguments, "-W", "ignore::ResourceWarning", *room.tests], plugins=[plugin])
    if status not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        sys.exit(f"{name}: pytest ended with {status!r}")
    total, survived = sum(plugin.results.values()), len(plugin.survivors)
    killed = total - survived
    share = 100 * killed / total if total else 100.0
    counts = ", ".join(f"{count} {result}" for result, count in sorted(plugin.results.items()))
    print(
        f"{name}: {killed} of {total} mutants killed, {share:.1f} % ({counts}; {time.monotonic() - start_time:.0f} s)"
    )
    return share


def main(argv: Sequence[str] | None = None) -> int:
    """Try all mutants; return 1 if a room is below the goal."""
    parser = argparse.ArgumentParser(description="Mutation testing of the pure rooms and the journal.")
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"{', '.join(ROOMS)} (default: all)")
    parser.add_argument("--sample", type=int, default=0, metavar="N", help="try only N mutants of each room")
    parser.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 2) // 2), metavar="N")
    parser.add_argument("--goal", type=float, default=95.0, metavar="PERCENT")
    parser.add_argument("--show", action="store_true", help="print the source line of each survivor")
    options = parser.parse_args(argv)
    unknown = set(options.rooms) - set(ROOMS)
    if unknown:
        parser.error(f"no room is called {', '.join(sorted(unknown))}")
    if not hasattr(os, "fork"):
        parser.error("mutants need os.fork, which this system does not have")

    os.chdir(ROOT)
    shares = []
    for name in options.rooms or ROOMS:
        # Run each room in its own process, because pytest runs once per process.
        pid = os.fork()
        if not pid:
            share = run_room(name, options)
            sys.stdout.flush()
            os._exit(0 if share >= options.goal else 1)
        shares.append(os.waitpid(pid, 0)[1])
    return int(any(shares))


if __name__ == "__main__":
    sys.exit(main())
