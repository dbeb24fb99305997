"""A user's tokens, in a file that only this user can read."""

from __future__ import annotations

import json
import os
import stat
import sys
from pathlib import Path

import pytest

from minirospy.base.errors import BridgeError
from minirospy.web import tokens
from minirospy.web.tokens import Tokens, kept_tokens, read_tokens


def test_tokens_are_kept_private_and_renewed(tmp_path: Path) -> None:
    first = kept_tokens(tmp_path)
    assert kept_tokens(tmp_path) == first
    (file,) = tmp_path.iterdir()
    if sys.platform != "win32":
        assert file.stat().st_mode & 0o077 == 0
        # Other users may have read the file, or own it.
        file.chmod(0o644)
        assert read_tokens(tmp_path) is None
        first = kept_tokens(tmp_path)
        assert file.stat().st_mode & 0o077 == 0
    assert kept_tokens(tmp_path, renews=True) != first
    for text in ("nonsense", "[]", "{}", '{"write": "", "read": ""}', '{"write": null, "read": "abcdefgh"}'):
        file.write_text(text)
        file.chmod(0o600)
        assert read_tokens(tmp_path) is None
    assert kept_tokens(tmp_path) == read_tokens(tmp_path)


def test_tokens_are_those_of_the_file(tmp_path: Path) -> None:
    home = tmp_path / "some" / "home"
    kept = kept_tokens(home)
    file = home / "bridge-tokens.json"
    assert json.loads(file.read_text(encoding="utf-8")) == {"write": kept.write, "read": kept.read}
    if sys.platform != "win32":
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert kept.write != kept.read
    given = Tokens("written-by-hand", "read-by-hand")
    file.write_text(json.dumps(given._asdict()), encoding="utf-8")
    assert read_tokens(home) == kept_tokens(home) == given
    assert kept_tokens(home, renews=True) not in (given, kept)


@pytest.mark.skipif(sys.platform == "win32", reason="files have no owner's number there")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o610, 0o601])
def test_tokens_that_others_may_open_are_not_used(mode: int, tmp_path: Path) -> None:
    kept_tokens(tmp_path)
    file = tmp_path / "bridge-tokens.json"
    file.chmod(mode)
    assert read_tokens(tmp_path) is None
    file.chmod(0o400)
    assert read_tokens(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="files have no owner's number there")
def test_tokens_of_another_user_are_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept_tokens(tmp_path)
    monkeypatch.setattr(tokens.os, "geteuid", lambda: os.getuid() + 1)
    assert read_tokens(tmp_path) is None


def test_tokens_that_cannot_be_kept_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(
        BridgeError, match=r"the tokens cannot be kept in .*bridge-tokens.json: .*: give --token"
    ):
        kept_tokens(tmp_path / "file")
