"""catkin_pkg: package.xml as objects, packages below a folder, their order, and the arguments of setup()."""

import os
import tempfile

from catkin_pkg import package as module
from catkin_pkg import python_setup
from catkin_pkg.condition import evaluate_condition
from catkin_pkg.package import Dependency, InvalidPackage, Package, package_exists_at, parse_package_string
from catkin_pkg.packages import find_package_paths, find_packages, verify_equal_package_versions
from catkin_pkg.python_setup import generate_distutils_setup
from catkin_pkg.topological_order import topological_order
from catkin_pkg.workspaces import order_paths
from referee import outcome, show

PACKAGES = {
    "a/b": """<package format="3"><name>b</name><version compatibility="1.0.0">1.2.3</version>
<description>A <b>bold</b>
   text &amp; more </description><maintainer email="a@b.org">Ann</maintainer><maintainer email="c@b.org">Cy</maintainer>
<license file="LICENSE">BSD</license><license>MIT</license><url type="repository">http://x</url><url>http://y</url>
<author>Bob</author><buildtool_depend>catkin</buildtool_depend><depend version_gte="1.0.0">rospy</depend>
<build_depend condition="$ROS_VERSION == 1">std_msgs</build_depend>
<exec_depend condition="$ROS_VERSION == 2">rclpy</exec_depend><test_depend>rostest</test_depend>
<exec_depend>c</exec_depend><conflict>x</conflict>
<export><build_type>catkin</build_type><nodelet plugin="${prefix}/p.xml"/></export></package>""",
    "c": """<package><name>c</name><version>0.0.1</version><description>d</description>
<maintainer email="a@b.org">Ann</maintainer><license>BSD</license><url type="website">u</url>
<author email="q@w.de">Q</author><buildtool_depend>catkin</buildtool_depend><run_depend>rospy</run_depend>
<build_depend>z</build_depend></package>""",
    "m": """<package format="2"><name>m</name><version>0.0.1</version><description>d</description>
<maintainer email="a@b.org">Ann</maintainer><license>BSD</license><buildtool_depend>catkin</buildtool_depend>
<exec_depend>b</exec_depend><export><metapackage/></export></package>""",
    "z": """<package format="2"><name>z</name><version>0.0.1</version><description>d</description>
<maintainer email="a@b.org">Ann</maintainer><license>BSD</license></package>""",
    "left_out": "<package/>",
}

os.chdir(tempfile.mkdtemp())
for place, text in PACKAGES.items():
    os.makedirs(place)
    with open(os.path.join(place, "package.xml"), "w") as file:
        file.write(text)
open(os.path.join("left_out", "CATKIN_IGNORE"), "w").close()

for place in ("a/b", "c", "m/package.xml"):
    found = module.parse_package(place)
    show("==", place)
    for name in found:
        value = getattr(found, name)
        show(name, [(str(x), type(x).__name__) for x in value] if isinstance(value, list) else repr(value))
    show(
        found.build_depends,
        [(d.version_lt, d.version_gte, d.evaluated_condition) for d in found.build_depends],
    )
    show([str(d) for d in found.run_depends], found["name"])
    outcome("unknown", lambda: found.nope)
    outcome("unknown key", lambda: found["nope"])
    show(
        found.is_metapackage(),
        found.has_buildtool_depend_on_catkin(),
        found.has_invalid_metapackage_dependencies(),
    )
    found.evaluate_conditions({"ROS_VERSION": "1"})
    show([d.evaluated_condition for d in found.exec_depends], found.get_build_type())
    show([(e.tagname, e.attributes, e.content) for e in found.exports])
    show(
        [(p.name, p.email) for p in found.maintainers + found.authors], [(u.url, u.type) for u in found.urls]
    )
    show([(each, each.file) for each in found.licenses])

