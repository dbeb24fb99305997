"""Services for the properties of links, joints and lights, for forces, and for the world's physics.

Source: http://wiki.ros.org/gazebo_ros, gazebo_msgs. The response to an invalid request has ``success`` false and ROS's text.
"""

from __future__ import annotations

from gazebo_msgs.msg import ODEPhysics
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
    GetJointProperties,
    GetJointPropertiesRequest,
    GetJointPropertiesResponse,
    GetLightProperties,
    GetLightPropertiesRequest,
    GetLightPropertiesResponse,
    GetLinkProperties,
    GetLinkPropertiesRequest,
    GetLinkPropertiesResponse,
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
    SetPhysicsProperties,
    SetPhysicsPropertiesRequest,
    SetPhysicsPropertiesResponse,
)
from std_msgs.msg import ColorRGBA
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from minirospy import client as rospy
from minirospy.core.sdf.model import Inertial, Light, Pose, Vector
from minirospy.core.sdf.poses import compose, rotate, rotate_back
from minirospy.ros.gazebo_ros.frames import WORLD_FRAMES, difference, find_entity, find_joint, find_link
from minirospy.ros.gazebo_ros.messages import duration_seconds, pose_of, vector_of
from minirospy.ros.gazebo_ros.physics import SimulationError
from minirospy.ros.gazebo_ros.server import Server
from minirospy.ros.gazebo_ros.services import offer, offer_directly

__all__ = ["PhysicsServices"]


class PhysicsServices:
    """Offers the services for properties, forces and physics.

    ode: the parameters of Gazebo's engine, which are kept and reported.
    """

    def __init__(self, server: Server) -> None:
        self._server = server
        self._loop = loop = server.loop
        self._simulation = loop.simulation
        self.ode = _ode_defaults(self._simulation.physics.iterations, self._simulation.physics.sor)
        self.ode.max_contacts = self._simulation.physics.max_contacts
        offer(loop, "delete_light", DeleteLight, self._delete_light)
        offer(loop, "get_world_properties", GetWorldProperties, self._get_world_properties)
        offer(loop, "get_joint_properties", GetJointProperties, self._get_joint_properties)
        offer(loop, "get_link_properties", GetLinkProperties, self._get_link_properties)
        offer(loop, "get_light_properties", GetLightProperties, self._get_light_properties)
        offer(loop, "set_joint_properties", SetJointProperties, self._set_joint_properties)
        offer(loop, "set_link_properties", SetLinkProperties, self._set_link_properties)
        offer(loop, "set_light_properties", SetLightProperties, self._set_light_properties)
        offer(loop, "get_physics_properties", GetPhysicsProperties, self._get_physics_properties)
        offer(loop, "set_physics_properties", SetPhysicsProperties, self._set_physics_properties)
        offer(loop, "apply_body_wrench", ApplyBodyWrench, self._apply_body_wrench)
        offer(loop, "apply_joint_effort", ApplyJointEffort, self._apply_joint_effort)
        offer(loop, "clear_joint_forces", JointRequest, self._clear_joint_forces)
        offer(loop, "clear_body_wrenches", BodyRequest, self._clear_body_wrenches)
        offer(loop, "reset_simulation", Empty, self._reset_simulation)
        offer(loop, "reset_world", Empty, self._reset_world)
        offer(loop, "step_physics", Empty, self._step_physics)
        offer_directly("pause_physics", Empty, self._pause_physics)
        offer_directly("unpause_physics", Empty, self._unpause_physics)

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

    # ---- forces

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
            # As in ROS, the point is relative to the body's origin, in world axes, even if the frame is the world.
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
