"""Modules of 2010, before genmsg and rospkg: roslib.msgs, roslib.names, roslib.stacks in old programs."""

import os

import roslib.msgs
import roslib.names
from referee import outcome, printed, show
from roslib.msgs import Constant, Field, MsgSpec, load_from_string

os.environ["ROS_ROOT"] = "/nowhere"  # real roslib needs it

show("# types")
for type_ in (
    "int32",
    "int32[]",
    "string[4]",
    "a/B[]",
    "a[1][2]",
    "a[x]",
    "",
    "Header",
    "time",
    "a b",
    "a[",
    "a[]]",
    "roslib/Header",
):
    for function in (
        roslib.msgs.parse_type,
        roslib.msgs.base_msg_type,
        roslib.msgs.is_valid_msg_type,
        roslib.msgs.is_builtin,
        roslib.msgs.is_header_type,
        roslib.msgs.is_valid_constant_type,
        roslib.msgs.is_valid_msg_field_name,
    ):
        outcome(f"{function.__name__} {type_!r}", lambda f=function, t=type_: f(t))
    outcome(f"resolve {type_!r}", lambda t=type_: roslib.msgs.resolve_type(t, "pkg"))
outcome("base of None", lambda: roslib.msgs.base_msg_type(None))
show(
    roslib.msgs.SEP,
    roslib.msgs.EXT,
    roslib.msgs.CONSTCHAR,
    roslib.msgs.COMMENTCHAR,
    roslib.msgs.TIME_MSG,
    roslib.msgs.DURATION_MSG,
)
show(roslib.msgs.PRIMITIVE_TYPES, roslib.msgs.BUILTIN_TYPES, roslib.msgs.RESERVED_TYPES)

show("# definitions")
TEXTS = [
    "int32 a\nstring b # comment\n\n# only a comment\n",
    "Header header\nint32 HIGH=5\nstring WORD= hello # world \nbool ON=True\nfloat32 PI=3.14",
    "int8 A=200",
    "uint8 A=-1",
    "char A=255",
    "byte A=-128",
    "float64 A=x",
    "string=1",
    "Foo A=1",
    "int32",
    "int32 a b",
    "int32 a\nint32 a",
    "int32 2a",
    "a*b c",
    "Other other\nOther[3] others\nother/Thing thing",
    "int32 A=1=2",
    "string A=1=2",
    "bool OFF=0",
    "",
]
for text in TEXTS:
    for package in ("", "pkg"):
        outcome(f"{text!r} {package}", lambda t=text, p=package: load_from_string(t, p))
spec = load_from_string(TEXTS[1], "pkg", "pkg/Name", "Name")
show(
    spec.types,
    spec.names,
    spec.constants,
    spec.full_name,
    spec.short_name,
    spec.package,
    spec.has_header(),
    spec.fields(),
)
show(
    spec.parsed_fields(),
    [each.is_header for each in spec.parsed_fields()],
    [each.val for each in spec.constants],
)
show(spec == load_from_string(TEXTS[1], "pkg"), spec != load_from_string("", "pkg"), spec == 5)
outcome("field", lambda: vars(Field("a", "std_msgs/Header[3]")))
outcome("constant", lambda: Constant("int32", " a ", 5, "5"))
outcome("equal", lambda: Constant("int32", "a", 5, "5") == Constant("int32", "a", 5, "0x5"))
outcome("no constant", lambda: Constant("int32", "a", None, "5"))
outcome("spec", lambda: MsgSpec(["int32"], ["a"], [], ""))
outcome("twice", lambda: MsgSpec(["int32", "int8"], ["a", "a"], [], ""))

show("# files")
outcome("name", lambda: os.path.basename(roslib.msgs.msg_file("std_msgs", "Nope")))
outcome("no package", lambda: type(roslib.msgs.load_by_type("nope/Nope")))
outcome("type", lambda: roslib.msgs.load_by_type("geometry_msgs/Pose"))
outcome("type", lambda: roslib.msgs.load_by_type("Pose", "geometry_msgs"))
for name, content in (("Good.msg", "int32 a\n"), ("Bad.msg", "int32\n"), ("a-b.msg", "")):
    with open(name, "w") as stream:
        stream.write(content)
    outcome(name, lambda n=name: roslib.msgs.load_from_file(n))
    outcome(name, lambda n=name: roslib.msgs.load_from_file(n, "pkg/"))

show("# registered")
roslib.msgs.reinit()
show(sorted(roslib.msgs.REGISTERED_TYPES))
outcome("not yet", lambda: roslib.msgs.get_registered("geometry_msgs/Pose"))
roslib.msgs.load_package("geometry_msgs")
show(
    roslib.msgs.is_registered("Pose"),
    roslib.msgs.is_registered("geometry_msgs/Pose"),
    roslib.msgs.is_registered("Nope"),
)
outcome("text", lambda: str(roslib.msgs.get_registered("geometry_msgs/PoseStamped")))
outcome("in package", lambda: roslib.msgs.get_registered("Pose", "geometry_msgs"))
outcome("not in package", lambda: roslib.msgs.get_registered("Nope", "geometry_msgs"))
roslib.msgs.set_verbose(True)
show(roslib.msgs.is_verbose())
printed("verbose", lambda: roslib.msgs.register("x", spec))
printed("verbose", lambda: roslib.msgs.load_package("geometry_msgs"))
roslib.msgs.set_verbose(False)
outcome("specs", lambda: sorted(name for name, _ in roslib.msgs.get_pkg_msg_specs("geometry_msgs")[0])[:3])

show("# names")
for word in ("a", "a/b", "/a", "a//b", "1a", "a1_", "", "~a", "a-b"):
    show(
        word,
        [
            bool(getattr(roslib.names, f"{kind}_LEGAL_CHARS_P").match(word))
            for kind in ("NAME", "BASE_NAME", "RESOURCE_NAME", "BASE_RESOURCE_NAME")
        ],
    )
outcome("text", lambda: [roslib.names.isstring(each) for each in ("a", b"a", 5)])
