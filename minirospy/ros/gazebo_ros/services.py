"""The services of /gazebo, and the topics set_model_state and set_link_state.

Source: http://wiki.ros.org/gazebo_ros, gazebo_msgs. A request that cannot be served gets ``success`` false and ROS's text.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from gazebo_msgs.msg import LinkState, ModelState, ODEPhysics
from gazebo_msgs.srv import (
    ApplyBodyWrench,
    ApplyBodyWrenchRequest,
    ApplyBodyWrenchResponse,
    ApplyJointEffort,
    ApplyJointEffortRequest,
    ApplyJointEffortResponse,
    BodyRequest,
    BodyRequestRequest,
    BodyRequestResponse,
    DeleteLight,
    DeleteLightRequest,
    DeleteLightResponse,
    DeleteModel,
    DeleteModelRequest,
    DeleteModelResponse,
    GetJointProperties,
    GetJointPropertiesRequest,
    GetJointPropertiesResponse,
    GetLightProperties,
    GetLightPropertiesRequest,
    GetLightPropertiesResponse,
    GetLinkProperties,
    GetLinkPropertiesRequest,
    GetLinkPropertiesResponse,
    GetLinkState,
    GetLinkStateRequest,
    GetLinkStateResponse,
    GetModelProperties,
    GetModelPropertiesRequest,
    GetModelPropertiesResponse,
    GetModelState,
    GetModelStateRequest,
    GetModelStateResponse,
    GetPhysicsProperties,
    GetPhysicsPropertiesRequest,
    GetPhysicsPropertiesResponse,
    GetWorldProperties,
    GetWorldPropertiesRequest,
    GetWorldPropertiesResponse,
    JointRequest,
    JointRequestRequest,
    JointRequestResponse,
    SetJointProperties,
    SetJointPropertiesRequest,
    SetJointPropertiesResponse,
    SetLightProperties,
    SetLightPropertiesRequest,
    SetLightPropertiesResponse,
    SetLinkProperties,
    SetLinkPropertiesRequest,
    SetLinkPropertiesResponse,
    SetLinkState,
    SetLinkStateRequest,
    SetLinkStateResponse,
    SetModelConfiguration,
    SetModelConfigurationRequest,
    SetModelConfigurationResponse,
    SetModelState,
    SetModelStateRequest,
    SetModelStateResponse,
    SetPhysicsProperties,
    SetPhysicsPropertiesRequest,
    SetPhysicsPropertiesResponse,
    SpawnModel,
    SpawnModelRequest,
    SpawnModelResponse,
)
from std_msgs.msg import ColorRGBA
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from minirospy import client as rospy
from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import Inertial, Light, Model, Pose, Vector
from minirospy.core.sdf.poses import compose, rotate, rotate_back
from minirospy.ros.gazebo_ros.frames import (
    WORLD_FRAMES,
    difference,
    find_entity,
    find_joint,
    find_link,
    relative_state,
)
from minirospy.ros.gazebo_ros.loop import LoopClosed
from minirospy.ros.gazebo_ros.messages import (
    duration_seconds,
    pose_of,
    time_of,
    to_pose,
    to_twist,
    vector_of,
)
from minirospy.ros.gazebo_ros.physics import SimulationError, State
from minirospy.ros.gazebo_ros.server import Server
from minirospy.ros.gazebo_ros.spawning import (
    UnknownPackage,
    WrongFormat,
    read_sdf_request,
    read_urdf_request,
)

__all__ = ["Services"]

_NOT_A_MODEL = (
    "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF or URDF, "
    "or cannot be converted to Gazebo compatible format."
)


class Services:
    """Offers the services. Their handlers run in threads of their own, and the work in the simulation's thread.

    ode: the parameters of Gazebo's engine, which are kept and reported.
    """

    def __init__(self, server: Server) -> None:
        self._server = server
        self._loop = server.loop
        self._simulation = server.loop.simulation
        self._queries: dict[str, int] = {}  # number of get_model_state calls by model
        self.ode = _ode_defaults(self._simulation.physics.iterations, self._simulation.physics.sor)
        self.ode.max_contacts = self._simulation.physics.max_contacts
        in_loop: tuple[tuple[str, Any, Callable[[Any], Any]], ...] = (
            ("delete_model", DeleteModel, self._delete_model),
            ("delete_light", DeleteLight, self._delete_light),
            ("get_model_properties", GetModelProperties, self._get_model_properties),
            ("get_model_state", GetModelState, self._get_model_state),
            ("get_world_properties", GetWorldProperties, self._get_world_properties),
            ("get_joint_properties", GetJointProperties, self._get_joint_properties),
            ("get_link_properties", GetLinkProperties, self._get_link_properties),
            ("get_link_state", GetLinkState, self._get_link_state),
            ("get_light_properties", GetLightProperties, self._get_light_properties),
            ("set_joint_properties", SetJointProperties, self._set_joint_properties),
            ("set_link_properties", SetLinkProperties, self._set_link_properties),
            ("set_light_properties", SetLightProperties, self._set_light_properties),
            ("get_physics_properties", GetPhysicsProperties, self._get_physics_properties),
            ("set_physics_properties", SetPhysicsProperties, self._set_physics_properties),
            ("set_model_state", SetModelState, self._set_model_state),
            ("set_model_configuration", SetModelConfiguration, self._set_model_configuration),
            ("set_link_state", SetLinkState, self._set_link_state),
            ("apply_body_wrench", ApplyBodyWrench, self._apply_body_wrench),
            ("apply_joint_effort", ApplyJointEffort, self._apply_joint_effort),
            ("clear_joint_forces", JointRequest, self._clear_joint_forces),
            ("clear_body_wrenches", BodyRequest, self._clear_body_wrenches),
            ("reset_simulation", Empty, self._reset_simulation),
            ("reset_world", Empty, self._reset_world),
            ("step_physics", Empty, self._step_physics),
        )
        for name, kind, handler in in_loop:
            rospy.Service(f"~{name}", kind, functools.partial(self._in_loop, kind._response_class, handler))
        for name, kind, handler in (
            ("spawn_sdf_model", SpawnModel, self._spawn_sdf_model),
            ("spawn_urdf_model", SpawnModel, self._spawn_urdf_model),
            ("pause_physics", Empty, self._pause_physics),
            ("unpause_physics", Empty, self._unpause_physics),
        ):
            rospy.Service(f"~{name}", kind, functools.partial(self._until_closed, handler))
        rospy.Subscriber("~set_model_state", ModelState, self._on_model_state, queue_size=10)
        rospy.Subscriber("~set_link_state", LinkState, self._on_link_state, queue_size=10)

    def _in_loop(self, response_class: type[Any], handler: Callable[[Any], Any], request: object) -> object:
        try:
            return self._until_closed(lambda each: self._loop.call(lambda: handler(each)), request)
        except SimulationError as error:  # such as a force that is NaN
            rospy.logerr("%s", error)
            response = response_class()
            if not hasattr(response, "success"):
                raise rospy.ServiceException(str(error)) from None
            response.success, response.status_message = False, str(error)
            return response

    @staticmethod
    def _until_closed(handler: Callable[[Any], Any], request: object) -> object:
        """Call a handler; refuse the request in one line if the simulation ends meanwhile."""
        try:
            return handler(request)
        except LoopClosed as error:
            raise rospy.ServiceException(str(error)) from None

    def _apply(self, handler: Callable[[Any], object], request: object) -> None:
        """Do what a message asks for."""
        try:
            self._loop.call(lambda: handler(request))
        except LoopClosed:
            pass
        except SimulationError as error:
            rospy.logerr("%s", error)

    # ---- models

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
        """Return a state in a frame, or None if the frame does not exist."""
        frame = find_entity(self._simulation, frame_name)
        if frame is not None:
            return relative_state(state, frame.state)
        return state if frame_name in WORLD_FRAMES else None

    def _on_model_state(self, message: ModelState) -> None:
        self._apply(self._set_model_state, SetModelStateRequest(message))

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
        model.set_state(State(pose, linear, angular))
        self._server.moved(model.name)
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

    # ---- links and joints

    def _get_link_properties(self, request: GetLinkPropertiesRequest) -> GetLinkPropertiesResponse:
        response = GetLinkPropertiesResponse()
        link = find_link(self._simulation, request.link_name)
        if link is None:
            response.status_message = (
                "GetLinkProperties: link not found, did you forget to scope the link by model name?"
            )
            return response
        inertial = link.record.inertial
        response.gravity_mode = link.has_gravity
        response.mass = inertial.mass
        (response.ixx, response.ixy, response.ixz, response.iyy, response.iyz, response.izz) = (
            inertial.inertia
        )
        position = response.com.position
        position.x, position.y, position.z = inertial.pose.position
        response.com.orientation.w = 1.0
        response.success = True
        response.status_message = "GetLinkProperties: got properties"
        return response

    def _set_link_properties(self, request: SetLinkPropertiesRequest) -> SetLinkPropertiesResponse:
        link = find_link(self._simulation, request.link_name)
        if link is None:
            return SetLinkPropertiesResponse(
                False, "SetLinkProperties: link not found, did you forget to scope the link by model name?"
            )
        if not request.mass > 0:
            return SetLinkPropertiesResponse(False, f"SetLinkProperties: the mass is {request.mass}")
        old = link.record.inertial
        new = Inertial(
            request.mass,
            Pose(vector_of(request.com.position), old.pose.orientation),
            (request.ixx, request.ixy, request.ixz, request.iyy, request.iyz, request.izz),
        )
        try:
            if new != old:
                link.set_inertial(new)
        except SimulationError as error:
            return SetLinkPropertiesResponse(False, f"SetLinkProperties: {error}")
        link.has_gravity = request.gravity_mode
        return SetLinkPropertiesResponse(True, "SetLinkProperties: properties set")

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
        self._apply(self._set_link_state, SetLinkStateRequest(message))

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
        link.set_state(State(pose, linear, angular))
        self._server.moved(link.model.name)
        return SetLinkStateResponse(True, "SetLinkState: success")

    def _get_joint_properties(self, request: GetJointPropertiesRequest) -> GetJointPropertiesResponse:
        joint = find_joint(self._simulation, request.joint_name)
        response = GetJointPropertiesResponse()
        if joint is None:
            response.status_message = "GetJointProperties: joint not found"
            return response
        response.type = GetJointPropertiesResponse.REVOLUTE  # as in ROS, for all joints
        response.position = [joint.position]
        response.rate = [joint.velocity]
        response.success = True
        response.status_message = "GetJointProperties: got properties"
        return response

    def _set_joint_properties(self, request: SetJointPropertiesRequest) -> SetJointPropertiesResponse:
        joint = find_joint(self._simulation, request.joint_name)
        if joint is None:
            return SetJointPropertiesResponse(False, "SetJointProperties: joint not found")
        config = request.ode_joint_config
        if config.fmax or config.vel:
            force = config.fmax[0] if config.fmax else 0.0
            if force > 0:
                joint.set_velocity(config.vel[0] if config.vel else 0.0, force)
            else:
                joint.stop_motor()
        axis = joint.axis
        if config.damping:
            axis = axis._replace(damping=config.damping[0])
        if config.hiStop:
            axis = axis._replace(upper=config.hiStop[0])
        if config.loStop:
            axis = axis._replace(lower=config.loStop[0])
        try:
            if axis != joint.axis:
                joint.set_axis(axis)
        except SimulationError as error:
            return SetJointPropertiesResponse(False, f"SetJointProperties: {error}")
        return SetJointPropertiesResponse(True, "SetJointProperties: properties set")

    def _apply_body_wrench(self, request: ApplyBodyWrenchRequest) -> ApplyBodyWrenchResponse:
        link = find_link(self._simulation, request.body_name)
        if link is None:
            rospy.logerr("ApplyBodyWrench: body [%s] does not exist", request.body_name)
            return ApplyBodyWrenchResponse(False, "ApplyBodyWrench: body does not exist")
        force, torque = vector_of(request.wrench.force), vector_of(request.wrench.torque)
        point = vector_of(request.reference_point)
        pose = link.pose
        frame = find_entity(self._simulation, request.reference_frame) if request.reference_frame else None
        if frame is not None:
            base = frame.pose
            force, torque = rotate(base.orientation, force), rotate(base.orientation, torque)
            x, y, z = difference(compose(base, _at(point)).position, pose.position)
            point = rotate_back(pose.orientation, (x, y, z))
        elif request.reference_frame in WORLD_FRAMES:
            # In ROS, too, the point counts from the body's origin, in world axes, although the frame is the world.
            point = rotate_back(pose.orientation, point)
        else:
            rospy.logerr("ApplyBodyWrench: reference_frame is not a valid entity name")
            return ApplyBodyWrenchResponse(False, "ApplyBodyWrench: reference_frame not found")
        start, duration = request.start_time, duration_seconds(request.duration)
        link.add_wrench(force, torque, point=point, start=start.secs + start.nsecs / 1e9, duration=duration)
        return ApplyBodyWrenchResponse(True, "")

    def _clear_body_wrenches(self, request: BodyRequestRequest) -> BodyRequestResponse:
        if (link := find_link(self._simulation, request.body_name)) is not None:
            link.clear_wrenches()
        return BodyRequestResponse()

    def _apply_joint_effort(self, request: ApplyJointEffortRequest) -> ApplyJointEffortResponse:
        joint = find_joint(self._simulation, request.joint_name)
        if joint is None:
            return ApplyJointEffortResponse(False, "ApplyJointEffort: joint not found")
        start, duration = request.start_time, duration_seconds(request.duration)
        joint.add_force(request.effort, start=start.secs + start.nsecs / 1e9, duration=duration)
        return ApplyJointEffortResponse(True, "ApplyJointEffort: effort set")

    def _clear_joint_forces(self, request: JointRequestRequest) -> JointRequestResponse:
        for model in self._simulation.models.values():
            if request.joint_name in model.joints:
                model.joints[request.joint_name].clear_forces()
        return JointRequestResponse()

    # ---- lights

    def _get_light_properties(self, request: GetLightPropertiesRequest) -> GetLightPropertiesResponse:
        light = self._server.lights.get(request.light_name)
        response = GetLightPropertiesResponse()
        if light is None:
            response.status_message = f"getLightProperties: Requested light {request.light_name} not found!"
            return response
        response.diffuse = ColorRGBA(*light.diffuse)
        response.success = True
        return response

    def _set_light_properties(self, request: SetLightPropertiesRequest) -> SetLightPropertiesResponse:
        light = self._server.lights.get(request.light_name)
        if light is None:
            return SetLightPropertiesResponse(
                False, f"setLightProperties: Requested light {request.light_name} not found!"
            )
        diffuse, specular = request.diffuse, request.specular
        self._server.lights[request.light_name] = Light(
            light.name,
            light.kind,
            pose_of(request.pose),
            (diffuse.r, diffuse.g, diffuse.b, diffuse.a),
            (specular.r, specular.g, specular.b, specular.a),
            vector_of(request.direction),
            light.range,
            request.cast_shadows,
        )
        return SetLightPropertiesResponse(True, "")

    def _delete_light(self, request: DeleteLightRequest) -> DeleteLightResponse:
        if self._server.lights.pop(request.light_name, None) is None:
            return DeleteLightResponse(False, f"DeleteLight: Requested light {request.light_name} not found!")
        return DeleteLightResponse(True, f"DeleteLight: {request.light_name} successfully deleted")

    # ---- the world

    def _get_world_properties(self, _request: GetWorldPropertiesRequest) -> GetWorldPropertiesResponse:
        return GetWorldPropertiesResponse(
            self._simulation.time,
            list(self._simulation.models),
            True,
            True,
            "GetWorldProperties: got properties",
        )

    def _get_physics_properties(self, _request: GetPhysicsPropertiesRequest) -> GetPhysicsPropertiesResponse:
        physics = self._simulation.physics
        response = GetPhysicsPropertiesResponse()
        response.time_step = physics.step
        response.pause = self._loop.is_paused
        response.max_update_rate = self._loop.update_rate
        response.gravity.x, response.gravity.y, response.gravity.z = physics.gravity
        response.ode_config = self.ode
        response.success = True
        response.status_message = "GetPhysicsProperties: got properties"
        return response

    def _set_physics_properties(self, request: SetPhysicsPropertiesRequest) -> SetPhysicsPropertiesResponse:
        try:
            self._server.set_physics(request.time_step, request.max_update_rate, vector_of(request.gravity))
        except SimulationError as error:
            return SetPhysicsPropertiesResponse(False, str(error))
        self.ode = request.ode_config
        return SetPhysicsPropertiesResponse(True, "physics engine updated")

    def _pause_physics(self, _request: EmptyRequest) -> EmptyResponse:
        self._loop.set_paused(True)
        return EmptyResponse()

    def _unpause_physics(self, _request: EmptyRequest) -> EmptyResponse:
        self._loop.set_paused(False)
        return EmptyResponse()

    def _reset_simulation(self, _request: EmptyRequest) -> EmptyResponse:
        self._server.reset(with_time=True)
        return EmptyResponse()

    def _step_physics(self, _request: EmptyRequest) -> EmptyResponse:
        """Advance by one step, for use while paused. Gazebo has this in its window only."""
        self._loop.step(1)
        return EmptyResponse()

    def _reset_world(self, _request: EmptyRequest) -> EmptyResponse:
        self._server.reset(with_time=False)
        return EmptyResponse()


def _at(point: Vector) -> Pose:
    return Pose(point)


def _ode_defaults(iterations: int, sor: float) -> ODEPhysics:
    """Return the parameters of Gazebo's default engine. They are kept and reported, and have no effect here."""
    return ODEPhysics(
        sor_pgs_iters=iterations,
        sor_pgs_w=sor,
        contact_surface_layer=0.001,
        contact_max_correcting_vel=100.0,
        erp=0.2,
        max_contacts=20,
    )
