"""`make release`: which wheels are rejected, and the addresses that are published."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hatch_build import ADDRESS_VARIABLE, project_urls, readme_of_wheel
from tools import release
from tools.release import MAX_BYTES, faults_of_metadata, faults_of_wheel

ROOT = Path(__file__).parents[1]

SOURCES = [
    "pyproject.toml",
    "minirospy_overlay.pth",
    "minirospy/__init__.py",
    "minirospy/web/dashboard/page/vendor/versions.json",
    "minirospy/web/dashboard/page/vendor/uplot/LICENSE.txt",
    "minirospy/web/dashboard/page/vendor/uplot/uPlot.js",
    "msgs/std_msgs/package.xml",
    "msgs/std_msgs/msg/Bool.msg",
    "tests/test_release.py",
]


@pytest.fixture
def contents() -> dict[str, int]:
    """Return the files of a complete wheel, with their sizes."""
    names = [
        "minirospy_overlay.pth",
        "minirospy/__init__.py",
        "minirospy/web/dashboard/page/vendor/versions.json",
        "minirospy/web/dashboard/page/vendor/uplot/LICENSE.txt",
        "minirospy/web/dashboard/page/vendor/uplot/uPlot.js",
        "minirospy/overlay/std_msgs/msg/_Bool.py",
        "minirospy/overlay/std_msgs/msg/__init__.pyi",
        "minirospy/overlay/std_msgs/py.typed",
        "minirospy/share/msgs/std_msgs/package.xml",
        "minirospy/share/msgs/std_msgs/msg/Bool.msg",
        "minirospy-0.1.0.dist-info/licenses/LICENSE",
        "minirospy-0.1.0.dist-info/RECORD",
    ]
    return dict.fromkeys(names, 100)


def test_whole_wheel_has_no_faults(contents: dict[str, int]) -> None:
    assert faults_of_wheel(contents, MAX_BYTES - 1, SOURCES) == []


def test_large_wheel_names_its_largest_files(contents: dict[str, int]) -> None:
    contents["minirospy/__init__.py"] = 4_000_000
    (fault,) = faults_of_wheel(contents, 6_000_000, SOURCES)
    assert fault.startswith(
        "has 6,000,000 bytes, not under 6,000,000; the largest files: minirospy/__init__.py, "
    )


@pytest.mark.parametrize(
    "name",
    [
        "tests/test_release.py/x",
        "minirospy/notes.txt",
        "minirospy/__pycache__/__init__.cpython-311.pyc",
        "minirospy/overlay/std_msgs/msg/_Bool.py.orig",
        "minirospy/overlay/my_msgs/msg/_Mine.py",
        "minirospy/share/msgs/std_msgs/msg/Mine.msg",
    ],
)
def test_stray_file_is_named(contents: dict[str, int], name: str) -> None:
    contents[name] = 100
    assert faults_of_wheel(contents, 1000, SOURCES) == [f"{name}: not from a file of the sources"]


def test_file_that_is_left_out_is_named(contents: dict[str, int]) -> None:
    del contents["minirospy/__init__.py"]
    assert faults_of_wheel(contents, 1000, SOURCES) == ["minirospy/__init__.py: missing"]


def test_licences_are_required(contents: dict[str, int]) -> None:
    contents["minirospy/web/dashboard/page/vendor/uplot/LICENSE.txt"] = 0
    del contents["minirospy-0.1.0.dist-info/licenses/LICENSE"]
    assert faults_of_wheel(contents, 1000, SOURCES) == [
        "minirospy/web/dashboard/page/vendor/uplot: its LICENSE.txt is missing or empty",
        "the licence of minirospy is missing",
    ]


ADDRESS = "https://git.example.org/robots/ours"
URLS = {
    "Homepage": ADDRESS,
    "Documentation": f"{ADDRESS}/blob/HEAD/docs/index.md",
    "Repository": ADDRESS,
    "Issues": f"{ADDRESS}/issues",
    "Changelog": f"{ADDRESS}/blob/HEAD/CHANGELOG.md",
}


@pytest.mark.parametrize("address", [ADDRESS, ADDRESS + "/", ADDRESS + ".git"])
def test_one_address_gives_all(address: str) -> None:
    assert project_urls(address) == URLS


def test_addresses_of_gitlab_have_its_paths() -> None:
    urls = project_urls("https://gitlab.example.org/group/robots/ours")
    assert urls["Changelog"] == "https://gitlab.example.org/group/robots/ours/-/blob/HEAD/CHANGELOG.md"
    assert urls["Issues"] == "https://gitlab.example.org/group/robots/ours/-/issues"


@pytest.mark.parametrize(
    "address",
    [
        "robots/ours",
        "http://git.example.org/robots/ours",
        "git@git.example.org:robots/ours",
        "https://git.example.org",
        "https:///robots/ours",
        "https://me:secret@git.example.org/robots/ours",
        "https://git.example.org/robots/ours?a=b",
        "https://git.example.org/robots/ours)](x",
        "https://git.example.org:x/robots/ours",
        "https://[git.example.org/robots/ours",
    ],
)
def test_release_refuses_an_invalid_address(address: str) -> None:
    """The error is one line, printed before anything is built."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "release.py")],
        env={**os.environ, ADDRESS_VARIABLE: address},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        f"release: ERROR: {ADDRESS_VARIABLE}={address!r} is not the address of a repository, such as https://HOST/OWNER/NAME\n"
    )


