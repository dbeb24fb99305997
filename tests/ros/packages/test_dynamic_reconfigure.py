"""dynamic_reconfigure: faults for which ROS prints a traceback, and deliberate differences from ROS."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from dynamic_reconfigure.encoding import (
    Config,
    decode_config,
    decode_description,
    encode_config,
    encode_description,
    get_parents,
    get_tree,
    initial_config,
)
from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription, Group, GroupState

ROOT = Path(__file__).parents[3]
DYNPARAM = ROOT / "msgs" / "dynamic_reconfigure" / "scripts" / "dynparam"

LAMP = """
import sys
from types import SimpleNamespace
import rospy
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, GroupState, IntParameter, StrParameter
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import Reconfigure

def parameter(name, type, default, min, max, edit_method=""):
    return {"name": name, "type": type, "default": default, "min": min, "max": max, "level": 1, "description": "",
            "edit_method": edit_method}

parameters = [
    parameter("power", "int", 20, 0, 60, "__import__('os')._exit(7)"), parameter("angle", "double", 0.5, -1.0, 1.0),
    parameter("is_on", "bool", True, False, True), parameter("label", "str", "lamp", "", ""),
]
inner = {"name": "inner", "type": "", "state": True, "id": 1, "parent": 0, "parameters": [], "groups": []}
second = {**inner, "name": "second", "id": 2, "state": False}
lamp = SimpleNamespace(
    defaults={each["name"]: each["default"] for each in parameters},
    min={each["name"]: each["min"] for each in parameters},
    max={each["name"]: each["max"] for each in parameters},
    config_description={"name": "Default", "type": "", "state": True, "id": 0, "parent": 0,
                        "parameters": parameters, "groups": [inner, second]},
)
rospy.init_node("lamp", argv=[])

def failure(call):
    try:
        return call()
    except Exception as error:
        return f"{type(error).__name__}: {error}"
