"""The files of generated packages."""

from __future__ import annotations

import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest

from minirospy.core.idl.load import write_if_changed


def test_module_that_is_written_again_is_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The module is compiled again even within the same second and with the same size."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = tmp_path / "made.py"
    for number in range(5):
        assert write_if_changed(path, f"x = {number}\n")
        assert imported_x(path) == number
    assert not write_if_changed(path, "x = 4\n")


def imported_x(path: Path) -> object:
    loader = SourceFileLoader("made", str(path))
    spec = spec_from_loader("made", loader)
    assert spec
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module.x
