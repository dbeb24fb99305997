// The services and topics of a simulation under Gazebo's names that its window uses.

import { isThere, poseOf, pushOf, rateOf, serviceOf, spawnOf, stateOf, STEP, topicOf } from "./simulation.js";
import { t } from "./texts.js";

const ANSWER_MS = 6000; // that a service has
const SPAWN_MS = 60_000; // a large mesh takes long
export const MAX_EFFORT_SECONDS = 1; // of a joint's force

export class SimulationServices {
  constructor(link) {
    this.link = link;
  }

  close() {
    if (this.isStepping) this.link.unpublish(STEP.topic);
  }

  /** Whether there is a simulation. A page that may not call services is offered none. */
  get isThere() {
    const { mayWrite, services, channels } = this.link;
    return mayWrite ? isThere(services) : channels.has(topicOf("state"));
  }

  /** Call a service of the simulation. Rejects with one line if it is not there, does not answer or refuses. */
  async call(name, request = {}, most = ANSWER_MS) {
    const service = serviceOf(name);
    if (!this.link.mayWrite) throw new Error(t("This token is read-only."));
    if (!this.link.services.has(service))
      throw new Error(t("{service} is not there: the simulation has ended", { service }));
    let timer = null;
    const late = new Promise((_, reject) => {
      timer = setTimeout(
        () => reject(new Error(t("{service} does not answer: has the simulation stopped?", { service }))),
        most,
      );
    });
    try {
      const response = await Promise.race([this.link.call(service, request), late]);
      if (response.success === false) throw new Error(response.status_message || response.message || t("refused"));
      return response;
    } finally {
      clearTimeout(timer);
    }
  }

  async pause(isPaused) {
    await this.call(isPaused ? "pause_physics" : "unpause_physics");
  }

  /** Advance a paused simulation by so many steps. */
  async step(count) {
    this.isStepping = true;
    await this.link.publish(STEP.topic, STEP.type, STEP.schema, { data: count });
  }

  /** Set the speed, 0 for as fast as possible; return the rate of the steps. */
  async setSpeed(speed) {
    const physics = await this.call("get_physics_properties");
    const rate = rateOf(speed, physics.time_step);
    await this.call("set_physics_properties", {
      time_step: physics.time_step,
      max_update_rate: rate,
      gravity: physics.gravity,
      ode_config: physics.ode_config,
    });
    return rate;
  }

  /** Return the names of the models. */
  async models() {
    return (await this.call("get_world_properties")).model_names;
  }

  properties(model) {
    return this.call("get_model_properties", { model_name: model });
  }

  async pose(model) {
    return (await this.call("get_model_state", { model_name: model, relative_entity_name: "" })).pose;
  }

  async setPose(model, position, rpy) {
    await this.call("set_model_state", { model_state: stateOf(model, poseOf(position, rpy)) });
  }

  async remove(model) {
    await this.call("delete_model", { model_name: model });
  }

  /** Apply a force (N, in the world) at a point from the origin of a link for a time. */
  async push(link, force, at, seconds) {
    await this.call("apply_body_wrench", pushOf(link, force, at, seconds));
  }

  async setJoint(model, joint, position) {
    await this.call("set_model_configuration", {
      model_name: model,
      urdf_param_name: "",
      joint_names: [joint],
      joint_positions: [position],
    });
  }

  async pushJoint(model, joint, effort) {
    await this.call("apply_joint_effort", {
      joint_name: `${model}::${joint}`,
      effort,
      start_time: { secs: 0, nsecs: 0 },
      duration: { secs: MAX_EFFORT_SECONDS, nsecs: 0 },
    });
  }

  /** Return the names of the models that can be inserted. */
  async library() {
    return (await this.call("window/list_models")).message.split("\n");
  }

  async spawn(name, xml, position) {
    await this.call("spawn_sdf_model", spawnOf(name, xml, poseOf(position)), SPAWN_MS);
  }
}
