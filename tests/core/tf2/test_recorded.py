"""Compare the recorded responses of the real tf2_py (`make_recorded.py`) with those of minirospy's buffer."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.core.tf2.conversation import Answer, Question, difference, shortened
from tests.core.tf2.ours import our_answers

RECORDED: list[tuple[list[Question], list[Answer]]] = json.loads(
    (Path(__file__).parent / "recorded.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize("lazily", [False, True], ids=["inserted", "as_bytes"])
@pytest.mark.parametrize("number", range(len(RECORDED)))
def test_answers_are_those_of_the_real_tf2(number: int, lazily: bool) -> None:
    queries, real = RECORDED[number]
    ours = our_answers(queries, lazily=lazily)
    differences = [
        f"{question}: {text}"
        for question, was, is_ in zip(queries, real, ours, strict=True)
        if (text := difference(was, shortened(is_)))
    ]
    assert not differences
