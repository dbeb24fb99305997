"""The page's pure modules, tested by Node.js's own test runner."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tools.check_page import find_node

PAGE_TESTS = sorted((Path(__file__).parents[1] / "page").glob("*.test.mjs"))
NODE = find_node()


def test_there_are_tests_of_the_page() -> None:
    assert len(PAGE_TESTS) >= 5


@pytest.mark.skipif(NODE is None, reason="no node of a version that reads the page's modules")
def test_modules_of_the_page_pass_their_tests() -> None:
    assert NODE
    done = subprocess.run(
        [NODE, "--test", *map(str, PAGE_TESTS)], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