PERSON = '<maintainer email="a@b.de">Ann</maintainer>'
TEXT = "<package%s><name>%s</name><version>%s</version><description>d</description>%s<license>%s</license>%s</package>"
TEXTS = [
    "<package/>",
    "<x/>",
    "nope",
    "<package><name>a</name></package>",
    TEXT % ("", "a b", "1.2.3", PERSON, "BSD", ""),
    TEXT % ("", "A", "1.2.3", PERSON, "BSD", ""),
    TEXT % ("", "a", "1.2", PERSON, "BSD", ""),
    TEXT % ("", "a", "1.2.3", "<maintainer>Ann</maintainer>", "BSD", ""),
    TEXT % ("", "a", "1.2.3", '<maintainer email="x">Ann</maintainer>', "BSD", ""),
    TEXT % ("", "a", "1.2.3", PERSON, "", ""),
    TEXT % ("", "a", "1.2.3", PERSON, "BSD", "<foo/>"),
    TEXT % ("", "a", "1.2.3", PERSON, "BSD", "<name>c</name>"),
    TEXT % ("", "a", "1.2.3", PERSON, "BSD", "<run_depend>a</run_depend>"),
    TEXT % ("", "a", "1.2.3", PERSON, "BSD", '<build_depend foo="1">x</build_depend>'),
    TEXT % ("", "a", "1.2.3", PERSON, "BSD", "<test_depend>x</test_depend><run_depend>x</run_depend>"),
    TEXT % (' format="3"', "a", "1.2.3", PERSON, "BSD", "<depend>r</depend><depend>r</depend>"),
    TEXT % (' format="3"', "a", "1.2.3", PERSON, "BSD", "<run_depend>r</run_depend>"),
    TEXT % (' format="3"', "a", "1.2.3", PERSON, "BSD", '<export><a b="1">t<c/></a></export>'),
    TEXT % (' format="3"', "a", "1.2.3", PERSON, "BSD", "<group_depend>g</group_depend>"),
    TEXT
    % (
        ' format="2"',
        "a",
        "1.2.3",
        PERSON,
        "BSD",
        "<export><metapackage/></export><build_depend>z</build_depend>",
    ),
]
for text in TEXTS:
    warnings = []
    outcome(
        text,
        lambda text=text, warnings=warnings: [
            str(e) for e in parse_package_string(text, "f.xml", warnings=warnings).exports
        ],
    )
    show(warnings)
outcome("no file", lambda: module.parse_package("nope"))

show(package_exists_at("c"), package_exists_at("a"), sorted(find_package_paths(".")))
show(sorted((path, found.name) for path, found in find_packages(".").items()))
show([(path, found.name) for path, found in topological_order(".")])
show([path for path, _ in topological_order(".", blacklisted=["c"])])
show([path for path, _ in topological_order(".", whitelisted=["c"])])
packages = find_packages(".")
outcome("versions", lambda: verify_equal_package_versions([packages["a/b"], packages["m"]]))
show(verify_equal_package_versions([packages["c"], packages["m"]]))
show(order_paths(["/b/x", "/a", "/a/c"], ["/a", "/b"]))
show(
    [
        evaluate_condition(text, {"A": "1"})
        for text in ("$A == 1", '$A == 1 and $B != "x"', "$A==2 or $C>=2", None)
    ]
)
show(Dependency("a") == Dependency("a"), Dependency("a", version_lt="1") == Dependency("a"))
outcome("dependency", lambda: Dependency("a", nope=1))
outcome("package", lambda: Package(nope=1))
show(InvalidPackage("x"), InvalidPackage("x", "p"))

os.chdir("a/b")
show(sorted(generate_distutils_setup(packages=["b"], package_dir={"": "src"}).items()))
outcome("version", lambda: generate_distutils_setup(version="2"))
os.chdir("../../c")
show(sorted(generate_distutils_setup().items()))
os.mkdir("../c2")
with open("../c2/package.xml", "w") as file:
    file.write(PACKAGES["c"])
outcome("two of a name", lambda: find_packages(".."))

MODEL = '<?xml-model href="http://download.ros.org/schema/package_format2.xsd" schematypens="x"?><package/>'
show(
    [
        module.has_ros_schema_reference_string(text)
        for text in (MODEL, "<package/>", "", MODEL.replace("2.xsd", "9.xsd"))
    ]
)
show(module.has_ros_schema_reference("../c2"), module.PACKAGE_MANIFEST_SCHEMA_URLS)
outcome("no file", lambda: module.has_ros_schema_reference("nope"))
for kind in ("bin", "etc", "include", "lib", "libexec", "share"):
    show(kind, getattr(python_setup, f"get_global_{kind}_destination")())
for kind in ("bin", "etc", "include", "lib", "share"):
    show(kind, getattr(python_setup, f"get_package_{kind}_destination")("pack"))
show(
    python_setup.get_package_python_destination("pack").startswith(
        python_setup.get_global_python_destination()
    )
)
