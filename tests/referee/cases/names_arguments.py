"""The arguments of a node's command line: special keys, private parameters and their types."""

import rospy
from referee import outcome, show

VALUES = {
    "integer": "5", "negative": "-3", "float": "1.5", "exponent": "1e3", "dotted": "1.0e3", "text": "word", "quoted": "'5'",
    "true": "true", "yes": "yes", "on": "on", "none": "null", "tilde": "~", "empty": "", "list": "[1, two, 3.0]",
    "dictionary": "{a: 1, b: {c: d}}", "hexadecimal": "0x10", "octal": "010", "colon": "a:b", "spaces": " x y ",
    "sexagesimal": "1:30", "date": "2020-01-01", "broken": "[1,", "infinity": ".inf", "number sign": "a #b",
}  # fmt: skip
argv = ["prog", "x:=y", "__name:=given", "a:=/b"]
good = {
    key: value
    for key, value in VALUES.items()
    if key not in ("none", "tilde", "date", "broken", "number sign")
}
rospy.init_node(
    "case",
    argv=[
        *argv,
        *(f"_{key}:={value}" for key, value in good.items()),
        "_deep/er:=1",
        "_:=nothing",
        "__unknown:=1",
    ],
)
show(rospy.get_name(), rospy.get_namespace())
outcome("resolve x", lambda: rospy.resolve_name("x"))
outcome("resolve a", lambda: rospy.resolve_name("a"))
outcome("resolve ~x", lambda: rospy.resolve_name("~x"))
for key in good:
    outcome(key, lambda key=key: rospy.get_param("~" + key, "not there"))
outcome("deep", lambda: rospy.get_param("~deep"))
outcome("all", lambda: sorted(name for name in rospy.get_param_names() if "given" in name))
