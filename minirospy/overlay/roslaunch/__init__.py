"""roslaunch, provided by minirospy."""

from minirospy.base.environment import DEFAULT_MASTER_PORT
from minirospy.ros.roslaunch.roslaunch import NAME, configure_logging, main, write_pid_file
from minirospy.ros.roslaunch.roslaunch.config import ROSLaunchConfig
from minirospy.ros.roslaunch.roslaunch.core import Master, Node, RLException, Test
from minirospy.ros.roslaunch.roslaunch.launch import ROSLaunchRunner
from minirospy.ros.roslaunch.roslaunch.pmon import Process
from minirospy.ros.roslaunch.roslaunch.scriptapi import ROSLaunch
from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlLoader, XmlParseException
from roslaunch import arg_dump as arg_dump
from roslaunch import config as config
from roslaunch import core as core
from roslaunch import core as roslaunch_core
from roslaunch import depends as depends
from roslaunch import launch as launch
from roslaunch import loader as loader
from roslaunch import node_args as node_args
from roslaunch import nodeprocess as nodeprocess
from roslaunch import param_dump as param_dump
from roslaunch import parent as parent
from roslaunch import pmon as pmon
from roslaunch import rlutil as rlutil
from roslaunch import scriptapi as scriptapi
from roslaunch import server as server
from roslaunch import substitution_args as substitution_args
from roslaunch import xmlloader as xmlloader

__all__ = [
    "DEFAULT_MASTER_PORT",
    "NAME",
    "Master",
    "Node",
    "Process",
    "RLException",
    "ROSLaunch",
    "ROSLaunchConfig",
    "ROSLaunchRunner",
    "Test",
    "XmlLoader",
    "XmlParseException",
    "configure_logging",
    "main",
    "roslaunch_core",
    "write_pid_file",
]
