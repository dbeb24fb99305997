"""genmsg's error messages for invalid definitions, and genmsg.deps: the files on which a definition depends."""

import os

import genmsg
import genmsg.command_line
import genmsg.deps
import genmsg.msg_loader as loader
import genmsg.msgs as msgs
from genmsg import InvalidMsgSpec, MsgContext
from referee import outcome, show

HOME = os.environ["ROS_HOME"]


def write(path, text):
    path = os.path.join(HOME, path)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(text)
    return path


def bare(paths):
    return sorted(str(each).replace(HOME, "") for each in paths)


for text in (
    "int32",
    "int32 ",
    "int32 x y",
    "int32 1a",
    "int32 a-b",
    "int32 _a",
    "int32 a;",
    "int8 A=128",
    "uint8 A=-1",
    "uint8 A=1.5",
    "int32 A=",
    "float32 A=x",
    "float32 A=",
    "char A=-5",
    "time A=5",
    "Header A=5",
    "int32[] A=5",
    "a/B A=1",
    "int32[-1] a",
    "int32[a] a",
    "int32[3][] a",
    "int32[ ] a",
    "int32 [] a",
    "[3] a",
    "int32[3 a",
    "/Foo x",
    "int32 a\nint32 a",
    "int32 a # comment\n  int32 b c # comment",
    "---",
):
    outcome(
        ("message", text), lambda t=text: loader.load_msg_from_string(MsgContext.create_default(), t, "a/B")
    )
for text in (
    "int32 a\n --- \nint32 b",
    "int32 a ---\nint32 b",
    "int32 1\n---\n",
    "---\nint8 A=300",
    "---\nx",
):
    outcome(
        ("service", text), lambda t=text: loader.load_srv_from_string(MsgContext.create_default(), t, "a/B")
    )
for name in ("a/b/c", "a/b/c/d"):
    outcome(name, lambda n=name: loader.load_msg_from_string(MsgContext.create_default(), "int32 x", n))
    outcome(name, lambda n=name: loader.load_msg_by_type(MsgContext.create_default(), n, {}))
    outcome(name, lambda n=name: loader.load_srv_by_type(MsgContext.create_default(), n, {}))
outcome("twice", lambda: msgs.MsgSpec(["int8", "int8"], ["a", "a"], [], "", "a/B"))
show([msgs.is_valid_msg_type(name) for name in ("a/B", "a//b", "a/B[]", "int32[2]", "/a", "a b")])
show(genmsg.command_line.includepath_to_dict(None))

header = write("std_msgs/msg/Header.msg", "uint32 seq\ntime stamp\nstring frame_id\n")
whole = write("a/msg/Whole.msg", "Header header\nPart[] parts\nb/Other other\n")
write("a/msg/Part.msg", "Small small\n")
write("a/msg/Small.msg", "int8 x\n")
write("b/msg/Other.msg", "float32 f\n")
bad = write("a/msg/Bad.msg", "int32 1\n")
lacking = write("a/msg/Lacking.msg", "Nowhere n\n")
service = write("a/srv/Do.srv", "Part part\n---\nb/Other other\nHeader h\n")
path = {name: [os.path.join(HOME, name, "msg")] for name in ("a", "b", "std_msgs")}
show(bare(genmsg.deps.find_msg_dependencies("a", whole, path)))
show(bare(genmsg.deps.find_msg_dependencies_with_type("a", whole, path)))
show(bare(genmsg.deps.find_srv_dependencies("a", service, path)))
show(bare(genmsg.deps.find_srv_dependencies_with_type("a", service, path)))
show(genmsg.deps.find_msg_dependencies("std_msgs", header, path))
for file in (bad, lacking):
    try:
        genmsg.deps.find_msg_dependencies("a", file, path)
    except (InvalidMsgSpec, loader.MsgNotFound) as error:
        show(type(error).__name__, str(error).replace(HOME, ""))
