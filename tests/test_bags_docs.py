"""docs/bags.md is correct: each recipe prints the output on the page."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

from minirospy.core.bag.writer import BagWriter

PAGE = Path(__file__).parents[1] / "docs" / "bags.md"
BLOCK = re.compile(r"^```(python|console)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SECOND = 10**9

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the page shows Linux and its commands")


def make_bag(path: Path) -> None:
    """Write the bag that the recipes use."""
    from io import BytesIO

    from sensor_msgs.msg import CompressedImage
    from std_msgs.msg import String

    with path.open("wb") as stream:
        writer = BagWriter(stream)
        numbers = {
            topic: writer.add_connection(
                topic,
                {
                    "topic": topic,
                    "type": cls._type,
                    "md5sum": cls._md5sum,
                    "message_definition": cls._full_text,
                },
            )
            for topic, cls in (("/chatter", String), ("/camera", CompressedImage))
        }
        for i in range(100):
            messages = [("/chatter", String(f"hello {i}"))]
            if i % 10 == 0:
                messages.append(("/camera", CompressedImage(format="jpeg", data=b"\xff\xd8 a picture")))
            for topic, message in messages:
                body = BytesIO()
                message.serialize(body)
                writer.write(numbers[topic], 1000 * SECOND + i * SECOND // 10, body.getvalue())
        writer.close()


def matches(shown: list[str], printed: list[str]) -> bool:
    """Return whether printed lines match the shown ones. ``...`` matches any text, and on a separate line, any lines."""
    if not shown:
        return not printed
    first, *rest = shown
    if first == "...":
        return any(matches(rest, printed[skipped:]) for skipped in range(len(printed) + 1))
    pattern = first.rstrip().replace("[", "[[]").replace("...", "*")
    return bool(printed) and fnmatchcase(printed[0].rstrip(), pattern) and matches(rest, printed[1:])


def test_the_recipes_print_what_the_page_shows(tmp_path: Path) -> None:
    make_bag(tmp_path / "run.bag")
    text = PAGE.read_text(encoding="utf-8")
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    commands = 0

    for block in BLOCK.finditer(text):
        kind, content = block.groups()
        if kind == "python":
            name = re.findall(r"save this as `(\w+\.py)`:\s*$", text[: block.start()], re.IGNORECASE)[-1]
            (tmp_path / name).write_text(content, encoding="utf-8")
            continue
        for command, *shown in (
            step.splitlines() for step in re.split(r"^\$ ", content, flags=re.MULTILINE)[1:]
        ):
            done = subprocess.run(
                command,
                check=False,
                shell=True,
                cwd=tmp_path,
                capture_output=True,
                text=True,
                env={**os.environ, "PATH": path},
            )
            printed = (done.stdout + done.stderr).rstrip().splitlines()
            assert matches(shown, printed), f"{command}\n" + "\n".join(printed)
            commands += 1
    assert commands > 12
