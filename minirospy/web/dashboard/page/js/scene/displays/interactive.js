// Interactive markers of servers: shown with their handles and texts, moved by a person (grips.js), who is reported to
// the server.

import { Group, Matrix4, Quaternion, Vector3 } from "../../../vendor/three/three.min.js";
import { complete, MAX_TEXT, rotationsOf, toMessage, VIEW_FACING } from "../handles.js";
import { MarkerUpdates } from "../marker_updates.js";
import { schema } from "../schemas.js";
import { axes, discard } from "../shapes.js";
import { t } from "../../texts.js";
import { apply, compose, fromMessage, invert, multiply, secondsOf } from "../transforms.js";
import { TopicDisplay } from "./display.js";
import { makeMarker } from "./markers.js";

export const [KEEP_ALIVE, POSE_UPDATE, MENU_SELECT, BUTTON_CLICK, MOUSE_DOWN, MOUSE_UP] = Array(6).keys();
const TYPE = "visualization_msgs/InteractiveMarkerFeedback";
const FEEDBACK = schema(
  "Header header\nstring client_id\nstring marker_name\nstring control_name\nuint8 event_type\nPose pose\nuint32 menu_entry_id\nPoint mouse_point\nbool mouse_point_valid",
);
const MOST = 1000; // interactive markers
const MAX_STATUSES = 20; // of single markers
const FETCH_MS = 1000; // between two requests for all markers
const SUFFIX = "/update";

/** One interactive marker. Its item is the frame of its header; all else is in that frame. */
export class Shown {
  constructor(display) {
    this.display = display;
    this.object = new Group();
    this.name = "";
    this.description = "";
    this.scale = 1; // metres
    this.controls = [];
    this.labels = []; // {label, control, anchor}
    this.held = null; // by a drag: {pose, header} that the server wants meanwhile
  }

  /** Take over the marker's message. Throws Error. */
  fill(message) {
    const made = complete(message);
    this.empty();
    Object.assign(this, made, { pose: this.held ? this.pose : made.pose });
    if (this.held) this.held.pose = made.pose;
    this.place(made.header);
    this.axes = axes(this.scale, this.scale * 0.05);
    this.object.add(this.axes);
    for (const control of this.controls) this.build(control);
    if (this.description) this.write({ text: this.description, metres: 0.15 * this.scale });
  }

  build(control) {
    Object.assign(control, { shown: this, group: new Group(), initial: this.pose.q, rotation: 0 });
    control.group.userData.control = control;
    this.object.add(control.group);
    for (const marker of control.shapes) {
      const made = makeMarker({ ...marker, pose: this.inside(marker) }, this.display);
      control.group.add(made.object);
      if (!made.label) continue;
      made.object.position.copy(made.offset);
      this.labels.push({ label: made.label, control, anchor: made.object });
    }
  }

  write({ text, metres }) {
    this.labels.push({
      label: this.display.context.stage.labels.add({ text, kind: "marker", metres }),
      control: null,
      anchor: null,
    });
  }

  /** Return the pose of a shape in the marker, which may be given in a frame of its own. */
  inside({ header, pose }) {
    if (!header.frame_id) return pose;
    const [outer, own] = [this.header.frame_id, header.frame_id].map((frame) =>
      this.display.context.transformNow(frame),
    );
    if (!outer || !own)
      throw new Error(
        t("no transform from [{frame}] to [{other}]", { frame: header.frame_id, other: this.header.frame_id }),
      );
    return toMessage(compose(invert(compose(outer, this.pose)), compose(own, fromMessage(pose))));
  }

  /** Put the marker into a frame: with a stamp as it was then, else wherever the frame is. */
  place(header) {
    const { display } = this;
    this.header = header;
    const seconds = secondsOf(header.stamp);
    if (this.item) Object.assign(this.item, { frame: header.frame_id, seconds, isLocked: !seconds, settled: -1 });
    else this.item = display.add(this.object, header.frame_id, seconds, !seconds);
  }

  /** The server moves the marker; while a person drags it, when that ends. */
  move({ pose, header }) {
    const found = fromMessage(pose);
    if (![...found.p, ...found.q].every(Number.isFinite))
      throw new Error(t("{name}: Pose contains invalid floats!", { name: this.name }));
    if (this.held) this.held = { pose: found, header };
    else {
      this.pose = found;
      this.place(header);
    }
  }

