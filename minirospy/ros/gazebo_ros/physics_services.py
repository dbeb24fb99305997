"""Services for the properties of links, joints and lights, for forces, and for the world's physics.

Source: http://wiki.ros.org/gazebo_ros, gazebo_msgs. The response to an invalid request has ``success`` false and ROS's text.
"""

from __future__ import annotations

from gazebo_msgs import srv
from gazebo_msgs.msg import ODEPhysics
from std_msgs.msg import ColorRGBA
from std_srvs.srv import Empty

from minirospy import client as rospy
from minirospy.core.sdf.model import Inertial, Light, Pose
from minirospy.core.sdf.poses import compose, difference, rotate, rotate_back
from minirospy.ros.gazebo_ros.frames import WORLD_FRAMES, find_entity, find_link
from minirospy.ros.gazebo_ros.messages import duration_seconds, pose_of, to_pose, to_vector, vector_of
from minirospy.ros.gazebo_ros.physics import SimulationError
from minirospy.ros.gazebo_ros.server import Server
from minirospy.ros.gazebo_ros.services import Refused, offer, offer_directly, require_joint, require_link

__all__ = ["PhysicsServices"]


class PhysicsServices:
    """Offers the services for physics, forces, and properties of links and joints.

    ode: the parameters of Gazebo's engine, which are kept and reported, and have no effect here.
    """

    def __init__(self, server: Server) -> None:
        self._server = server
        self._loop = loop = server.loop
        self._simulation = loop.simulation
        physics = self._simulation.physics
        self.ode = ODEPhysics(
            sor_pgs_iters=physics.iterations,
            sor_pgs_w=physics.sor,
            contact_surface_layer=0.001,
            contact_max_correcting_vel=100.0,
            erp=0.2,
            max_contacts=physics.max_contacts,
        )
        offer(loop, "delete_light", srv.DeleteLight, self._delete_light)
        offer(loop, "get_world_properties", srv.GetWorldProperties, self._get_world_properties)
        offer(loop, "get_joint_properties", srv.GetJointProperties, self._get_joint_properties)
        offer(loop, "get_link_properties", srv.GetLinkProperties, self._get_link_properties)
        offer(loop, "get_light_properties", srv.GetLightProperties, self._get_light_properties)
        offer(loop, "set_joint_properties", srv.SetJointProperties, self._set_joint_properties)
        offer(loop, "set_link_properties", srv.SetLinkProperties, self._set_link_properties)
        offer(loop, "set_light_properties", srv.SetLightProperties, self._set_light_properties)
        offer(loop, "get_physics_properties", srv.GetPhysicsProperties, self._get_physics_properties)
        offer(loop, "set_physics_properties", srv.SetPhysicsProperties, self._set_physics_properties)
        offer(loop, "apply_body_wrench", srv.ApplyBodyWrench, self._apply_body_wrench)
        offer(loop, "apply_joint_effort", srv.ApplyJointEffort, self._apply_joint_effort)
        offer(loop, "clear_joint_forces", srv.JointRequest, self._clear_joint_forces)
        offer(loop, "clear_body_wrenches", srv.BodyRequest, self._clear_body_wrenches)
        offer(loop, "reset_simulation", Empty, lambda _: server.reset(with_time=True))
        offer(loop, "reset_world", Empty, lambda _: server.reset(with_time=False))
        # Not a service in Gazebo, where only the window can advance a paused simulation.
        offer(loop, "step_physics", Empty, lambda _: loop.step(1))
        offer_directly("pause_physics", Empty, lambda _: loop.set_paused(True))
        offer_directly("unpause_physics", Empty, lambda _: loop.set_paused(False))

    # ---- links and joints

    def _get_link_properties(self, request: srv.GetLinkPropertiesRequest) -> srv.GetLinkPropertiesResponse:
        link = require_link(self._simulation, request.link_name, "GetLinkProperties")
        mass, pose, inertia = link.record.inertial
        center, text = to_pose(Pose(pose.position)), "GetLinkProperties: got properties"
        return srv.GetLinkPropertiesResponse(center, link.has_gravity, mass, *inertia, True, text)

    def _set_link_properties(self, request: srv.SetLinkPropertiesRequest) -> str:
        link = require_link(self._simulation, request.link_name, "SetLinkProperties")
        if not request.mass > 0:
            raise Refused(f"SetLinkProperties: the mass is {request.mass}")
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
            raise Refused(f"SetLinkProperties: {error}") from None
        link.has_gravity = request.gravity_mode
        return "SetLinkProperties: properties set"

    def _get_joint_properties(self, request: srv.GetJointPropertiesRequest) -> srv.GetJointPropertiesResponse:
        joint = require_joint(self._simulation, request.joint_name, "GetJointProperties")
        return srv.GetJointPropertiesResponse(
            type=srv.GetJointPropertiesResponse.REVOLUTE,  # ROS returns REVOLUTE for all joints
            position=[joint.position],
            rate=[joint.velocity],
            success=True,
            status_message="GetJointProperties: got properties",
        )

    def _set_joint_properties(self, request: srv.SetJointPropertiesRequest) -> str:
        joint = require_joint(self._simulation, request.joint_name, "SetJointProperties")
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
            raise Refused(f"SetJointProperties: {error}") from None
        return "SetJointProperties: properties set"

    # ---- forces

    def _apply_body_wrench(self, request: srv.ApplyBodyWrenchRequest) -> str:
        link = find_link(self._simulation, request.body_name)
        if link is None:
            rospy.logerr("ApplyBodyWrench: body [%s] does not exist", request.body_name)
            raise Refused("ApplyBodyWrench: body does not exist")
        force, torque = vector_of(request.wrench.force), vector_of(request.wrench.torque)
        point = vector_of(request.reference_point)
        pose = link.pose
        frame = find_entity(self._simulation, request.reference_frame) if request.reference_frame else None
        if frame is not None:
            base = frame.pose
            force, torque = rotate(base.orientation, force), rotate(base.orientation, torque)
            offset = difference(compose(base, Pose(point)).position, pose.position)
            point = rotate_back(pose.orientation, offset)
        elif request.reference_frame in WORLD_FRAMES:
            # As in ROS, the point is relative to the body's origin, in world axes, even if the frame is the world.
            point = rotate_back(pose.orientation, point)
        else:
            rospy.logerr("ApplyBodyWrench: reference_frame is not a valid entity name")
            raise Refused("ApplyBodyWrench: reference_frame not found")
        start, duration = request.start_time, duration_seconds(request.duration)
        link.add_wrench(force, torque, point=point, start=start.secs + start.nsecs / 1e9, duration=duration)
        return ""

    def _clear_body_wrenches(self, request: srv.BodyRequestRequest) -> None:
        if (link := find_link(self._simulation, request.body_name)) is not None:
            link.clear_wrenches()

    def _apply_joint_effort(self, request: srv.ApplyJointEffortRequest) -> str:
        joint = require_joint(self._simulation, request.joint_name, "ApplyJointEffort")
        start, duration = request.start_time, duration_seconds(request.duration)
        joint.add_force(request.effort, start=start.secs + start.nsecs / 1e9, duration=duration)
        return "ApplyJointEffort: effort set"

    def _clear_joint_forces(self, request: srv.JointRequestRequest) -> None:
        for model in self._simulation.models.values():
            if request.joint_name in model.joints:
                model.joints[request.joint_name].clear_forces()

    # ---- lights

    def _require_light(self, name: str, service: str) -> Light:
        if (light := self._server.lights.get(name)) is None:
            raise Refused(f"{service}: Requested light {name} not found!")
        return light

    def _get_light_properties(self, request: srv.GetLightPropertiesRequest) -> srv.GetLightPropertiesResponse:
        light = self._require_light(request.light_name, "getLightProperties")
        return srv.GetLightPropertiesResponse(diffuse=ColorRGBA(*light.diffuse), success=True)

    def _set_light_properties(self, request: srv.SetLightPropertiesRequest) -> str:
        light = self._require_light(request.light_name, "setLightProperties")
        diffuse, specular = request.diffuse, request.specular
        self._server.lights[request.light_name] = light._replace(
            pose=pose_of(request.pose),
            diffuse=(diffuse.r, diffuse.g, diffuse.b, diffuse.a),
            specular=(specular.r, specular.g, specular.b, specular.a),
            direction=vector_of(request.direction),
            casts_shadows=request.cast_shadows,
        )
        return ""

    def _delete_light(self, request: srv.DeleteLightRequest) -> str:
        self._require_light(request.light_name, "DeleteLight")
        del self._server.lights[request.light_name]
        return f"DeleteLight: {request.light_name} successfully deleted"

    # ---- the world

    def _get_world_properties(self, _request: object) -> srv.GetWorldPropertiesResponse:
        names, text = list(self._simulation.models), "GetWorldProperties: got properties"
        return srv.GetWorldPropertiesResponse(self._simulation.time, names, True, True, text)

    def _get_physics_properties(self, _request: object) -> srv.GetPhysicsPropertiesResponse:
        physics = self._simulation.physics
        return srv.GetPhysicsPropertiesResponse(
            time_step=physics.step,
            pause=self._loop.is_paused,
            max_update_rate=self._loop.update_rate,
            gravity=to_vector(physics.gravity),
            ode_config=self.ode,
            success=True,
            status_message="GetPhysicsProperties: got properties",
        )

    def _set_physics_properties(self, request: srv.SetPhysicsPropertiesRequest) -> str:
        try:
            self._server.set_physics(request.time_step, request.max_update_rate, vector_of(request.gravity))
        except SimulationError as error:
            raise Refused(str(error)) from None
        self.ode = request.ode_config
        return "physics engine updated"
