"""Services that spawn, delete and move models and links, and the topics set_model_state and set_link_state.

Source: http://wiki.ros.org/gazebo_ros, gazebo_msgs. The response to an invalid request has ``success`` false and ROS's text.
"""

from __future__ import annotations

from collections.abc import Callable

from gazebo_msgs import srv
from gazebo_msgs.msg import LinkState, ModelState

from minirospy import client as rospy
from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import Model
from minirospy.core.sdf.poses import compose, difference, rotate
from minirospy.ros.gazebo_ros.frames import WORLD_FRAMES, find_entity, find_link, relative_state
from minirospy.ros.gazebo_ros.messages import pose_of, time_of, to_pose, to_twist, vector_of
from minirospy.ros.gazebo_ros.paths import ResourcePaths
from minirospy.ros.gazebo_ros.physics import SimModel, SimulationError, State
from minirospy.ros.gazebo_ros.server import Server
from minirospy.ros.gazebo_ros.services import Refused, apply, offer, offer_directly, require_link
from minirospy.ros.gazebo_ros.spawning import UnknownPackage, WrongFormat, read_sdf_request, read_urdf_request

__all__ = ["StateServices"]

_NOT_A_MODEL = (
    "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF or URDF, "
    "or cannot be converted to Gazebo compatible format."
)
_WRONG_FORMAT = "SpawnModel: Failure - entity format is invalid."
_UNSCOPED = "did you forget to scope the {} by model name?"

Reader = Callable[[str, str, str, ResourcePaths], Model]