"""


def run(body: str) -> list[str]:
    """Run a program with the configuration of a lamp; return its output lines."""
    done = subprocess.run(
        [sys.executable, "-c", LAMP + body], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_values_on_the_parameter_server_that_do_not_fit_are_reported(master: str) -> None:
    (line,) = run(
        "rospy.set_param('~power', 'much'); rospy.set_param('~angle', 1); rospy.set_param('~is_on', 0)\n"
        "rospy.set_param('~label', 5)\n"
        "config = Server(lamp, lambda config, level: config).config\n"
        "print(config.power, config.angle, config.is_on, config.label, rospy.get_param('~power'))\n"
    )
    assert line == "20 1.0 False lamp 20"


def test_callback_without_a_configuration_leaves_the_server_usable(master: str) -> None:
    lines = run(
        "server = Server(lamp, lambda config, level: config if config.power != 13 else None)\n"
        "client = Client('lamp', timeout=30)\n"
        "for power in (13, 14): print(failure(lambda: client.update_configuration({'power': power})['power']))\n"
        "print(failure(lambda: Server(lamp, lambda config, level: None, 'other')))\n"
    )
    text = "DynamicReconfigureCallbackException: Reconfigure callback should return a possibly updated configuration."
    assert lines == ["DynamicReconfigureCallbackException: service call failed", "14", text]


def test_request_with_values_of_other_types_is_refused_in_one_line(master: str) -> None:
    lines = run(
        "server = Server(lamp, lambda config, level: config)\n"
        "call = rospy.ServiceProxy('~set_parameters', Reconfigure)\n"
        "print(failure(lambda: call(Config(strs=[StrParameter('power', 'x')]))))\n"
        "print(failure(lambda: call(Config(doubles=[DoubleParameter('power', 1.5)]))))\n"
        "print(call(Config(ints=[IntParameter('angle', 1)], bools=[BoolParameter('is_on', False)])).config.doubles[0].value)\n"
    )
    assert "can't set parameter 'power' of type int to 'x'" in lines[0]
    assert "can't set parameter 'power' of type int to 1.5" in lines[1]
    assert lines[2] == "1.0"


def test_states_of_groups_can_be_set(master: str) -> None:
    lines = run(
        "server = Server(lamp, lambda config, level: config)\n"
        "print([group['state'] for group in server.config['groups']['groups'].values()])\n"
        "client = Client('lamp', timeout=30)\n"
        "groups = client.update_configuration({'groups': {'inner': False, 'second': True}})['groups']['groups']\n"
        "print([(name, group['state']) for name, group in groups.items()])\n"
    )
    assert lines == ["[True, False]", "[('inner', False), ('second', True)]"]


def test_text_of_an_enum_is_not_executed(master: str) -> None:
    lines = run(
        "server = Server(lamp, lambda config, level: config)\n"
        "print(Client('lamp', timeout=30).update_configuration({'power': '7'})['power'])\n"
    )
    assert lines == ["7"]


def test_server_that_has_left_is_an_error_of_the_client(master: str) -> None:
    lines = run(
        "server = Server(lamp, lambda config, level: config)\n"
        "client = Client('lamp', timeout=30)\n"
        "client.get_configuration(timeout=30)\n"
        "server.set_service.shutdown()\n"
        "print(failure(lambda: client.update_configuration({'power': 1})))\n"
        "print(failure(lambda: Client('nobody', timeout=0.2)))\n"
    )
    assert lines[0] == "DynamicReconfigureCallbackException: service call failed"
    assert lines[1].startswith(
        "ROSException: timeout exceeded while waiting for service /nobody/set_parameters"
    )


@pytest.mark.parametrize(
    ("namespace", "names"),
    [
        ("", "/lamp"),
        ("~", "/lamp"),
        ("arm", "/lamp/arm"),
        ("~arm/", "/lamp/arm"),
        ("/arm", "/arm"),
        ("/a//b", "/a/b"),
    ],
)
def test_namespace_of_a_server(namespace: str, names: str, master: str) -> None:
    (line,) = run(
        "from dynamic_reconfigure import find_reconfigure_services\n"
        f"server = Server(lamp, lambda config, level: config, {namespace!r})\n"
        f"print(find_reconfigure_services(), rospy.get_param('{names}/power'))\n"
    )
    assert line == f"['{names}'] 20"


# --- encoding


def test_a_config_is_copied_and_pickled() -> None:
    config = Config(a=1, groups=Config(name="Default"))
    config.b = 2
    assert (config["b"], config.groups.name) == (2, "Default")
    for duplicate in (copy.deepcopy(config), pickle.loads(pickle.dumps(config)), config.copy()):
        assert (duplicate, type(duplicate)) == (config, Config)
    assert copy.deepcopy(config).groups is not config.groups
    with pytest.raises(KeyError):
        _ = config.c


def described(*groups: tuple[int, int, str]) -> ConfigDescription:
    return ConfigDescription(groups=[Group(name, "", [], parent, id) for id, parent, name in groups])


@pytest.mark.parametrize(
    "make",
    [
        lambda: decode_description(described((1, 1, "itself"))),
        lambda: decode_description(described((0, 0, "Default"), (1, 2, "a"), (2, 1, "b"))),
        lambda: decode_description(described((0, 0, "Default"), (1, 0, "a"), (1, 1, "b"))),
        lambda: get_tree(ConfigMsg(groups=[GroupState("alone", True, 3, 3)])),
        lambda: decode_config(
            ConfigMsg(groups=[GroupState("alone", True, 3, 3)]), {"parameters": [], "groups": {}}
        ),
        lambda: get_parents({"parent": 1, "id": 1}, {"group": [{"id": 0, "parent": 0}]}),
    ],
)
def test_groups_that_contain_themselves_are_decoded_without_them(make: Callable[[], object]) -> None:
    assert make() is not None


def test_an_empty_description_goes_there_and_back() -> None:
    kind = SimpleNamespace(
        defaults={},
        min={},
        max={},
        config_description={
            "name": "Default",
            "type": "",
            "state": True,
            "id": 0,
            "parent": 0,
            "parameters": [],
            "groups": [],
        },
    )
    tree = decode_description(encode_description(kind))
    assert (tree["name"], tree["parameters"], tree["groups"]) == ("Default", [], {})
    first = initial_config(
        encode_config({"groups": get_tree(encode_description(kind))}), kind.config_description
    )
    assert first["groups"]["state"] is True


# --- dynparam


def dynparam(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(DYNPARAM), *words], capture_output=True, text=True, timeout=100, check=False
    )


def test_dynparam_without_a_master() -> None:
    for words in (["list"], ["get", "lamp"], ["set", "lamp", "a", "1"]):
        done = dynparam(*words)
        assert done.returncode == 1
        assert done.stderr.startswith("ERROR: Unable to communicate with master!\n"), done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        ([], 1, "dynparam <command> -h"),
        (["nonsense"], 1, "dynparam <command> -h"),
        (["get"], 2, "dynparam: error: invalid arguments. Please specify a node name\n"),
        (["get", "a", "b"], 2, "dynparam: error: too many arguments\n"),
        (["dump", "a"], 2, "dynparam: error: invalid arguments. Please specify an output file\n"),
        (["load", "a"], 2, "dynparam: error: invalid arguments. Please specify an input file\n"),
        (["set", "a"], 2, "Please specify either a node name, parameter name and parameter value"),
        (["set", "a", "5"], 2, "'5' is not a YAML dictionary"),
        (["set", "a", "{5"], 2, "the values are not YAML"),
        (["load", "a", "/nowhere/at/all.yaml"], 1, "/nowhere/at/all.yaml: No such file or directory"),
        (["get", "-h"], 0, "Usage: dynparam get [options] node\n"),
    ],
)
def test_dynparam_refuses(words: list[str], status: int, text: str) -> None:
    done = dynparam(*words)
    assert done.returncode == status
    assert text in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
