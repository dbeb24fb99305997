"""genmsg in programs that generate code from definitions, or compare types."""

import os

import genmsg
import genmsg.gentools
import genmsg.msg_loader
import genmsg.msgs
import rospkg
from referee import outcome, show

msgs = genmsg.msgs
rospack = rospkg.RosPack()
packages = ("std_msgs", "geometry_msgs", "sensor_msgs", "std_srvs")
messages = {name: [os.path.join(rospack.get_path(name), "msg")] for name in packages}
services = {name: [os.path.join(rospack.get_path(name), "srv")] for name in packages}
context = genmsg.MsgContext.create_default()


def kind(label, call):
    """Print a call's result, or the type of its exception."""
    try:
        show(label, "gives", repr(call()))
    except Exception as error:  # noqa: BLE001 - whatever it is
        show(label, "raises", type(error).__name__)


show("# types")
for name in (
    "int32", "int32[]", "uint8[4]", "foo/Bar[]", "Header", "roslib/Header", "std_msgs/Header", "time", "string[5]",
    "a[x]", "", "a[3][4]", "string[",
):  # fmt: skip
    outcome(f"parse {name}", lambda n=name: msgs.parse_type(n))
    show(
        msgs.bare_msg_type(name), msgs.is_builtin(name), msgs.is_header_type(name), msgs.is_valid_msg_type(name),
        msgs.is_valid_constant_type(name), msgs.resolve_type(name, "pkg"),
    )  # fmt: skip
show(msgs.PRIMITIVE_TYPES, msgs.BUILTIN_TYPES[-2:], msgs.HEADER, msgs.TIME_MSG, msgs.HEADER_FULL_NAME)

show("# a text")
text = "int32 X=5\nstring S=a b # c\nHeader header\nfloat32[] a\nstring[3] b\nfoo/Bar c\nBaz d # comment\n"
spec = genmsg.msg_loader.load_msg_from_string(context, text, "my/Thing")
show(
    spec.full_name,
    spec.package,
    spec.short_name,
    spec.types,
    spec.names,
    spec.has_header(),
    spec.header_present,
)
show([(c.name, c.type, c.val, c.val_text) for c in spec.constants], spec.constants)
show(spec.fields(), spec.parsed_fields())
field = spec.parsed_fields()[2]
show(
    field.name,
    field.type,
    field.base_type,
    field.is_array,
    field.array_len,
    field.is_header,
    field.is_builtin,
)
show(repr(spec), str(spec) == text, spec.text == text, context.is_registered("my/Thing[]"))
service = genmsg.msg_loader.load_srv_from_string(context, "bool a\n---\nint8 b\n", "my/Srv")
show(repr(service), service.full_name, service.short_name, service.package)
show(
    service.request.full_name, service.response.types, repr(service.request.text), repr(service.response.text)
)

show("# files")
for name in ("geometry_msgs/PoseStamped", "std_msgs/String", "Header", "sensor_msgs/JointState"):
    found = genmsg.load_msg_by_type(context, name, messages)
    genmsg.load_depends(context, found, messages)
    show(found.full_name, genmsg.compute_md5(context, found), repr(genmsg.compute_md5_text(context, found)))
    show(os.path.basename(context.get_file(found.full_name)), context.get_depends(found.full_name))
    show(context.get_all_depends(found.full_name))
    whole = genmsg.gentools.compute_full_text(context, found)
    show([line for line in whole.splitlines() if line.startswith(("MSG:", "="))])
found = genmsg.load_srv_by_type(context, "std_srvs/SetBool", services)
genmsg.load_depends(context, found, messages)
show(genmsg.compute_md5(context, found), found.request.names, found.response.names)
nested = genmsg.msg_loader.load_srv_from_string(context, "geometry_msgs/Pose p\n---\nHeader h\n", "my/Nested")
genmsg.load_depends(context, nested, messages)
show(genmsg.compute_md5(context, nested))
show(os.path.basename(genmsg.msg_loader.get_msg_file("std_msgs", "Bool", messages)))

show("# what is not there")
load = genmsg.msg_loader.load_msg_from_string
for label, call in (
    ("registered", lambda: context.get_registered("no/Such")),
    ("depends", lambda: context.get_depends("no/Such")),
    ("all depends", lambda: context.get_all_depends("no/Such")),
    ("file", lambda: context.get_file("no/Such")),
    ("package", lambda: genmsg.load_msg_by_type(context, "no/Such", messages)),
    ("type", lambda: genmsg.load_msg_by_type(context, "std_msgs/Such", messages)),
    ("no package", lambda: genmsg.load_msg_by_type(context, "Such", messages)),
    ("field", lambda: load(context, "int32 1a\n", "my/Bad")),
    ("constant", lambda: load(context, "int32 X=a\n", "my/Bad")),
    ("needed", lambda: genmsg.load_depends(context, load(context, "nope/X a\n", "my/D"), messages)),
    ("md5", lambda: genmsg.compute_md5(context, load(context, "nope/X a\n", "my/D"))),
    ("no file", lambda: genmsg.msg_loader.load_msg_from_file(context, "/nope.msg", "a/B")),
):
    kind(label, call)
