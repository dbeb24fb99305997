"""The note on errors about methods that numpy has removed."""

from __future__ import annotations

import sys
import traceback

import pytest

np = pytest.importorskip("numpy")

from minirospy.base.installation import install_command  # noqa: E402
from minirospy.base.numpy_names import add_numpy_note  # noqa: E402


def notes(error: BaseException) -> list[str]:
    add_numpy_note(error)
    return traceback.format_exception_only(error)[1:]


@pytest.mark.skipif(sys.version_info < (3, 11), reason="notes are new in Python 3.11")
def test_note_on_a_removed_method() -> None:
    error = AttributeError("no tostring", name="tostring", obj=np.zeros(3))
    assert notes(error) == [
        f"numpy 2.3 has removed it: use a.tobytes(), or `{install_command('numpy<2.3')}`\n"
    ]


@pytest.mark.parametrize(
    "error",
    [
        AttributeError("x", name="tostring", obj=b""),
        AttributeError("x", name="nope", obj=np.zeros(3)),
        AttributeError("x"),
        ValueError("x"),
    ],
)
def test_no_note_on_other_errors(error: Exception) -> None:
    assert notes(error) == []
