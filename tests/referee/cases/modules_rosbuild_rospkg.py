"""rospkg with packages and stacks for rosbuild, the build system before catkin."""

import os
from pathlib import Path

import rospkg
import rospkg.manifest
from referee import outcome, show

ROOT = Path(os.environ["ROS_HOME"], "rosbuild")
FILES = {
    "stack/stack.xml": '<stack><version>1.4</version><author>A</author><license>BSD</license>'
    '<depend stack="ros"/></stack>',
    "stack/one/manifest.xml": """<package><description brief="short">A <b>text</b></description>
<author>Ann</author><author>Bob</author><license url="http://l">BSD</license>
<review status="ok" notes="n"/><url> http://x </url><platform os="ubuntu" version="9.04"/>
<depend package="two"/><depend thirdparty="x"/><depend package="absent"/><rosdep name="boost"/><foo/>
<export><cpp cflags="-I${prefix}"/><python path="p"> text</python></export><export><cpp lflags="-L"/></export>
<versioncontrol type="svn" url="v"/></package>""",
    "stack/one/below/manifest.xml": "<package/>",
    "stack/two/manifest.xml": "<package><rosdep name='tinyxml'/></package>",
    "alone/manifest.xml": "<package><depend package='two'/></package>",
    "above/manifest.xml": "<package><depend package='alone'/></package>",
    "both/manifest.xml": "<package><license>M</license></package>",
    "both/package.xml": "<package><name>both</name><version>1.0.0</version><description>x</description>"
    "<maintainer email='a@b.org'>a</maintainer><license>B</license></package>",
    "bad/manifest.xml": "<package>",
    "badroot/manifest.xml": "<stack/>",
    "usesbad/manifest.xml": "<package><depend package='bad'/></package>",
    "nodep/manifest.xml": "<package><depend/></package>",
    "mark/manifest.xml": "<package><catkin/></package>",
    "ignored/CATKIN_IGNORE": "",
    "ignored/p/manifest.xml": "<package/>",
    "nosub/rospack_nosubdirs": "",
    "nosub/p/manifest.xml": "<package/>",
    ".hidden/p/manifest.xml": "<package/>",
}  # fmt: skip
for name, text in FILES.items():
    (ROOT / name).parent.mkdir(parents=True, exist_ok=True)
    (ROOT / name).write_text(text)
FIELDS = [
    *("description", "brief", "author", "license", "licenses", "license_url", "url", "version", "status"),
    *("notes", "type", "is_catkin", "depends", "platforms"),
]


def fields(manifest):
    """Return a manifest's fields."""
    found = {name: getattr(manifest, name) for name in FIELDS}
    found["rosdeps"] = [each.name for each in manifest.rosdeps]
    found["exports"] = [(each.tag, each.attrs, each.str) for each in manifest.exports]
    found["unknown"] = [each.tagName for each in manifest.unknown_tags]
    return found


def below(path):
    """Return a path of these files, relative to their folder."""
    return str(path).replace(str(ROOT), "ROOT")


packages, stacks = rospkg.RosPack([str(ROOT)]), rospkg.RosStack([str(ROOT)])
show(sorted(packages.list()), sorted(stacks.list()))
for name in ("one", "two", "below", "alone", "both", "bad", "badroot", "usesbad", "nodep", "mark", "p"):
    show("---", name)
    outcome("path", lambda: below(packages.get_path(name)))
    outcome("manifest", lambda: fields(packages.get_manifest(name)))
    outcome("filename", lambda: below(packages.get_manifest(name).filename))
    for implicit in (True, False):
        outcome("depends", lambda: packages.get_depends(name, implicit))
        outcome("rosdeps", lambda: sorted(packages.get_rosdeps(name, implicit)))
    outcome("stack", lambda: packages.stack_of(name))
for implicit in (True, False):
    outcome("depend on two", lambda: sorted(packages.get_depends_on("two", implicit)))
for name in ("stack", "ros"):
    outcome("packages", lambda: sorted(stacks.packages_of(name)))
    outcome("version", lambda: stacks.get_stack_version(name))
    outcome("path", lambda: below(stacks.get_path(name)))
    outcome("manifest", lambda: fields(stacks.get_manifest(name)))
    outcome("depends", lambda: stacks.get_depends(name, False))

show([sorted(each) for each in rospkg.expand_to_packages(["stack", "no_such", "alone"], packages, stacks)])
for name in ("stack/one", "stack/one/below", "both", "stack", ""):
    show(repr(name), rospkg.get_package_name(str(ROOT / name)))
for name in ("manifest.xml", "package.xml", "stack.xml"):
    cache = {}
    show(name, sorted(rospkg.list_by_path(name, str(ROOT), cache)), sorted(map(below, cache.values())))
show(rospkg.get_stack_version_by_dir(str(ROOT / "stack")))
for folder, name in (
    ("stack/one", "manifest.xml"), ("both", "manifest.xml"), ("stack", "stack.xml"), ("ignored", "manifest.xml"),
    ("stack/one", "package.xml"),
):  # fmt: skip
    outcome(f"{folder} {name}", lambda: fields(rospkg.parse_manifest_file(str(ROOT / folder), name)))

one = packages.get_manifest("one")
show(below(one.get_export("cpp", "cflags")), one.get_export("cpp", "cflags", False), one.get_export("x", "y"))
show(one.depends[0] == type(one.depends[0])("two", "package"), repr(one.depends))
show(one.platforms[0].os, one.platforms[0].version, repr(one.platforms[0].notes))
for text in (
    "<package/>", "<package><license>a</license><license>b</license></package>", "", "<stack/>", " <package/>",
    "<package><url>a</url><url>b</url></package>", "<package><platform os='x'/></package>",
    "<package><rosdep/></package>", "<package><depend package=''/></package>",
    "<package><version>1</version><name>x</name></package>", "<package><author>a</author></package>",
    "<package><description>a</description><description>b</description></package>",
):  # fmt: skip
    outcome(text, lambda: fields(rospkg.manifest.parse_manifest("manifest.xml", text, "F")))
for text in (
    "<stack><export><a/></export></stack>",
    "<stack><rosdep name='a'/></stack>",
    "<stack><depend/></stack>",
):
    outcome(text, lambda: fields(rospkg.manifest.parse_manifest("stack.xml", text, "F")))
empty = rospkg.manifest.Manifest()
show(fields(empty), empty.filename)
outcome("no file name", lambda: empty.get_export("a", "b"))