  hold() {
    this.held = { pose: null, header: this.header };
  }

  release() {
    const { pose, header } = this.held;
    this.held = null;
    if (this.isClosed) return;
    if (pose) this.pose = pose;
    this.place(header);
  }

  /** Return the transform from the marker's frame to the fixed frame. */
  get outer() {
    return { p: this.object.position.toArray(), q: this.object.quaternion.toArray() };
  }

  get isVisible() {
    return this.object.visible;
  }

  /** Return the x axis of a control in the marker's frame. */
  axisOf(control) {
    const { frame } = rotationsOf(control, this.pose.q, this.viewed(this.display.context.stage.camera));
    return new Vector3(1, 0, 0).applyQuaternion(new Quaternion(...multiply(frame, control.q))).toArray();
  }

  viewed(camera) {
    const [right, up, back] = [0, 1, 2].map((index) => new Vector3().setFromMatrixColumn(camera.matrixWorld, index));
    const turned = new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(back.negate(), right.negate(), up));
    return multiply(invert(this.outer).q, turned.toArray());
  }

  /** Put controls and texts to their places in the view of a camera. */
  face(camera) {
    const { pose, display } = this;
    const view = this.controls.some(({ facing }) => facing === VIEW_FACING) ? this.viewed(camera) : null;
    this.axes.visible = display.get("Show Axes") === true;
    for (const part of [this.axes, ...this.controls.map(({ group }) => group)]) part.position.fromArray(pose.p);
    this.axes.quaternion.fromArray(pose.q);
    for (const control of this.controls) {
      control.group.quaternion.fromArray(rotationsOf(control, pose.q, view).shapes);
      control.group.visible = control.isAlways || display.context.isInteracting;
    }
    this.object.updateMatrixWorld(true);
    for (const { label, control, anchor } of this.labels) {
      label.isShown = this.isVisible && (control ? control.group.visible : display.get("Show Descriptions") !== false);
      if (anchor) label.place.setFromMatrixPosition(anchor.matrixWorld);
      else
        label.place
          .set(...apply(this.outer, pose.p))
          .addScaledVector(new Vector3().setFromMatrixColumn(camera.matrixWorld, 1), 1.2 * this.scale);
    }
  }

  empty() {
    for (const { label } of this.labels) this.display.context.stage.labels.remove(label);
    this.labels = [];
    const { stage } = this.display.context;
    for (const child of [...this.object.children]) discard(child, (material) => stage.release(material));
    this.controls = [];
  }

  close() {
    this.empty();
    this.isClosed = true;
    if (this.item) this.display.remove(this.item);
  }
}

export class InteractiveMarkers extends TopicDisplay {
  get mode() {
    return "all";
  }

  start() {
    this.markers = new Map(); // JSON of [server, name] -> Shown
    this.updates = new MarkerUpdates();
    this.clientId = `${this.context.link.node || "/dashboard"}/${crypto.getRandomValues(new Uint32Array(1))[0].toString(16)}/${this.settings.Name}`;
    this.fetched = -Infinity;
    super.start();
    if (!this.topic) return;
    if (!this.topic.endsWith(SUFFIX)) {
      this.setStatus(
        "Topic",
        2,
        t("Invalid topic name: {topic}: it does not end in {suffix}", { topic: this.topic, suffix: SUFFIX }),
      );
      return;
    }
    this.space = this.topic.slice(0, -SUFFIX.length);
    const { link } = this.context;
    this.ends.push(
      () => this.endFetch?.(),
      link.watch(["state"], () => this.offer()),
      () => link.unpublish(`${this.space}/feedback`),
    );
    this.fetch();
  }

  stop() {
    for (const key of [...(this.markers?.keys() ?? [])]) this.drop(key);
    super.stop();
  }

  /** Publish from now on, so that the server is connected before the first drag. */
  offer() {
    if (this.context.link.mayWrite) this.context.link.advertise(`${this.space}/feedback`, TYPE, FEEDBACK);
  }

  changed(path) {
    if (path === "Update Topic") this.restart();
    this.context.stage.invalidate();
  }

