"""The page's strings in two languages: each has a translation with the same values, and no translation is unused."""

from __future__ import annotations

import ast
import inspect
import re

from minirospy.ros.robot_state_publisher import joint_parameters
from minirospy.web import access
from minirospy.web.dashboard.files import FOLDER

JS = FOLDER / "js"
STRING = r"""(?:"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')"""
SOURCES = {
    path.relative_to(JS).as_posix(): path.read_text(encoding="utf-8")
    for path in sorted(JS.rglob("*.js"))
    if path.name != "german.js"
}


def german() -> dict[str, str]:
    """Return the translation table, whose strings contain only escapes that Python also has."""
    text = (JS / "german.js").read_text(encoding="utf-8")
    pairs = re.findall(rf"({STRING}):\s*({STRING})", text)
    return {ast.literal_eval(key): ast.literal_eval(value) for key, value in pairs}


def literals(text: str) -> set[str]:
    found = re.findall(r'"(?:[^"\\\n]|\\.)*"', text) + re.findall(r"'(?:[^'\\\n]|\\.)*'", text)
    return {ast.literal_eval(each) for each in found}


def test_every_text_is_in_the_table() -> None:
    table = german()
    assert len(table) > 200
    used = {
        (name, ast.literal_eval(each))
        for name, text in SOURCES.items()
        for each in re.findall(rf"\bt\(\s*({STRING})", text)
        if name != "texts.js"
    }
    assert len(used) > 80
    assert {(name, each) for name, each in used if each not in table} == set()


def test_every_translation_is_used_and_has_the_same_values() -> None:
    known = set().union(*(literals(text) for text in SOURCES.values()))
    known |= literals(
        inspect.getsource(joint_parameters)
    )  # the view Joints shows the reason if there are no joints
    known |= literals(inspect.getsource(access))  # the page shows why the server refuses it
    for text, translation in german().items():
        assert text in known, text
        assert sorted(re.findall(r"\{\w+\}", text)) == sorted(re.findall(r"\{\w+\}", translation)), text
        assert translation.strip(), text


def test_no_view_sets_a_text_without_its_translation() -> None:
    bare = {
        (name, found)
        for name, text in SOURCES.items()
        for found in re.findall(rf"setText\([^;\n]*?, ({STRING})\)", text)
        if re.search(r"[A-Za-z]{2}", found)
    } | {
        (name, found)
        for name, text in SOURCES.items()
        for call in re.findall(r"setText\(([^;]*)\);", text)
        for found in re.findall(rf"[?:]\s*({STRING})", re.sub(r"\bt\((?:[^()]|\([^()]*\))*\)", "", call))
        if re.search(r"[A-Za-z]{2} ", found) and "$" not in found
    }
    assert bare == set()


def test_every_error_of_the_codec_and_the_worker_is_in_the_table() -> None:
    thrown = {
        ast.literal_eval(each)
        for name in ("ros1.js", "paths.js", "worker.js")
        for call in re.findall(r"(?:Error|fail|reject)\(\s*(.*)", SOURCES[name])
        for each in re.findall(STRING, call)
        if re.search(r"[a-z]", each)
    }
    assert len(thrown) > 20
    assert thrown - german().keys() == set()


def test_no_display_of_the_scene_has_a_status_or_error_without_its_translation() -> None:
    bare = {
        (name, found)
        for name, text in SOURCES.items()
        if name.startswith("scene/")
        for found in re.findall(r"(?:setStatus\([^;\n]*?, \d, |new Error\()(`[^`\n]*`|\"[^\"\n]*\")", text)
        if re.search(r"[a-z]{2}", re.sub(r"\$\{[^}]*\}", "", found)) and found != '"OK"'
    }
    assert bare == set()


def test_every_size_of_a_simulations_shape_is_in_the_table() -> None:
    shapes = SOURCES["simulation.js"].partition("export const SHAPES")[2].partition("};")[0]
    parts = re.findall(r"sizes: \{([^}]*)\}", shapes)
    sizes = {name.strip() for part in parts for name in re.findall(r"([a-z ]+)\"?:", part)}
    assert sizes >= {"size x", "radius"}
    assert sizes - german().keys() == set()
