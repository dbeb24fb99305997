"""genmsg: loads message and service definitions for code generators."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.genmsg.genmsg import base as base
    from minirospy.ros.genmsg.genmsg import command_line as command_line
    from minirospy.ros.genmsg.genmsg import deps as deps
    from minirospy.ros.genmsg.genmsg import gentools as gentools
    from minirospy.ros.genmsg.genmsg import msg_loader as msg_loader
    from minirospy.ros.genmsg.genmsg import msgs as msgs
    from minirospy.ros.genmsg.genmsg import names as names
    from minirospy.ros.genmsg.genmsg import srvs as srvs
    from minirospy.ros.genmsg.genmsg.base import (
        EXT_MSG,
        EXT_SRV,
        MSG_DIR,
        SEP,
        SRV_DIR,
        InvalidMsgSpec,
        MsgGenerationException,
    )
    from minirospy.ros.genmsg.genmsg.gentools import compute_full_text, compute_md5, compute_md5_text
    from minirospy.ros.genmsg.genmsg.msg_loader import (
        MsgContext,
        MsgNotFound,
        load_depends,
        load_msg_by_type,
        load_srv_by_type,
    )
    from minirospy.ros.genmsg.genmsg.msgs import DURATION, HEADER, TIME, Constant, Field, MsgSpec
    from minirospy.ros.genmsg.genmsg.names import (
        is_legal_resource_base_name,
        is_legal_resource_name,
        package_resource_name,
        resource_name,
        resource_name_base,
        resource_name_package,
    )
    from minirospy.ros.genmsg.genmsg.srvs import SrvSpec

__all__ = [
    "DURATION",
    "EXT_MSG",
    "EXT_SRV",
    "HEADER",
    "MSG_DIR",
    "SEP",
    "SRV_DIR",
    "TIME",
    "Constant",
    "Field",
    "InvalidMsgSpec",
    "MsgContext",
    "MsgGenerationException",
    "MsgNotFound",
    "MsgSpec",
    "SrvSpec",
    "compute_full_text",
    "compute_md5",
    "compute_md5_text",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "load_depends",
    "load_msg_by_type",
    "load_srv_by_type",
    "package_resource_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
]
