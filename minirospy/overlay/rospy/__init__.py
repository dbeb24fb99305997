"""rospy, provided by minirospy."""

from minirospy.client import DEBUG as DEBUG
from minirospy.client import ERROR as ERROR
from minirospy.client import FATAL as FATAL
from minirospy.client import INFO as INFO
from minirospy.client import WARN as WARN
from minirospy.client import AnyMsg as AnyMsg
from minirospy.client import Duration as Duration
from minirospy.client import Message as Message
from minirospy.client import Publisher as Publisher
from minirospy.client import Rate as Rate
from minirospy.client import ROSException as ROSException
from minirospy.client import ROSInitException as ROSInitException
from minirospy.client import ROSInternalException as ROSInternalException
from minirospy.client import ROSSerializationException as ROSSerializationException
from minirospy.client import Service as Service
from minirospy.client import ServiceException as ServiceException
from minirospy.client import ServiceProxy as ServiceProxy
from minirospy.client import SubscribeListener as SubscribeListener
from minirospy.client import Subscriber as Subscriber
from minirospy.client import Time as Time
from minirospy.client import Timer as Timer
from minirospy.client import TransportException as TransportException
from minirospy.client import TransportInitError as TransportInitError
from minirospy.client import TransportTerminated as TransportTerminated
from minirospy.client import delete_param as delete_param
from minirospy.client import get_caller_id as get_caller_id
from minirospy.client import get_name as get_name
from minirospy.client import get_namespace as get_namespace
from minirospy.client import get_node_uri as get_node_uri
from minirospy.client import get_param as get_param
from minirospy.client import get_param_cached as get_param_cached
from minirospy.client import get_param_names as get_param_names
from minirospy.client import get_published_topics as get_published_topics
from minirospy.client import get_rostime as get_rostime
from minirospy.client import get_time as get_time
from minirospy.client import has_param as has_param
from minirospy.client import init_node as init_node
from minirospy.client import is_shutdown as is_shutdown
from minirospy.client import logdebug as logdebug
from minirospy.client import logdebug_once as logdebug_once
from minirospy.client import logdebug_throttle as logdebug_throttle
from minirospy.client import logdebug_throttle_identical as logdebug_throttle_identical
from minirospy.client import logerr as logerr
from minirospy.client import logerr_once as logerr_once
from minirospy.client import logerr_throttle as logerr_throttle
from minirospy.client import logerr_throttle_identical as logerr_throttle_identical
from minirospy.client import logfatal as logfatal
from minirospy.client import logfatal_once as logfatal_once
from minirospy.client import logfatal_throttle as logfatal_throttle
from minirospy.client import logfatal_throttle_identical as logfatal_throttle_identical
from minirospy.client import loginfo as loginfo
from minirospy.client import loginfo_once as loginfo_once
from minirospy.client import loginfo_throttle as loginfo_throttle
from minirospy.client import loginfo_throttle_identical as loginfo_throttle_identical
from minirospy.client import logout as logout
from minirospy.client import logwarn as logwarn
from minirospy.client import logwarn_once as logwarn_once
from minirospy.client import logwarn_throttle as logwarn_throttle
from minirospy.client import logwarn_throttle_identical as logwarn_throttle_identical
from minirospy.client import myargv as myargv
from minirospy.client import on_shutdown as on_shutdown
from minirospy.client import remap_name as remap_name
from minirospy.client import resolve_name as resolve_name
from minirospy.client import search_param as search_param
from minirospy.client import set_param as set_param
from minirospy.client import signal_shutdown as signal_shutdown
from minirospy.client import sleep as sleep
from minirospy.client import spin as spin
from minirospy.client import wait_for_message as wait_for_message
from minirospy.client import wait_for_service as wait_for_service
from minirospy.client.lifecycle import ROSInterruptException as ROSInterruptException
from minirospy.client.messages import Header as Header
from minirospy.client.time import ROSTimeMovedBackwardsException as ROSTimeMovedBackwardsException
from minirospy.ros.rospy.rospy import live as _live  # after the modules that it completes
from minirospy.ros.rospy.rospy.core import get_ros_root as get_ros_root
from minirospy.ros.rospy.rospy.core import parse_rosrpc_uri as parse_rosrpc_uri
from minirospy.ros.rospy.rospy.msproxy import MasterProxy as MasterProxy
from minirospy.ros.rospy.rospy.msproxy import get_master as get_master
from rospy import client as client
from rospy import core as core
from rospy import exceptions as exceptions
from rospy import impl as impl
from rospy import msg as msg
from rospy import msproxy as msproxy
from rospy import names as names
from rospy import rostime as rostime
from rospy import service as service
from rospy import timer as timer
from rospy import topics as topics

__all__ = [
    "DEBUG", "ERROR", "FATAL", "INFO", "WARN", "AnyMsg", "Duration", "Header", "MasterProxy", "Message", "Publisher",
    "ROSException", "ROSInitException", "ROSInternalException", "ROSInterruptException", "ROSSerializationException",
    "ROSTimeMovedBackwardsException", "Rate", "Service", "ServiceException", "ServiceProxy", "SubscribeListener",
    "Subscriber", "Time", "Timer", "TransportException", "TransportInitError", "TransportTerminated", "delete_param",
    "get_caller_id", "get_master", "get_name", "get_namespace", "get_node_uri", "get_param", "get_param_cached",
    "get_param_names", "get_published_topics", "get_ros_root", "get_rostime", "get_time", "has_param", "init_node",
    "is_shutdown", "logdebug", "logdebug_once", "logdebug_throttle", "logdebug_throttle_identical", "logerr",
    "logerr_once", "logerr_throttle", "logerr_throttle_identical", "logfatal", "logfatal_once", "logfatal_throttle",
    "logfatal_throttle_identical", "loginfo", "loginfo_once", "loginfo_throttle", "loginfo_throttle_identical",
    "logout", "logwarn", "logwarn_once", "logwarn_throttle", "logwarn_throttle_identical", "myargv", "on_shutdown",
    "parse_rosrpc_uri", "remap_name", "resolve_name", "search_param", "set_param", "signal_shutdown", "sleep", "spin",
    "wait_for_message", "wait_for_service",
]  # fmt: skip
