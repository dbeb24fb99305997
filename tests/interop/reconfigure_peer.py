"""A dynamic_reconfigure server or client on rospy or minirospy. ``sys.argv[2]`` is the folder of lamp.cfg.LampConfig.

serve    offer the configuration as /lamp/; print each callback call, until stdin is closed
change   change the configuration in many ways, print the responses, and exit
"""

import sys
import threading

sys.path.append(sys.argv[2])

import dynamic_reconfigure
import rospy
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.server import Server
from lamp.cfg import LampConfig


def say(*words):
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def shown(config):
    """Return the values sorted by name, and the states of the groups."""
    if config is None:
        return None
    values = {name: value for name, value in sorted(config.items()) if name != "groups"}
    return values, states(config.get("groups"))


def states(group):
    if not group:
        return None
    inner = {name: states(each) for name, each in sorted(group["groups"].items())}
    return (
        group["name"],
        group["state"],
        {name: value for name, value in sorted(group.items()) if name in LampConfig.defaults},
        inner,
    )


def serve():
    def callback(config, level):
        say("callback", level, *shown(config)[:1])
        if config["power"] == 13:
            raise ValueError("unlucky")
        if config.mode == 2:
            config.brightness = 0.75
        return config

    rospy.set_param("~angle", 100.0)
    rospy.set_param("~power", -5)
    rospy.set_param("~label", "from the parameter server")
    server = Server(LampConfig, callback)
    say("ready", sorted(rospy.get_param("~").items()))
    say(shown(server.config)[0])
    sys.stdin.readline()
    say("updated", shown(server.update_configuration({"power": 33, "brightness": 7.0}))[0])
    sys.stdin.read()


def change():
    client = Client("/lamp", timeout=150)
    say("configuration", shown(client.get_configuration(timeout=150)))
    for each in client.get_parameter_descriptions(timeout=150):
        say([each[key] for key in ("name", "min", "max", "default", "type", "level", "description")])
    news = threading.Event()
    client.set_config_callback(lambda config: news.set())
    for changes in (
        {"brightness": 0.25},
        {"brightness": 5, "power": 1000, "angle": -7},
        {"power": "17", "is_on": "false", "label": 5},
        {"mode": "blink"},
        {"mode": "Morse", "is_on": 1},
        {"mode": 0.9},
        {"color": "green", "noise": "yes", "hue": "0.125"},
        {},
        {"nothing": 1},
        {"power": "many"},
        {"power": 13},
        {"power": 15},
    ):
        try:
            say(changes, "->", shown(client.update_configuration(dict(changes))))
        except dynamic_reconfigure.DynamicReconfigureException as error:
            say(changes, "raises", type(error).__name__, error)
    say("heard", news.wait(150))
    say("parameters", sorted(rospy.get_param("/lamp").items()))
    say(
        dynamic_reconfigure.find_reconfigure_services(),
        sorted(dynamic_reconfigure.get_parameter_names(LampConfig)),
    )
    client.close()


rospy.init_node("lamp" if sys.argv[1] == "serve" else "switch", argv=[])
{"serve": serve, "change": change}[sys.argv[1]]()
