"""Services that spawn, delete and move models and links, and the topics set_model_state and set_link_state.

Source: http://wiki.ros.org/gazebo_ros, gazebo_msgs. The response to an invalid request has ``success`` false and ROS's text.
"""

from __future__ import annotations

from gazebo_msgs.msg import LinkState, ModelState
from gazebo_msgs.srv import (
    DeleteModel,
    DeleteModelRequest,
    DeleteModelResponse,
    GetLinkState,
    GetLinkStateRequest,
    GetLinkStateResponse,
    GetModelProperties,
    GetModelPropertiesRequest,
    GetModelPropertiesResponse,
    GetModelState,
    GetModelStateRequest,
    GetModelStateResponse,
    SetLinkState,
    SetLinkStateRequest,
    SetLinkStateResponse,
    SetModelConfiguration,
    SetModelConfigurationRequest,
    SetModelConfigurationResponse,
    SetModelState,
    SetModelStateRequest,
    SetModelStateResponse,
    SpawnModel,
    SpawnModelRequest,
    SpawnModelResponse,
)

from minirospy import client as rospy
from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import Model
from minirospy.core.sdf.poses import compose, rotate
from minirospy.ros.gazebo_ros.frames import WORLD_FRAMES, difference, find_entity, find_link, relative_state
from minirospy.ros.gazebo_ros.messages import pose_of, time_of, to_pose, to_twist, vector_of
from minirospy.ros.gazebo_ros.physics import SimulationError, State
from minirospy.ros.gazebo_ros.server import Server
from minirospy.ros.gazebo_ros.services import apply, offer, offer_directly
from minirospy.ros.gazebo_ros.spawning import UnknownPackage, WrongFormat, read_sdf_request, read_urdf_request

__all__ = ["StateServices"]

_NOT_A_MODEL = (
    "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF or URDF, "
    "or cannot be converted to Gazebo compatible format."
)


