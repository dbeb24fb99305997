"""Links to views, and the arguments of rqt's commands."""

from __future__ import annotations

import re

import pytest

from minirospy.base.errors import UsageError
from minirospy.cli.dashboard import dashboard_parser
from minirospy.web.dashboard.files import FOLDER
from minirospy.web.dashboard.views import LAYOUTS, VIEWS, link, plotted_fields


def test_page_has_the_views_that_links_name() -> None:
    table = re.search(
        r"const VIEWS = \{(.*?)\};", (FOLDER / "js" / "main.js").read_text(encoding="utf-8"), re.DOTALL
    )
    assert table
    assert tuple(re.findall(r'"?(\w+)"?: \[', table[1])) == VIEWS


def test_page_has_the_layouts_that_links_name() -> None:
    text = (FOLDER / "js" / "presets.js").read_text(encoding="utf-8")
    assert tuple(re.findall(r"^  (\w+): \[", text, re.MULTILINE)) == LAYOUTS


def test_help_names_all_layouts() -> None:
    text = " ".join(dashboard_parser().format_help().split())
    assert f"several views side by side: {', '.join(LAYOUTS)}" in text
    # "console" and "teleop" are not listed, because they are arguments of one view.
    assert "or a layout: workshop, rviz, classroom" in text


def test_link_has_its_settings_and_token_in_the_fragment() -> None:
    assert link("localhost", 8766, "topics") == "http://localhost:8766/#/topics"
    assert (
        link("::1", 1, "plot", {"path": ["/a/b[0:2]", "/c d"]}, token="t-1", encrypted=True)
        == "https://[::1]:1/#/plot?path=/a/b[0:2]&path=/c%20d&token=t-1"
    )


@pytest.mark.parametrize(
    ("words", "paths"),
    [
        (["/turtle1/pose/x"], ["/turtle1/pose/x"]),
        (["/turtle1/pose/x:y:theta"], ["/turtle1/pose/x", "/turtle1/pose/y", "/turtle1/pose/theta"]),
        (["/a/x,/b/y", "/c/z"], ["/a/x", "/b/y", "/c/z"]),
        (["pose/x:y"], ["/pose/x", "/pose/y"]),
        (["/scan/ranges[0:5]"], ["/scan/ranges[0:5]"]),
        (["/button_state"], ["/button_state"]),
        ([], []),
    ],
)
def test_words_of_rqt_plot_become_paths(words: list[str], paths: list[str]) -> None:
    assert plotted_fields(words) == paths


def test_paths_in_bags_remain_as_they_are() -> None:
    words = ["run.bag:/pose/x,/tmp/a b.mcap:/a/b[1:2]", "a.bag:/x/y - b.bag:/x/y", "/pose/x:y"]
    assert plotted_fields(words) == [
        "run.bag:/pose/x",
        "/tmp/a b.mcap:/a/b[1:2]",
        "a.bag:/x/y - b.bag:/x/y",
        "/pose/x",
        "/pose/y",
    ]


@pytest.mark.parametrize("word", ["x", "/x:y"])
def test_word_that_is_not_a_path_is_refused(word: str) -> None:
    with pytest.raises(UsageError, match=re.escape(word)):
        plotted_fields([word])