class StateServices:
    """Offers the services for models and for the states of links."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._loop = loop = server.loop
        self._simulation = loop.simulation
        self._queries: dict[str, int] = {}  # number of get_model_state calls per model
        offer(loop, "delete_model", srv.DeleteModel, self._delete_model)
        offer(loop, "get_model_properties", srv.GetModelProperties, self._get_model_properties)
        offer(loop, "get_model_state", srv.GetModelState, self._get_model_state)
        offer(loop, "get_link_state", srv.GetLinkState, self._get_link_state)
        offer(loop, "set_model_state", srv.SetModelState, self._set_model_state)
        offer(loop, "set_model_configuration", srv.SetModelConfiguration, self._set_model_configuration)
        offer(loop, "set_link_state", srv.SetLinkState, self._set_link_state)
        offer_directly("spawn_sdf_model", srv.SpawnModel, self._spawn_sdf_model)
        offer_directly("spawn_urdf_model", srv.SpawnModel, self._spawn_urdf_model)
        rospy.Subscriber("~set_model_state", ModelState, self._on_model_state, queue_size=10)
        rospy.Subscriber("~set_link_state", LinkState, self._on_link_state, queue_size=10)

    # ---- spawning and deleting

    def _spawn_urdf_model(self, request: srv.SpawnModelRequest) -> str:
        try:
            return self._spawn(request, read_urdf_request)
        except WrongFormat:
            rospy.logerr(_WRONG_FORMAT)
            raise rospy.ServiceException(_WRONG_FORMAT) from None
        except UnknownPackage as error:
            rospy.logfatal("Package[%s] does not have a path", error)
            raise rospy.ServiceException(f"urdf reference package name does not exist: {error}") from None

    def _spawn_sdf_model(self, request: srv.SpawnModelRequest) -> str:
        try:
            return self._spawn(request, read_sdf_request)
        except WrongFormat:
            rospy.logerr("GazeboRosApiPlugin SpawnModel Failure: input xml format not recognized")
            raise Refused(_NOT_A_MODEL) from None

    def _spawn(self, request: srv.SpawnModelRequest, read: Reader) -> str:
        name = request.model_name
        try:
            model = read(request.model_xml, name, request.robot_namespace, self._server.resources)
            for line in model.warnings:
                rospy.logwarn("model '%s': %s", name, line)
            return self._loop.call(lambda: self._add(request, model))
        except (SdfError, SimulationError) as error:
            rospy.logerr("SpawnModel: model '%s' cannot be used: %s", name, error)
            raise Refused(f"SpawnModel: Failure - {error}") from None

    def _add(self, request: srv.SpawnModelRequest, model: Model) -> str:
        pose = pose_of(request.initial_pose)
        frame = find_entity(self._simulation, request.reference_frame)
        if frame is not None:
            pose = compose(frame.pose, pose)
        elif request.reference_frame not in WORLD_FRAMES:
            raise Refused(f"SpawnModel: reference reference_frame not found, {_UNSCOPED.format('link')}")
        if request.model_name in self._simulation.models:
            rospy.logerr("SpawnModel: Failure - model name %s already exist.", request.model_name)
            raise Refused("SpawnModel: Failure - entity already exists.")
        self._server.add_model(model, pose, request.model_name)
        return "SpawnModel: Successfully spawned entity"

    def _delete_model(self, request: srv.DeleteModelRequest) -> str:
        self._server.remove_model(self._require_model(request.model_name, "DeleteModel").name)
        return "DeleteModel: successfully deleted model"

    # ---- models

    def _require_model(self, name: str, service: str, title: str = "") -> SimModel:
        """Return a model. If it does not exist, log an error that starts with ``title`` and raise Refused."""
        if (model := self._simulation.models.get(name)) is None:
            rospy.logerr("%s: model [%s] does not exist", title or service, name)
            raise Refused(f"{service}: model does not exist")
        return model

    def _get_model_properties(self, request: srv.GetModelPropertiesRequest) -> srv.GetModelPropertiesResponse:
        model = self._require_model(request.model_name, "GetModelProperties")
        return srv.GetModelPropertiesResponse(
            body_names=list(model.links),
            geom_names=[each.name for link in model.record.links.values() for each in link.collisions],
            joint_names=list(model.joints),
            is_static=model.is_static,
            success=True,
            status_message="GetModelProperties: got properties",
        )

    def _get_model_state(self, request: srv.GetModelStateRequest) -> srv.GetModelStateResponse:
        name, frame_name = request.model_name, request.relative_entity_name
        model = self._require_model(name, "GetModelState")
        self._queries[name] = self._queries.get(name, 0) + 1
        response = srv.GetModelStateResponse()
        response.header.seq = self._queries[name]
        response.header.stamp = time_of(self._simulation.time_ns)
        response.header.frame_id = frame_name
        state = self._relative(model.state, frame_name)
        if state is None:
            what = "GetModelState: reference relative_entity_name not found"
            response.status_message = f"{what}, {_UNSCOPED.format('body')}"
            return response
        response.pose = to_pose(state.pose)
        response.twist = to_twist(state.linear, state.angular)
        response.success = True
        response.status_message = "GetModelState: got properties"
        return response

    def _relative(self, state: State, frame_name: str) -> State | None:
        """Return a state relative to a frame, or None if the frame does not exist."""
        frame = find_entity(self._simulation, frame_name)
        if frame is not None:
            return relative_state(state, frame.state)
        return state if frame_name in WORLD_FRAMES else None

    def _on_model_state(self, message: ModelState) -> None:
        apply(self._loop, self._set_model_state, srv.SetModelStateRequest(message))

    def _set_model_state(self, request: srv.SetModelStateRequest) -> str:
        wanted = request.model_state
        model = self._require_model(wanted.model_name, "SetModelState", "Updating ModelState")
        pose = pose_of(wanted.pose)
        linear, angular = vector_of(wanted.twist.linear), vector_of(wanted.twist.angular)
        frame = find_entity(self._simulation, wanted.reference_frame)
        if frame is not None:
            base = frame.pose
            pose = compose(base, pose)
            linear, angular = rotate(base.orientation, linear), rotate(base.orientation, angular)
        elif wanted.reference_frame not in WORLD_FRAMES:
            rospy.logerr(
                "Updating ModelState: for model[%s], specified reference frame entity [%s] does not exist",
                wanted.model_name,
                wanted.reference_frame,
            )
            raise Refused("SetModelState: specified reference frame entity does not exist")
        before = model.pose
        model.set_state(State(pose, linear, angular))
        self._server.moved(model.name, before)
        return "SetModelState: set model state done"

    def _set_model_configuration(self, request: srv.SetModelConfigurationRequest) -> str:
        model = self._require_model(request.model_name, "SetModelConfiguration")
        if len(request.joint_names) != len(request.joint_positions):
            raise Refused("SetModelConfiguration: joint name and position list have different lengths")
        for name, position in zip(request.joint_names, request.joint_positions, strict=True):
            if name in model.joints:
                model.joints[name].set_state(position)
        return "SetModelConfiguration: success"

    # ---- links

    def _get_link_state(self, request: srv.GetLinkStateRequest) -> srv.GetLinkStateResponse:
        name, frame_name = request.link_name, request.reference_frame
        link = require_link(self._simulation, name, "GetLinkState")
        state = self._relative(link.state, frame_name)
        if state is None:
            raise Refused(f"GetLinkState: reference reference_frame not found, {_UNSCOPED.format('link')}")
        twist = to_twist(state.linear, state.angular)
        link_state = LinkState(name, to_pose(state.pose), twist, frame_name)
        return srv.GetLinkStateResponse(link_state, True, "GetLinkState: got state")

    def _on_link_state(self, message: LinkState) -> None:
        apply(self._loop, self._set_link_state, srv.SetLinkStateRequest(message))

    def _set_link_state(self, request: srv.SetLinkStateRequest) -> str:
        wanted = request.link_state
        link = find_link(self._simulation, wanted.link_name)
        if link is None:
            rospy.logerr("Updating LinkState: link [%s] does not exist", wanted.link_name)
            raise Refused("SetLinkState: link does not exist")
        pose = pose_of(wanted.pose)
        linear, angular = vector_of(wanted.twist.linear), vector_of(wanted.twist.angular)
        frame = find_link(self._simulation, wanted.reference_frame) if wanted.reference_frame else None
        if frame is not None:
            base = frame.state
            pose = compose(base.pose, pose)
            linear, angular = difference(linear, base.linear), difference(angular, base.angular)
        elif wanted.reference_frame not in WORLD_FRAMES:
            rospy.logerr("Updating LinkState: reference_frame is not a valid entity name")
            raise Refused("SetLinkState: failed")
        before = link.model.pose
        link.set_state(State(pose, linear, angular))
        self._server.moved(link.model.name, before)
        return "SetLinkState: success"
