"""The teacher's kit (tools/course_kit.py): no solution reaches the students, and the card has two pages."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from minirospy.course.exercise import built_in_names

from .conftest import PAGES

TOOL = Path(__file__).parents[2] / "tools" / "course_kit.py"


def _load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("course_kit", TOOL)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["course_kit"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


kit = _load()


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kit")
    subprocess.run([sys.executable, str(TOOL), str(folder)], check=True, capture_output=True)
    return folder


def test_students_have_each_page_without_its_solution(out: Path) -> None:
    for page in PAGES.glob("*.md"):
        assert (out / "teachers" / page.name).read_text("utf-8") == kit.read_page(page)
        if page.name == "instructor.md":
            continue
        text = (out / "students" / page.name).read_text("utf-8")
        assert "olution:*" not in text
        assert page.read_text("utf-8").count("## Exercise") == text.count("## Exercise")
        assert text.count("```") % 2 == 0
    assert not (out / "students" / "instructor.md").exists()
    assert "instructor" not in (out / "students" / "index.md").read_text("utf-8")
    students = "".join(each.read_text("utf-8") for each in (out / "students").glob("*.md"))
    for solution in ("my_watch.py", "my_square.py", "count.py`:", "sick_dist_switch.py` in", "my_ball_leds"):
        assert solution not in students
    # The tasks, hints and checks are there, and the link to the next page.
    for name in built_in_names():
        assert f"`minirospy check {name}" in students
    assert "Next: [Topics](topics.md)" in (out / "students" / "nodes.md").read_text("utf-8")


@pytest.mark.parametrize("pages", [PAGES, PAGES / "de"], ids=["english", "german"])
def test_pages_of_the_kit_have_no_language_line_and_no_comment(pages: Path, tmp_path: Path) -> None:
    """The kit has one language, and no file that the comment names."""
    kit.write_kit(pages, tmp_path)
    for page in pages.glob("*.md"):
        text = page.read_text("utf-8")
        for folder in ("students", "teachers"):
            made = tmp_path / folder / page.name
            if not made.exists():
                assert (folder, page.name) == ("students", "instructor.md")
                continue
            # The title is followed by the first paragraph.
            [title, empty, paragraph] = made.read_text("utf-8").splitlines()[:3]
            assert title == text.splitlines()[0]
            assert empty == ""
            assert paragraph in text
            assert not kit.LANGUAGES.search(made.read_text("utf-8"))
            assert "<!--" not in made.read_text("utf-8")
    for name in ("slides.md", "card.html"):
        assert "translate_course" not in (tmp_path / name).read_text("utf-8")


@pytest.mark.parametrize(
    ("page", "expected"),
    [
        ("# A\n\ntext\n", "# A\n\ntext\n"),
        (
            "# A\n\n## Exercise\n\nDo.\n\n*Solution:* so.\n\nNext: [B](b.md)\n",
            "# A\n\n## Exercise\n\nDo.\n\nNext: [B](b.md)\n",
        ),
        ("## Exercise\n\n*Hint:* h. *Solution:* s.\n\n```sh\nx\n```\n", "\n## Exercise\n\n*Hint:* h.\n"),
        (
            "## Aufgabe\n\nTu.\n\n*Lösung:* so.\n\n## B\n\nWeiter.\n",
            "\n## Aufgabe\n\nTu.\n\n## B\n\nWeiter.\n",
        ),
        ("```sh\n## no heading\n*Solution:*\n```\n", None),
    ],
)
def test_solution_ends_at_the_next_part(page: str, expected: str | None) -> None:
    if expected is not None:
        assert kit.without_solutions(page).lstrip() == expected.lstrip()
    else:
        assert [part.heading for part in kit.sections(page)] == [""]


def test_slides_are_those_of_marp_without_solutions(out: Path) -> None:
    text = (out / "slides.md").read_text("utf-8")
    assert text.startswith("---\nmarp: true\n")
    slides = text.partition("\n---\n\n")[2].split("\n\n---\n\n")
    titles = [slide.splitlines()[0] for slide in slides]
    assert [title[2:] for title in titles if title.startswith("# ")] == [
        (PAGES / name).read_text("utf-8").splitlines()[0][2:] for name in kit.page_names(PAGES)
    ]
    assert "olution" not in re.sub(r"[Rr]esolution", "", "".join(s for s in slides if "## Exercise" in s))
    assert max(slide.count("\n") for slide in slides) < 40
    assert all(slide.count("```") % 2 == 0 for slide in slides)


def test_card_names_each_command_of_the_tables_and_each_exercise(out: Path) -> None:
    card = (out / "card.html").read_text("utf-8")
    for name in built_in_names():
        assert f"minirospy check {name}" in card
    for command in ("rosrun PACKAGE PROGRAM", "rostopic echo TOPIC", "rosbag record TOPIC"):
        assert command in card
    assert card.count('class="page"') == 2


@pytest.mark.skipif(not shutil.which("chromium"), reason="chromium is not installed")
def test_card_is_printed_on_two_pages(out: Path, tmp_path: Path) -> None:
    pdf = tmp_path / "card.pdf"
    words = ["--headless", "--no-sandbox", f"--user-data-dir={tmp_path / 'profile'}", f"--print-to-pdf={pdf}"]
    subprocess.run(["chromium", *words, (out / "card.html").as_uri()], check=True, capture_output=True)
    assert len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes())) == 2


def test_folder_without_pages_is_one_line(tmp_path: Path) -> None:
    command = [sys.executable, str(TOOL), str(tmp_path / "out"), "--pages", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, f"course_kit.py: ERROR: {tmp_path} has no index.md\n")
