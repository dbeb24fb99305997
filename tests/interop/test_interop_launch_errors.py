# ruff: noqa: E501
"""The error messages of real roslaunch and minirospy for broken launch files both contain the words that scripts may match."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from tests.interop.conftest import PATIENCE, environment
from tests.interop.test_interop_roslaunch import OUR_BIN

NODE = '<node name="x" pkg="p" type="t"'
FAULTS = {
    '<node name="x" type="t"/>': "<node> tag is missing required attribute: 'pkg'",
    '<node name="a/b" pkg="p" type="t"/>': "node name cannot contain a namespace",
    f'{NODE} respawn="yes"/>': "invalid bool value for respawn: yes",
    f'{NODE} respawn="true" required="true"/>': "respawn and required cannot both be set to true",
    f'{NODE} output="file"/>': "output must be one of 'log', 'screen'",
    f'{NODE} cwd="there"/>': "cwd must be one of 'ROS_HOME', 'node'",
    f'{NODE} respawn_delay="x"/>': "invalid float value for respawn_delay: x",
    f'{NODE} ns=""/>': "<node> tag has an empty 'ns' attribute",
    f'{NODE} ns="~a"/>': "cannot turn [~a] into a global name",
    f"{NODE}/>{NODE}/>": "roslaunch file contains multiple nodes named [/x]",
    f'{NODE} if="maybe"/>': "maybe is not a 'bool' type",
    f'{NODE} if="1" unless="1"/>': "cannot set both 'if' and 'unless' on the same tag",
    '<param name="p"/>': "<param> tag must have one and only one of value/textfile/binfile",
    '<param name="p" value="x" type="int"/>': "invalid literal for int() with base 10: 'x'",
    '<param name="p" value="1" type="what"/>': "Unknown type 'what'",
    '<param name="p" value="yes" type="bool"/>': "yes is not a 'bool' type",
    '<param name="p" command="no_such_command"/>': "no such command [",
    '<param name="p" command="false"/>': "returned with code [1]",
    '<param name="p" value="$(env NOPE)"/>': "environment variable 'NOPE' is not set",
    '<param name="p" value="$(what x)"/>': "Unknown substitution command [what x]",
    '<param name="p" value="$(eval ().__class__)"/>': "$(eval ...) may not contain double underscore expressions",
    '<arg name="a" default="1" value="2"/>': "<arg> tag must have one and only one of value/default",
    '<arg name="a" value="1"/><arg name="a" value="2"/>': "arg 'a' has already been declared",
    '<arg name="a"/><param name="p" value="$(arg a)"/>': "requires the 'a' arg to be set",
    '<include file="FOLDER/inner.launch"><arg name="z" value="1"/></include>': "unused args [z] for include of [FOLDER/inner.launch]",
    '<include file="FOLDER/inner.launch"><arg name="k" value="1"/></include>': "cannot override arg 'k', which has already been set",
    "<rosparam>[1]</rosparam>": "'param' attribute must be set for non-dictionary values",
    '<rosparam file="/no.yaml"/>': "file does not exist [/no.yaml]",
    '<rosparam command="what"/>': "command must be",
    '<remap from="a b" to="c"/>': "remap from [a b] is not a valid ROS name",
    '<group clear_params="true"/>': "'ns' attribute must be set in order to use 'clear_params'",
    '<machine name="m"/>': "<machine> tag is missing required attribute: 'address'",
    '<machine name="m" address="a"><env name="E" value="1"/></machine>': "<machine>: <env> tag is not supported since ROS Fuerte",
    '<param name="p" value="1" type="float"/>': "Unknown type 'float'",
    "</group>": "Invalid roslaunch XML syntax: mismatched tag",
    '<param name="p" value="a & b"/>': "Invalid roslaunch XML syntax: not well-formed (invalid token)",
    "</launch><launch>": "Invalid roslaunch XML syntax: junk after document element",
}
PROGRAM = """
import json, sys
import roslaunch
said, loader = {}, roslaunch.XmlLoader()
# ROS requires it of a user's loader.
loader.ignore_unset_args = False
for body in json.load(sys.stdin):
    with open("fault.launch", "w") as file:
        file.write("<launch>\\n" + body + "\\n</launch>")
    try:
        loader.load("fault.launch", roslaunch.ROSLaunchConfig(), verbose=False)
    except Exception as error:
        said[body] = str(error)
print("SAID" + json.dumps(said))
"""


def said(python: str, stack: str, folder: Path) -> dict[str, str]:
    faults = [body.replace("FOLDER", str(folder)) for body in FAULTS]
    done = subprocess.run(
        [python, "-c", PROGRAM],
        input=json.dumps(faults),
        env=environment("http://localhost:1", stack),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        cwd=folder,
        check=True,
    )
    found: dict[str, str] = json.loads(done.stdout.partition("SAID")[2])
    return found


def test_launch_errors_contain_the_words_of_ros(tmp_path: Path) -> None:
    (tmp_path / "inner.launch").write_text('<launch><arg name="k" value="v"/></launch>')
    real = said("/usr/bin/python3", "rospy", tmp_path)
    ours = said(str(OUR_BIN / "python"), "ours", tmp_path)
    for body, words in FAULTS.items():
        fault, phrase = body.replace("FOLDER", str(tmp_path)), words.replace("FOLDER", str(tmp_path))
        assert phrase in real.get(fault, "it loads"), (fault, real.get(fault))
        assert phrase in ours.get(fault, "it loads"), (fault, ours.get(fault))
        # The line of the fault is named, except for the errors of ROSLaunchConfig, which are ROS's own words.
        named = ours[fault].startswith("fault.launch:") or "inner.launch:" in ours[fault]
        assert named or ours[fault] == real[fault]
