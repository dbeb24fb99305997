// The contents of a .rviz file as an object: its displays, fixed frame, view and tools, read and changed; all else is
// kept as it is. Pure.
// Source: files that RViz of ROS Noetic saves; those of RViz 2 have other names of classes, and topics with their QoS.

import { t } from "../texts.js";
import { CLASSES, classOf, complete, isOfRviz2, newSettings, plainClass } from "./classes.js";

const MANAGER = "Visualization Manager";
export const BACKGROUND = "48; 48; 48";
export const USUAL_VIEW = {
  Class: "rviz/Orbit",
  Name: "Current View",
  Distance: 10,
  "Focal Point": { X: 0, Y: 0, Z: 0 },
  Pitch: 0.785398,
  Yaw: 0.785398,
  "Target Frame": "<Fixed Frame>",
};
const KNOWN_VIEWS = ["Orbit", "XYOrbit", "TopDownOrtho", "ThirdPersonFollower"];

/** Return the contents that RViz starts with, and TF. */
export function newConfig() {
  return {
    Panels: [
      { Class: "rviz/Displays", Name: "Displays" },
      { Class: "rviz/Views", Name: "Views" },
    ],
    [MANAGER]: {
      Class: "",
      Displays: [newSettings("Grid"), newSettings("TF")],
      Enabled: true,
      "Global Options": { "Background Color": BACKGROUND, "Default Light": true, "Fixed Frame": "", "Frame Rate": 30 },
      Name: "root",
      Tools: [
        { Class: "rviz/Interact", "Hide Inactive Objects": true },
        { Class: "rviz/MoveCamera" },
        { Class: "rviz/FocusCamera" },
        { Class: "rviz/Measure" },
        { Class: "rviz/SetInitialPose", Topic: "/initialpose" },
        { Class: "rviz/SetGoal", Topic: "/move_base_simple/goal" },
        { Class: "rviz/PublishPoint", "Single click": true, Topic: "/clicked_point" },
      ],
      Value: true,
      Views: { Current: structuredClone(USUAL_VIEW), Saved: null },
    },
  };
}

const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

/** A configuration: what is shown of it can be read and changed, `raw` is the whole for saving. */
export class Config {
  constructor(raw = newConfig()) {
    if (!isObject(raw) || !isObject(raw[MANAGER]))
      throw new Error(t('not a file of RViz: it has no "{name}"', { name: MANAGER }));
    this.raw = raw;
    /** @type {any} */
    this.manager = raw[MANAGER];
    if (!Array.isArray(this.manager.Displays)) this.manager.Displays = [];
    if (!isObject(this.manager["Global Options"])) this.manager["Global Options"] = {};
    this.manager.Displays = this.manager.Displays.filter(isObject);
    for (const { settings } of this.displays()) complete(settings);
  }

  get fixedFrame() {
    return String(this.manager["Global Options"]["Fixed Frame"] ?? "");
  }

  set fixedFrame(name) {
    this.manager["Global Options"]["Fixed Frame"] = name;
  }

  get background() {
    return this.manager["Global Options"]["Background Color"] ?? BACKGROUND;
  }

  set background(color) {
    this.manager["Global Options"]["Background Color"] = color;
  }

  /** Return all displays in order, those of groups behind their group: [{settings, depth, list, isOn}]. */
  displays() {
    const found = [];
    const walk = (list, depth, isOn) => {
      for (const settings of list) {
        const isShown = isOn && settings.Enabled !== false;
        found.push({ settings, depth, list, isOn: isShown });
        if (classOf(settings) === "Group") {
          settings.Displays = Array.isArray(settings.Displays) ? settings.Displays.filter(isObject) : [];
          walk(settings.Displays, depth + 1, isShown);
        }
      }
    };
    walk(this.manager.Displays, 0, true);
    return found;
  }

  /** Return the names and classes of what cannot be shown: displays, and the view if it is of another kind. */
  unknown() {
    const found = this.displays()
      .filter(({ settings }) => !CLASSES[classOf(settings)] && classOf(settings) !== "Group")
      .map(({ settings }) => `${settings.Name ?? "?"} (${settings.Class ?? "no class"})`);
    if (this.view.Class && !KNOWN_VIEWS.includes(plainClass(this.view.Class))) found.push(`view ${this.view.Class}`);
    return found;
  }

  add(settings) {
    this.manager.Displays.push(settings);
  }

  remove(settings) {
    const place = this.displays().find((each) => each.settings === settings);
    place?.list.splice(place.list.indexOf(settings), 1);
  }

  get view() {
    if (!isObject(this.manager.Views)) this.manager.Views = {};
    if (!isObject(this.manager.Views.Current)) this.manager.Views.Current = structuredClone(USUAL_VIEW);
    return this.manager.Views.Current;
  }

  /** Return the topic of a tool's class ("SetGoal"). */
  toolTopic(name, usual) {
    const tools = Array.isArray(this.manager.Tools) ? this.manager.Tools : [];
    const topic = tools.find((tool) => plainClass(tool?.Class) === name)?.Topic;
    return String((isObject(topic) ? topic.Value : topic) || usual);
  }
}

/** Return {distance, focus, pitch, yaw, isFlat, scale, angle, target} of a view's settings. */
export function readView(view) {
  const numeric = (value, usual) =>
    Number.isFinite(Number(value)) && value !== null && value !== "" ? Number(value) : usual;
  const focus = view["Focal Point"] ?? {};
  const name = plainClass(view.Class);
  const isFlat = name === "TopDownOrtho";
  return {
    kind: isFlat ? "top" : name === "ThirdPersonFollower" ? "follow" : "orbit",
    distance: Math.max(0.01, numeric(view.Distance, 10)),
    focus: isFlat
      ? [numeric(view.X, 0), numeric(view.Y, 0), 0]
      : [numeric(focus.X, 0), numeric(focus.Y, 0), numeric(focus.Z, 0)],
    pitch: numeric(view.Pitch, 0.785398),
    yaw: numeric(view.Yaw, 0.785398),
    scale: Math.max(0.01, numeric(view.Scale, 50)), // pixels of a metre
    angle: numeric(view.Angle, 0),
    target: String(view["Target Frame"] ?? "<Fixed Frame>"),
  };
}

/** Write a view into its settings, in RViz's names. */
export function writeView(view, { kind, distance, focus, pitch, yaw, scale, angle, target }) {
  const rounded = (value) => Number(value.toPrecision(7));
  const name = { top: "TopDownOrtho", follow: "ThirdPersonFollower", orbit: "Orbit" }[kind];
  view.Class = `${isOfRviz2(view) ? "rviz_default_plugins" : "rviz"}/${name}`;
  view["Target Frame"] = target;
  if (kind === "top")
    Object.assign(view, { X: rounded(focus[0]), Y: rounded(focus[1]), Scale: rounded(scale), Angle: rounded(angle) });
  else {
    Object.assign(view, { Distance: rounded(distance), Pitch: rounded(pitch), Yaw: rounded(yaw) });
    view["Focal Point"] = { X: rounded(focus[0]), Y: rounded(focus[1]), Z: rounded(focus[2]) };
  }
}
