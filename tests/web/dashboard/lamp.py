"""A package with a launch file for tests of the dashboard: a node that runs, one that fails, one that fails repeatedly."""

from __future__ import annotations

from pathlib import Path

LAUNCH = """<launch>
  <arg name="word" default="hello" doc="what is printed"/>
  <arg name="loud" default="false"/>
  <arg name="needed" doc="must be given"/>
  <node pkg="lamp" type="talk.py" name="talker" args="'$(arg word)' $(arg needed)"/>
  <node pkg="lamp" type="fail.py" name="failing" output="screen"/>
  <node pkg="lamp" type="fail.py" name="again" respawn="true" respawn_delay="0.2"/>
  <node pkg="lamp" type="missing.py" name="missing"/>
</launch>
"""
TALK = """#!/usr/bin/env python3
import sys
import time

print("talking:", sys.argv[1])
print("<img src=x onerror=\\"document.title='broken'\\">")
while True:
    time.sleep(0.1)
"""
FAIL = """#!/usr/bin/env python3
import sys

print("ERROR: to standard error", file=sys.stderr)
sys.exit(3)
"""


def make_lamp(folder: Path) -> Path:
    """Create the package ``lamp`` in a folder; return its folder."""
    package = folder / "lamp"
    for name in ("launch", "scripts"):
        (package / name).mkdir(parents=True)
    (package / "package.xml").write_text(
        '<package format="2"><name>lamp</name><version>1.0.0</version><description>x</description>'
        '<maintainer email="a@b.c">a</maintainer><license>BSD</license></package>'
    )
    (package / "launch" / "lamp.launch").write_text(LAUNCH)
    (package / "launch" / "broken.launch").write_text("<launch><node/>")
    for name, text in (("talk.py", TALK), ("fail.py", FAIL)):
        path = package / "scripts" / name
        path.write_text(text)
        path.chmod(0o755)
    return package