  checkType() {
    super.checkType();
    // The server is away: another one starts from the beginning.
    if (!this.type && this.updates.servers.size) {
      for (const key of [...this.markers.keys()]) this.drop(key);
      this.updates = new MarkerUpdates();
      this.setStatus("General", 1, t("Server is offline. Resetting."));
    }
  }

  // --- what servers publish

  /** Subscribe to all markers, until those of every server are known. */
  fetch() {
    this.endFetch?.();
    this.fetched = performance.now();
    const end = this.listen(`${this.space}/update_full`, "all", (message) => this.take(this.updates.full(message)));
    this.endFetch = () => {
      end();
      this.endFetch = null;
    };
  }

  received(message) {
    this.take(this.updates.update(message, performance.now()));
  }

  take(changes) {
    let failed = null;
    for (const { server, isAll, markers, poses, erases } of changes) {
      const key = (name) => JSON.stringify([server, name]);
      const names = new Set(markers.map(({ name }) => key(name)));
      if (isAll)
        for (const known of [...this.markers.keys()])
          if (JSON.parse(known)[0] === server && !names.has(known)) this.drop(known);
      for (const marker of markers) failed = this.show(key(marker.name), marker) ?? failed;
      for (const pose of poses) this.markers.get(key(pose.name))?.move(pose);
      for (const name of erases) this.drop(key(name));
    }
    if (!this.updates.isWaiting) this.endFetch?.();
    this.setStatus("Markers", 0, t("{count} interactive markers", { count: this.markers.size }));
    if (failed) throw failed;
    this.context.stage.invalidate();
  }

  /** Show a marker; return the Error of one that cannot be shown. */
  show(key, message) {
    const shown = this.markers.get(key) ?? new Shown(this);
    const status = `Marker ${message.name.slice(0, MAX_TEXT)}`;
    try {
      if (!this.markers.has(key) && this.markers.size >= MOST)
        throw new Error(t("more than {count} interactive markers", { count: MOST }));
      shown.fill(message);
      this.markers.set(key, shown);
      this.clearStatus(status);
      return null;
    } catch (error) {
      shown.close();
      this.markers.delete(key);
      if (this.status.size < MAX_STATUSES) this.setStatus(status, 2, error.message);
      return new Error(`${status}: ${error.message}`);
    }
  }

  drop(key) {
    this.markers.get(key)?.close();
    this.markers.delete(key);
  }

  update() {
    super.update();
    const now = performance.now();
    if (this.space && this.updates.isWaiting && this.type && now - this.fetched > FETCH_MS) this.fetch();
    for (const [server, [level, text]] of this.updates.statuses(now)) this.setStatus(server, level, text);
    if (this.updates.servers.size) this.clearStatus("General");
  }

  /** Called before each picture. */
  face(camera) {
    for (const shown of this.markers.values())
      if (shown.isVisible) shown.face(camera);
      else for (const { label } of shown.labels) label.isShown = false;
  }

  // --- what a person does

  /** Return the groups of controls that can be under the mouse. */
  groups() {
    return [...this.markers.values()]
      .filter((shown) => shown.isVisible)
      .flatMap(({ controls }) => controls.map(({ group }) => group).filter(({ visible }) => visible));
  }

  /** Report an event to the server; `point` (in the fixed frame) is what is under the mouse. */
  async report(control, event, { point = null, entry = 0 } = {}) {
    const { shown } = control;
    const { name, pose, outer, item, header } = shown;
    // Of a marker with a stamp in the fixed frame, as in RViz.
    const { isLocked } = item;
    const [x, y, z] = point === null ? [0, 0, 0] : isLocked ? apply(invert(outer), point) : point;
    try {
      await this.context.link.publish(`${this.space}/feedback`, TYPE, FEEDBACK, {
        header: {
          seq: 0,
          stamp: isLocked ? { secs: 0, nsecs: 0 } : header.stamp,
          frame_id: isLocked ? header.frame_id : this.context.fixedFrame,
        },
        client_id: this.clientId,
        marker_name: name,
        control_name: event === MENU_SELECT ? "" : control.name,
        event_type: event,
        pose: toMessage(isLocked ? pose : compose(outer, pose)),
        menu_entry_id: entry,
        mouse_point: { x, y, z },
        mouse_point_valid: point !== null,
      });
      this.clearStatus("Feedback");
    } catch (error) {
      this.setStatus("Feedback", 2, error.message);
    }
  }
}