class StateServices:
    """Offers the services for models and for the states of links."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._loop = loop = server.loop
        self._simulation = loop.simulation
        self._queries: dict[str, int] = {}  # number of get_model_state calls by model
        offer(loop, "delete_model", DeleteModel, self._delete_model)
        offer(loop, "get_model_properties", GetModelProperties, self._get_model_properties)
        offer(loop, "get_model_state", GetModelState, self._get_model_state)
        offer(loop, "get_link_state", GetLinkState, self._get_link_state)
        offer(loop, "set_model_state", SetModelState, self._set_model_state)
        offer(loop, "set_model_configuration", SetModelConfiguration, self._set_model_configuration)
        offer(loop, "set_link_state", SetLinkState, self._set_link_state)
        offer_directly("spawn_sdf_model", SpawnModel, self._spawn_sdf_model)
        offer_directly("spawn_urdf_model", SpawnModel, self._spawn_urdf_model)
        rospy.Subscriber("~set_model_state", ModelState, self._on_model_state, queue_size=10)
        rospy.Subscriber("~set_link_state", LinkState, self._on_link_state, queue_size=10)

    # ---- spawning and deleting

    def _spawn_urdf_model(self, request: SpawnModelRequest) -> SpawnModelResponse:
        try:
            model = read_urdf_request(
                request.model_xml, request.model_name, request.robot_namespace, self._server.resources
            )
        except WrongFormat:
            rospy.logerr("SpawnModel: Failure - entity format is invalid.")
            raise rospy.ServiceException("SpawnModel: Failure - entity format is invalid.") from None
        except UnknownPackage as error:
            rospy.logfatal("Package[%s] does not have a path", error)
            raise rospy.ServiceException(f"urdf reference package name does not exist: {error}") from None
        except SdfError as error:
            return self._refuse_model(request, error)
        return self._spawn(request, model)

    def _spawn_sdf_model(self, request: SpawnModelRequest) -> SpawnModelResponse:
        try:
            model = read_sdf_request(
                request.model_xml, request.model_name, request.robot_namespace, self._server.resources
            )
        except WrongFormat:
            rospy.logerr("GazeboRosApiPlugin SpawnModel Failure: input xml format not recognized")
            return SpawnModelResponse(False, _NOT_A_MODEL)
        except SdfError as error:
            return self._refuse_model(request, error)
        return self._spawn(request, model)

    @staticmethod
    def _refuse_model(request: SpawnModelRequest, error: Exception) -> SpawnModelResponse:
        rospy.logerr("SpawnModel: model '%s' cannot be used: %s", request.model_name, error)
        return SpawnModelResponse(False, f"SpawnModel: Failure - {error}")

    def _spawn(self, request: SpawnModelRequest, model: Model) -> SpawnModelResponse:
        for line in model.warnings:
            rospy.logwarn("model '%s': %s", request.model_name, line)

        def add() -> SpawnModelResponse:
            pose = pose_of(request.initial_pose)
            frame = find_entity(self._simulation, request.reference_frame)
            if frame is not None:
                pose = compose(frame.pose, pose)
            elif request.reference_frame not in WORLD_FRAMES:
                return SpawnModelResponse(
                    False,
                    "SpawnModel: reference reference_frame not found, "
                    "did you forget to scope the link by model name?",
                )
            if request.model_name in self._simulation.models:
                rospy.logerr("SpawnModel: Failure - model name %s already exist.", request.model_name)
                return SpawnModelResponse(False, "SpawnModel: Failure - entity already exists.")
            try:
                self._server.add_model(model, pose, request.model_name)
            except SimulationError as error:
                return self._refuse_model(request, error)
            return SpawnModelResponse(True, "SpawnModel: Successfully spawned entity")

        return self._loop.call(add)

    def _delete_model(self, request: DeleteModelRequest) -> DeleteModelResponse:
        if request.model_name not in self._simulation.models:
            rospy.logerr("DeleteModel: model [%s] does not exist", request.model_name)
            return DeleteModelResponse(False, "DeleteModel: model does not exist")
        self._server.remove_model(request.model_name)
        return DeleteModelResponse(True, "DeleteModel: successfully deleted model")

    # ---- models

    def _get_model_properties(self, request: GetModelPropertiesRequest) -> GetModelPropertiesResponse:
        model = self._simulation.models.get(request.model_name)
        response = GetModelPropertiesResponse()
        if model is None:
            rospy.logerr("GetModelProperties: model [%s] does not exist", request.model_name)
            response.status_message = "GetModelProperties: model does not exist"
            return response
        response.body_names = list(model.links)
        response.geom_names = [each.name for link in model.record.links.values() for each in link.collisions]
        response.joint_names = list(model.joints)
        response.is_static = model.is_static
        response.success = True
        response.status_message = "GetModelProperties: got properties"
        return response

    def _get_model_state(self, request: GetModelStateRequest) -> GetModelStateResponse:
        response = GetModelStateResponse()
        model = self._simulation.models.get(request.model_name)
        if model is None:
            rospy.logerr("GetModelState: model [%s] does not exist", request.model_name)
            response.status_message = "GetModelState: model does not exist"
            return response
        self._queries[request.model_name] = self._queries.get(request.model_name, 0) + 1
        response.header.seq = self._queries[request.model_name]
        response.header.stamp = time_of(self._simulation.time_ns)
        response.header.frame_id = request.relative_entity_name
        state = self._relative(model.state, request.relative_entity_name)
        if state is None:
            response.status_message = (
                "GetModelState: reference relative_entity_name not found, "
                "did you forget to scope the body by model name?"
            )
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
        apply(self._loop, self._set_model_state, SetModelStateRequest(message))

    def _set_model_state(self, request: SetModelStateRequest) -> SetModelStateResponse:
        wanted = request.model_state
        model = self._simulation.models.get(wanted.model_name)
        if model is None:
            rospy.logerr("Updating ModelState: model [%s] does not exist", wanted.model_name)
            return SetModelStateResponse(False, "SetModelState: model does not exist")
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
            return SetModelStateResponse(
                False, "SetModelState: specified reference frame entity does not exist"
            )
        before = model.pose
        model.set_state(State(pose, linear, angular))
        self._server.moved(model.name, before)
        return SetModelStateResponse(True, "SetModelState: set model state done")

    def _set_model_configuration(
        self, request: SetModelConfigurationRequest
    ) -> SetModelConfigurationResponse:
        model = self._simulation.models.get(request.model_name)
        if model is None:
            rospy.logerr("SetModelConfiguration: model [%s] does not exist", request.model_name)
            return SetModelConfigurationResponse(False, "SetModelConfiguration: model does not exist")
        if len(request.joint_names) != len(request.joint_positions):
            return SetModelConfigurationResponse(
                False, "SetModelConfiguration: joint name and position list have different lengths"
            )
        for name, position in zip(request.joint_names, request.joint_positions, strict=True):
            if name in model.joints:
                model.joints[name].set_state(position)
        return SetModelConfigurationResponse(True, "SetModelConfiguration: success")

    # ---- links

    def _get_link_state(self, request: GetLinkStateRequest) -> GetLinkStateResponse:
        response = GetLinkStateResponse()
        link = find_link(self._simulation, request.link_name)
        if link is None:
            response.status_message = (
                "GetLinkState: link not found, did you forget to scope the link by model name?"
            )
            return response
        state = self._relative(link.state, request.reference_frame)
        if state is None:
            response.status_message = (
                "GetLinkState: reference reference_frame not found, "
                "did you forget to scope the link by model name?"
            )
            return response
        response.link_state = LinkState(
            request.link_name,
            to_pose(state.pose),
            to_twist(state.linear, state.angular),
            request.reference_frame,
        )
        response.success = True
        response.status_message = "GetLinkState: got state"
        return response

    def _on_link_state(self, message: LinkState) -> None:
        apply(self._loop, self._set_link_state, SetLinkStateRequest(message))

    def _set_link_state(self, request: SetLinkStateRequest) -> SetLinkStateResponse:
        wanted = request.link_state
        link = find_link(self._simulation, wanted.link_name)
        if link is None:
            rospy.logerr("Updating LinkState: link [%s] does not exist", wanted.link_name)
            return SetLinkStateResponse(False, "SetLinkState: link does not exist")
        pose = pose_of(wanted.pose)
        linear, angular = vector_of(wanted.twist.linear), vector_of(wanted.twist.angular)
        frame = find_link(self._simulation, wanted.reference_frame) if wanted.reference_frame else None
        if frame is not None:
            base = frame.state
            pose = compose(base.pose, pose)
            linear, angular = difference(linear, base.linear), difference(angular, base.angular)
        elif wanted.reference_frame not in WORLD_FRAMES:
            rospy.logerr("Updating LinkState: reference_frame is not a valid entity name")
            return SetLinkStateResponse(False, "SetLinkState: failed")
        before = link.model.pose
        link.set_state(State(pose, linear, angular))
        self._server.moved(link.model.name, before)
        return SetLinkStateResponse(True, "SetLinkState: success")
