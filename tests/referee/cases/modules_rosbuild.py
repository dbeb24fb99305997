"""roslib.manifest and roslib.stacks with rosbuild packages, as used by programs from before catkin."""

import os
from pathlib import Path

ROOT = Path(os.environ["ROS_HOME"], "rosbuild")
os.environ.update(ROS_PACKAGE_PATH=str(ROOT), ROS_ROOT="/usr/share/ros")

import roslib.manifest
import roslib.packages
import roslib.stacks
from referee import outcome, show

FILES = {
    "stack/stack.xml": '<stack><author>A</author><license>BSD</license><depend stack="ros"/></stack>',
    "stack/one/manifest.xml": """<package><description brief="short">A <b>text</b></description>
<author>Ann</author><author>Bob</author><license>BSD</license><review status="ok" notes="n"/><url> http://x </url>
<depend package="roscpp"/><depend thirdparty="x"/><depend package="rospy"/><rosdep name="boost"/>
<export><cpp cflags="-I${prefix}"/><python path="p">text</python><actions action-modules="m"/></export>
<export><cpp lflags="-L"/></export><versioncontrol type="svn" url="v"/></package>""",
    "stack/one/below/manifest.xml": "<package/>",
    "stack/two/manifest.xml": "<package/>",
    "alone/manifest.xml": "<package/>",
    "alone/stack/stack.xml": "<stack/>",
    ".hidden/stack.xml": "<stack/>",
}
for name, text in FILES.items():
    (ROOT / name).parent.mkdir(parents=True, exist_ok=True)
    (ROOT / name).write_text(text)


def below(path):
    """Return a path of these files, relative to their folder."""
    return str(path).replace(str(ROOT), "ROOT")


manifest, stacks = roslib.manifest, roslib.stacks
show(manifest.MANIFEST_FILE, stacks.STACK_FILE, stacks.ROS_STACK, stacks.ROS_ROOT, stacks.ROS_PACKAGE_PATH)
show(
    issubclass(stacks.InvalidROSStackException, stacks.ROSStackException),
    manifest.ManifestException.__mro__[1].__name__,
)
for name in ("one", "two", "alone"):
    show(below(manifest.manifest_file(name)), stacks.stack_of(name))
for call in (manifest.manifest_file, manifest.load_manifest, stacks.stack_of):
    try:
        call("no_such_package")
    except roslib.packages.InvalidROSPkgException as error:
        show(call.__name__, str(error)[:53])

one = manifest.load_manifest("one")
for field in ("description", "brief", "license", "author", "url", "status", "notes", "version", "depends"):
    show(field, repr(getattr(one, field)))
show(
    [each.name for each in one.rosdeps],
    [each.package for each in one.depends],
    [str(each) for each in one.depends],
)
show([(each.tag, each.attrs, each.str, each.get("path")) for each in one.exports])
show(one.get_export("cpp", "cflags"), one.get_export("cpp", "x"), one.get_export("x", "y"))
show(one.versioncontrol.type, one.versioncontrol.url)
empty = manifest.parse_file(str(ROOT / "alone" / "manifest.xml"))
for field in (
    "description",
    "license",
    "author",
    "depends",
    "rosdeps",
    "exports",
    "version",
    "versioncontrol",
):
    show(field, getattr(empty, field) or "nothing")
for text in (
    "", "<a/>", "<package>", "<package><depend/></package>", "<package><version>1</version></package>",
    "<package><foo/></package>",
    "<package><description>a</description><description>b</description></package>",
    "<package><license>a</license><license>b</license></package>", "<package><url>a</url><url>b</url></package>",
):  # fmt: skip
    outcome(text, lambda: type(manifest.parse(text)).__name__)
for path in ("", "/no/such/file", None):
    outcome(repr(path), lambda: manifest.parse_file(path))

show(
    [name for name in ("stack", "one", "alone") if name in stacks.list_stacks()],
    below(stacks.get_stack_dir("stack")),
)
outcome("no stack", lambda: stacks.get_stack_dir("no_such_stack"))
cache = {}
show(
    stacks.list_stacks_by_path(str(ROOT)), stacks.list_stacks_by_path(str(ROOT), ["a", "stack"], cache), cache
)
show({name: below(folder) for name, folder in cache.items()} or "nothing")
show(stacks.expand_to_packages(["stack"])[0] == stacks.expand_to_packages(["stack"])[0])
show(
    [sorted(each) for each in stacks.expand_to_packages(["stack", "alone", "one", "no_such"])],
    stacks.get_stack_version("stack"),
)
