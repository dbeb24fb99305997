"""The doctor's findings on the German page: each text in its source is in the page's list of patterns."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from minirospy.base.errors import NoThreadsAtEndError
from minirospy.introspect import doctor
from minirospy.web.dashboard.files import FOLDER

SAMPLE = "/x"  # stands for a value; as a node's name, it may start a finding
COMMAND = re.compile(r"((export|unset|source) \S+|catkin_make|`rosnode cleanup`)(; (export|unset) \S+)*")
STRING = r'"(?:[^"\\\n]|\\.)*"'

# The dashboard's doctor checks no other machine.
SOURCES = {
    path.name: ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted(Path(doctor.__file__).parent.glob("*.py"))
    if path.name != "other_machine.py"
}
FUNCTIONS = {
    node.name: node
    for tree in SOURCES.values()
    for node in ast.walk(tree)
    if isinstance(node, ast.FunctionDef)
}
CONSTANTS = {
    target.id: node.value
    for tree in SOURCES.values()
    for node in tree.body
    if isinstance(node, ast.Assign)
    for target in node.targets
    if isinstance(target, ast.Name)
}

Names = dict[str, list[ast.expr]]


def patterns() -> list[re.Pattern[str]]:
    """Return the page's patterns as regular expressions."""
    source = (FOLDER / "js" / "findings.js").read_text(encoding="utf-8")
    listed = source.partition("export const TEXTS = [")[2].partition("\n];")[0]
    texts = [ast.literal_eval(each) for each in re.findall(rf"^  ({STRING}),$", listed, re.MULTILINE)]
    assert len(texts) > 100
    return [re.compile(".+".join(map(re.escape, re.split(r"\{\w+\}", each))), re.DOTALL) for each in texts]


def names_of(function: ast.FunctionDef) -> Names:
    """Return the expressions that a function assigns to each local name."""
    found: Names = {}
    for node in ast.walk(function):
        if not isinstance(node, ast.Assign):
            continue
        for target in node.targets:
            if isinstance(target, ast.Name):
                found.setdefault(target.id, []).append(node.value)
            elif isinstance(target, ast.Tuple):
                parts: Iterable[ast.expr] = ()
                if isinstance(node.value, ast.Tuple):
                    parts = node.value.elts
                elif isinstance(node.value, ast.Call) and isinstance(node.value.func, ast.Name):
                    parts = [ast.Subscript(node.value, ast.Constant(at)) for at in range(len(target.elts))]
                for each, value in zip(target.elts, parts, strict=False):
                    if isinstance(each, ast.Name):
                        found.setdefault(each.id, []).append(value)
    return found


def returned(name: str, at: int | None = None) -> set[str]:
    """Return the texts that a function of the doctor returns, or the parts of its tuples at this index."""
    function = FUNCTIONS[name]
    names = names_of(function)
    found: set[str] = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Return) and node.value is not None:
            value = node.value
            if at is None:
                found |= texts_of(value, names)
            elif isinstance(value, ast.Tuple):
                found |= texts_of(value.elts[at], names)
    return found - {""}


def texts_of(node: ast.expr, names: Names) -> set[str]:
    """Return all texts that an expression may have, with SAMPLE for what only the program knows."""
    match node:
        case ast.Constant(str(text)):
            return {text}
        case ast.JoinedStr(parts):
            return joined(texts_of(part, names) for part in parts)
        case ast.FormattedValue(value):
            return texts_of(value, names)
        case ast.BinOp(left, ast.Add(), right):
            return joined([texts_of(left, names), texts_of(right, names)])
        case ast.IfExp(_, one, other):
            return texts_of(one, names) | texts_of(other, names)
        case ast.BoolOp(_, values):
            return set().union(*(texts_of(each, names) for each in values)) - {""}
        case ast.Name(name) if name in names:
            inner = {key: value for key, value in names.items() if key != name}
            return set().union(*(texts_of(each, inner) for each in names[name]))
        case ast.Name(name) if name in CONSTANTS:
            return texts_of(CONSTANTS[name], {})
        case ast.Call(ast.Name("_definitions_differ")):
            return returned("_definitions_differ")
        case ast.Call(ast.Name("str"), [ast.Call(ast.Name("NoThreadsAtEndError"))]):
            return {str(NoThreadsAtEndError())}
        case ast.Subscript(ast.Call(ast.Name(name)), ast.Constant(int(at))) if name in FUNCTIONS:
            return returned(name, at) or {SAMPLE}
        case _:
            return {SAMPLE}


def joined(parts: Iterable[set[str]]) -> set[str]:
    return {"".join(each) for each in itertools.product(*parts)}


def found_texts() -> Iterator[str]:
    """Yield the texts and the advice of all findings that are not "ok", and the faults that are in them."""
    for function in FUNCTIONS.values():
        names = names_of(function)
        for node in ast.walk(function):
            if not isinstance(node, ast.Call):
                continue
            called = {each.id for each in ast.walk(node.func) if isinstance(each, ast.Name)}
            if called & {"problem", "warning"} and len(node.args) == 3:
                yield from texts_of(node.args[1], names)
                yield from texts_of(node.args[2], names)
            elif called == {"Trouble"}:
                yield from texts_of(node.args[1], names)
    yield from returned("_probe_service")


def test_every_finding_of_the_doctor_has_a_pattern_on_the_page() -> None:
    known = patterns()
    texts = {re.sub(rf"^{SAMPLE}: ", "", each) for each in found_texts()}
    texts = {each for each in texts if re.search("[a-z]{2}", each) and not COMMAND.fullmatch(each)}
    assert len(texts) > 100
    missing = {each for each in texts if not any(pattern.fullmatch(each) for pattern in known)}
    assert missing == set()
