"""catkin.find_in_workspaces, with which programs find the files of packages in a workspace."""

import os
import tempfile

workspace = os.path.realpath(tempfile.mkdtemp())


def file(*parts, text=""):
    path = os.path.join(workspace, *parts)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as stream:
        stream.write(text)
    return path


def package(*parts):
    text = (
        "<package format='2'><name>{}</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@example.com'>m</maintainer><license>BSD</license></package>"
    )
    file(*parts, "package.xml", text=text.format(parts[-1]))


package("src", "robot")
package("src", "deep", "arm")
file("src", "robot", "launch", "up.launch")
file("src", "robot", "config", "a.yaml")
file("src", "deep", "arm", "data", "x.dat")
file("devel", ".catkin", text=os.path.join(workspace, "src"))
file("devel", "lib", "robot", "node")
file("devel", "share", "robot", "made.txt")
file("devel", "include", "robot", "made.h")
file("devel", "etc", "robot", "settings")
package("install", "share", "tool")
file("install", ".catkin")
file("install", "share", "tool", "config", "a.yaml")
file("install", "lib", "tool", "node")
file("none", "share", "ghost", "package.xml")
os.environ["CMAKE_PREFIX_PATH"] = os.pathsep.join(
    os.path.join(workspace, each) for each in ("devel", "install", "none")
)

from catkin.find_in_workspaces import find_in_workspaces
from referee import outcome, show


def found(**options):
    paths = find_in_workspaces(**options)
    return type(paths).__name__, [
        os.path.relpath(path, workspace) for path in paths if path.startswith(workspace)
    ]


for options in (
    {"project": "robot"},
    {"project": "robot", "path": "launch/up.launch"},
    {"project": "robot", "path": "launch/up.launch", "first_match_only": True},
    {"project": "robot", "path": "config"},
    {"project": "robot", "path": "package.xml", "first_match_only": True},
    {"project": "arm", "path": "data"},
    {"project": "arm"},
    {"project": "tool"},
    {"project": "tool", "path": "config/a.yaml"},
    {"project": "ghost"},
    {"project": "nope"},
    {"project": "robot", "path": "nope"},
    {"search_dirs": ["share"], "project": "robot"},
    {"search_dirs": ["share"], "project": "robot", "path": "made.txt"},
    {"search_dirs": ["share"], "project": "tool", "path": "config"},
    {"search_dirs": ["share"], "project": "robot", "path": "config", "first_match_only": True},
    {"search_dirs": ["share"], "project": "robot", "first_matching_workspace_only": True},
    {"search_dirs": ["libexec"], "project": "robot", "path": "node"},
    {"search_dirs": ["libexec"], "project": "tool", "path": "node"},
    {"search_dirs": ["libexec", "share"], "project": "tool"},
    {"search_dirs": ["lib"]},
    {"search_dirs": ["include"], "project": "robot"},
    {"search_dirs": ["etc"], "project": "robot", "path": "settings"},
    {"search_dirs": ["share"]},
    {"path": "robot"},
    {},
):
    outcome(options, lambda o=options: found(**o))
outcome("no such folder", lambda: found(search_dirs=["nope"]))
os.environ["CMAKE_PREFIX_PATH"] = ""
outcome("no workspace", lambda: found(project="robot"))
show("end")
