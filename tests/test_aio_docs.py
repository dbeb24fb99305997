"""The programs of docs/asyncio.md run, and print what the page says."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[1] / "docs" / "asyncio.md").read_text(encoding="utf-8")
PROGRAMS = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", PAGE, re.DOTALL)


def test_every_program_says_what_it_prints() -> None:
    assert PAGE.count("```python") == len(PROGRAMS) > 0


@pytest.mark.parametrize(("code", "printed"), PROGRAMS, ids=range(1, len(PROGRAMS) + 1))
def test_program(code: str, printed: str, master: str) -> None:
    done = subprocess.run(
        [sys.executable, "-X", "dev", "-c", code], capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 0, done.stderr
    expected = re.escape(printed).replace(r"\.\.\.", ".*")
    assert re.fullmatch(expected, done.stdout), done.stdout
    # What handlers raise is logged; nothing else is.
    assert "Warning" not in done.stderr
