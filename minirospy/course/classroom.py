"""The results of all students at a master, from the parameters that their checks set."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

from minirospy.base.errors import RpcRefused
from minirospy.course.results import CLASS_PARAMETER, MAX_NAME, SECONDS, Result, result_of
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["Student", "class_table", "gather"]


@dataclass(frozen=True)
class Student:
    """A row of the class's table: one computer's results. ``key`` is the last part of the computer's parameter name."""

    key: str
    name: str
    results: Mapping[str, Result]


def gather(uri: str) -> list[Student]:
    """Return the students with results on a master, sorted by name. Raise MasterUnreachableError if it does not respond.

    Values that are not records are skipped; any node may have set them.
    """
    master = MasterProxy(uri, f"/class_{os.getpid()}", timeout=SECONDS)
    try:
        found = master.get_param(CLASS_PARAMETER)
    except RpcRefused:
        found = {}
    finally:
        master.close()
    students = []
    for key, value in found.items() if isinstance(found, dict) else ():
        try:
            results = {str(name): result_of(each) for name, each in value["exercises"].items()}
            students.append(Student(str(key), str(value["student"])[:MAX_NAME], results))
        except (KeyError, TypeError, ValueError, AttributeError):
            continue
    return sorted(students, key=lambda student: student.name.lower())


def class_table(students: list[Student], names: list[str]) -> list[list[str]]:
    """Return the class's table, including its header. Cells are "yes", "no" (not passed yet), or empty (not tried)."""
    used = [name for name in names if any(name in student.results for student in students)]
    used += sorted({name for student in students for name in student.results} - set(names))
    marks = {student.key: [_mark(student.results.get(name)) for name in used] for student in students}
    return [["", *used], *([student.name, *marks[student.key]] for student in students)]


def _mark(result: Result | None) -> str:
    return "" if result is None else "yes" if result.ever else "no"