def test_metadata_without_the_addresses_is_named() -> None:
    text = f"Name: x\nProject-URL: Homepage, {ADDRESS}\n\n[here](docs/a.md) [there](https://example.org)\n"
    addresses, links = faults_of_metadata(text, URLS)
    assert addresses.startswith(f"its addresses are ['Homepage, {ADDRESS}'], not ['Homepage, ")
    assert links == "its description has links into the sources: docs/a.md"

    whole = "Name: x\n" + "".join(f"Project-URL: {label}, {url}\n" for label, url in URLS.items())
    assert faults_of_metadata(whole + "\nText.\n", URLS) == []


def test_every_link_of_the_readme_leads_to_a_file() -> None:
    """In the published description, relative links become addresses of the repository. Each must lead to a file."""
    files = f"{ADDRESS}/blob/HEAD/"
    text = readme_of_wheel((ROOT / "README.md").read_text(encoding="utf-8"), files)
    named = [link.partition(")")[0] for link in text.split(f"]({files}")[1:]]
    assert len(named) > 20
    pictures = [link.partition(")")[0] for link in text.split(f"]({ADDRESS}/raw/HEAD/")[1:]]
    assert len(pictures) == 5
    assert f"git clone {ADDRESS} minirospy" in text
    named += pictures
    assert [name for name in named if not (ROOT / name.partition("#")[0]).is_file()] == []


def test_both_builds_are_of_one_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """This holds even if a commit is made between them."""
    repository = tmp_path / "repository"
    repository.mkdir()
    environ = {**os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}

    def git(*words: str) -> str:
        identity = ("-c", "user.name=A", "-c", "user.email=a@example.org")
        command = ["git", *identity, *words]
        done = subprocess.run(
            command, cwd=repository, env=environ, check=True, capture_output=True, text=True
        )
        return done.stdout.strip()

    git("init", "--quiet")
    git("commit", "--quiet", "--allow-empty", "--message", "empty")
    for text in ("first", "second"):
        (repository / "text").write_text(text)
        git("add", "text")
        git("commit", "--quiet", "--message", text)
    monkeypatch.setattr(release, "ROOT", repository)
    # This test checks only the commit that is built.
    monkeypatch.setattr(release, "_run", lambda *_, **__: "")

    (tmp_path / "build" / "dist").mkdir(parents=True)
    assert release._build(tmp_path / "build", git("rev-parse", "HEAD~1"), "0") == []

    assert (tmp_path / "build" / "minirospy" / "text").read_text() == "first"
