# ruff: noqa: E501, BLE001
"""The steps of roslaunch.substitution_args, called by programs that read launch files themselves."""

import os

import rospkg
from referee import show
from roslaunch import substitution_args

ROOT = os.path.join(os.environ["ROS_HOME"], "substitution")
PACKAGE = "<package format='2'><name>robot</name><version>1.0.0</version><description>d</description><maintainer email='a@b.com'>m</maintainer><license>x</license></package>"
os.makedirs(os.path.join(ROOT, "robot", "scripts"))
for name, text in (
    ("package.xml", PACKAGE),
    ("scripts/run.py", "#!/usr/bin/env python3\n"),
    ("a.yaml", "a: 1\n"),
):
    with open(os.path.join(ROOT, "robot", name), "w") as file:
        file.write(text)
os.chmod(os.path.join(ROOT, "robot", "scripts", "run.py"), 0o755)
os.environ.update(CASE="x", ROS_PACKAGE_PATH="/nowhere")
os.environ.pop("NOPE", None)


def outcome(label, function, *arguments):
    try:
        found = function(*arguments)
    except Exception as error:
        found = f"{type(error).__name__} {str(error).splitlines()[:1]}"
    show(label, str(found).replace(ROOT, "ROOT"))


substitution_args._rospack = rospkg.RosPack(ros_paths=[ROOT])
TEXTS = (
    "", "plain", "a $(env CASE) b", "$(env)", "$(env A B)", "$(env NOPE)", "$(optenv NOPE)", "$(optenv NOPE a b)", "$(optenv)",
    "$(arg a)$(arg a)", "$(arg)", "$(arg a b)", "$(arg zzz)", "$(anon)", "$(anon a b)", "$(dirname)", "$(dirname)/x",
    "$(find robot)", "$(find robot)/a.yaml", "$(find robot)/scripts/run.py b", "$(find robot)/nope/$(arg a).yaml c", "$(find)",
    "$(find robot b)", "$(find nope)", "$(nope)", "$(eval 1 + 1)", "$(eval arg('n') + 1)", "$(eval n + 1)", "$(eval a)",
    "$(eval __import__)", "$(eval find('robot'))", "$(eval env('NOPE'))", "$(eval optenv('NOPE', 3) + 1)", "$(eval pi > 3)",
    "$(eval true and not false)", "$(eval nope)", "$(eval 1 +)", "$(eval dirname())", "a$(eval 1)", "$()", "$( env CASE)", "$$(env CASE)",
    "$(env $(arg a))", "$(env (CASE))", "$(env CASE", "$x(env CASE)", "$((env CASE))", "$ (env CASE)", "(a) $(env CASE) $",
    "$(find robot)/", "$(find robot)\\a.yaml",
)  # fmt: skip
for text in TEXTS:
    for filename in (None, "/a/b/c.launch"):
        context = {"arg": {"a": "1", "n": "4", "list": "[1, 2]"}}
        if filename:
            context["filename"] = filename
        outcome(f"{text!r} {filename}", substitution_args.resolve_args, text, context)
outcome("None", substitution_args.resolve_args, None)
for text in TEXTS:
    outcome(f"collect {text!r}", substitution_args._collect_args, text)
outcome(
    "some",
    substitution_args._resolve_args,
    "$(arg a) $(env CASE)",
    {"arg": {"a": "1"}},
    True,
    {"arg": substitution_args._arg},
)
for name in ("_env", "_optenv", "_anon", "_dirname", "_arg", "_find"):
    function = getattr(substitution_args, name)
    for words in ([], ["CASE"], ["a"], ["robot"], ["a", "b"]):
        resolved = f"[$({' '.join(['v', *words])})]"
        if name != "_anon" or len(words) != 1:
            context = {"arg": {"a": "1"}, "filename": "/a/b.launch"}
            outcome(f"{name} {words}", function, resolved, resolved[3:-2], words, context)
for words in (["robot"], ["robot", "scripts/run.py"], ["robot", "a.yaml"], ["nope", "a.yaml"]):
    for name in ("_find_executable", "_find_resource"):
        outcome(f"{name} {words}", getattr(substitution_args, name), "[$(v)]", "v", words, {})
anons = {}
first = substitution_args._eval_anon("a", anons)
show(first == substitution_args._eval_anon("a", anons), list(anons), first.startswith("a_"))
show(
    substitution_args._eval_arg("a", {"a": 1}),
    substitution_args._eval_optenv("NOPE"),
    substitution_args._eval_dirname("/a/b.c"),
)
show(substitution_args._split_command("a $(x y) b", "x y"), substitution_args._separate_first_path("a b c"))
show(substitution_args._separate_first_path("a"), substitution_args._sanitize_path("a/b\\c"))
show(substitution_args._get_executable_path(ROOT, "robot/a.yaml"))
show(
    substitution_args._get_rospack() is substitution_args._rospack,
    substitution_args._eval_find("robot") == os.path.join(ROOT, "robot"),
)
show(sorted(set(substitution_args._eval_dict) & {"env", "optenv", "find", "pi", "true", "True", "arg"}))
wrapper = substitution_args._DictWrapper({"a": "1.5", "pi": "3"}, substitution_args._eval_dict)
show(wrapper["a"], wrapper["true"])
