// The displays that there are: RViz's classes, the types of their topics, and their settings under the names of .rviz
// files. Pure.

const scheme = (options) => ({ kind: "choice", options });
const bool = { kind: "bool" };
const number = { kind: "number" };
const color = { kind: "color" };
const text = { kind: "text" };
const topic = { kind: "topic" };
const frame = { kind: "frame" };

const isStyle =
  (...styles) =>
  (settings) =>
    styles.includes(settings.Style);
const isColored = (transformer) => (settings) => settings["Color Transformer"] === transformer;

const POINTS = (usualColors) => [
  ["Style", scheme(["Points", "Squares", "Flat Squares", "Spheres", "Boxes"]), "Flat Squares"],
  ["Size (m)", number, 0.01, (settings) => settings.Style !== "Points" && !settings["Auto Size"]?.Value],
  ["Size (Pixels)", number, 3, isStyle("Points")],
  ["Alpha", number, 1],
  ["Decay Time", number, 0],
  ["Color Transformer", scheme(["Intensity", "AxisColor", "RGB8", "RGBF32", "FlatColor"]), usualColors],
  ["Channel Name", text, "intensity", isColored("Intensity")],
  ["Use rainbow", bool, true, isColored("Intensity")],
  ["Invert Rainbow", bool, false, (settings) => ["Intensity", "AxisColor"].includes(settings["Color Transformer"])],
  ["Min Color", color, "0; 0; 0", (settings) => isColored("Intensity")(settings) && settings["Use rainbow"] === false],
  [
    "Max Color",
    color,
    "255; 255; 255",
    (settings) => isColored("Intensity")(settings) && settings["Use rainbow"] === false,
  ],
  ["Autocompute Intensity Bounds", bool, true, isColored("Intensity")],
  [
    "Min Intensity",
    number,
    0,
    (settings) => isColored("Intensity")(settings) && settings["Autocompute Intensity Bounds"] === false,
  ],
  [
    "Max Intensity",
    number,
    4096,
    (settings) => isColored("Intensity")(settings) && settings["Autocompute Intensity Bounds"] === false,
  ],
  ["Axis", scheme(["X", "Y", "Z"]), "Z", isColored("AxisColor")],
  ["Autocompute Value Bounds/Value", bool, true, isColored("AxisColor")],
  [
    "Autocompute Value Bounds/Min Value",
    number,
    -1,
    (settings) => isColored("AxisColor")(settings) && settings["Autocompute Value Bounds"]?.Value === false,
  ],
  [
    "Autocompute Value Bounds/Max Value",
    number,
    10,
    (settings) => isColored("AxisColor")(settings) && settings["Autocompute Value Bounds"]?.Value === false,
  ],
  ["Color", color, "255; 255; 255", isColored("FlatColor")],
];

const isPosed = (style) => (settings) => settings["Pose Style"] === style;
const isShape = (shape) => (settings) => settings.Shape === shape;
const isArrow = (settings) => settings.Shape !== "Axes";
const isAxes = (settings) => settings.Shape === "Axes";
const ARROW = [
  ["Color", color, "255; 25; 0", isArrow],
  ["Alpha", number, 1, isArrow],
  ["Shaft Length", number, 1, isArrow],
  ["Shaft Radius", number, 0.05, isArrow],
  ["Head Length", number, 0.3, isArrow],
  ["Head Radius", number, 0.1, isArrow],
  ["Axes Length", number, 1, isAxes],
  ["Axes Radius", number, 0.1, isAxes],
];

/** Class (without "rviz/") -> {types, topicKey, settings: [[path, kind, default, shown when]], mode}. */
export const CLASSES = {
  __proto__: null, // a file may name a class constructor
  Grid: {
    settings: [
      ["Reference Frame", frame, "<Fixed Frame>"],
      ["Plane", scheme(["XY", "XZ", "YZ"]), "XY"],
      ["Plane Cell Count", number, 10],
      ["Cell Size", number, 1],
      ["Color", color, "160; 160; 164"],
      ["Alpha", number, 0.5],
      ["Offset/X", number, 0],
      ["Offset/Y", number, 0],
      ["Offset/Z", number, 0],
    ],
  },
  Axes: {
    settings: [
      ["Reference Frame", frame, "<Fixed Frame>"],
      ["Length", number, 1],
      ["Radius", number, 0.1],
    ],
  },
  TF: {
    settings: [
      ["Show Names", bool, true],
      ["Show Axes", bool, true],
      ["Show Arrows", bool, true],
      ["Marker Scale", number, 1],
      ["Frame Timeout", number, 15],
    ],
  },
  RobotModel: {
    settings: [
      ["Robot Description", text, "robot_description"],
      ["TF Prefix", text, ""],
      ["Visual Enabled", bool, true],
      ["Collision Enabled", bool, false],
      ["Alpha", number, 1],
      ["Joint States", { kind: "topic", types: ["sensor_msgs/JointState"] }, "/joint_states"],
    ],
  },
  LaserScan: { types: ["sensor_msgs/LaserScan"], settings: [["Topic", topic, ""], ...POINTS("Intensity")] },
  PointCloud2: { types: ["sensor_msgs/PointCloud2"], settings: [["Topic", topic, ""], ...POINTS("")] },
  PointCloud: { types: ["sensor_msgs/PointCloud"], settings: [["Topic", topic, ""], ...POINTS("")] },
  Map: {
    types: ["nav_msgs/OccupancyGrid"],
    settings: [
      ["Topic", topic, ""],
      ["Alpha", number, 0.7],
      ["Color Scheme", scheme(["map", "costmap", "raw"]), "map"],
      ["Draw Behind", bool, false],
    ],
  },
  Marker: {
    types: ["visualization_msgs/Marker"],
    topicKey: "Marker Topic",
    settings: [["Marker Topic", topic, "visualization_marker"]],
  },
  MarkerArray: {
    types: ["visualization_msgs/MarkerArray", "visualization_msgs/Marker"],
    topicKey: "Marker Topic",
    settings: [["Marker Topic", topic, "visualization_marker_array"]],
  },
  InteractiveMarkers: {
    types: ["visualization_msgs/InteractiveMarkerUpdate"],
    topicKey: "Update Topic",
    settings: [
      ["Update Topic", topic, ""],
      ["Show Descriptions", bool, true],
      ["Show Axes", bool, false],
    ],
  },
  Path: {
    types: ["nav_msgs/Path"],
    settings: [
      ["Topic", topic, ""],
      ["Line Style", scheme(["Lines", "Billboards"]), "Lines"],
      ["Line Width", number, 0.03, (settings) => settings["Line Style"] === "Billboards"],
      ["Color", color, "25; 255; 0"],
      ["Alpha", number, 1],
      ["Buffer Length", number, 1],
      ["Offset/X", number, 0],
      ["Offset/Y", number, 0],
      ["Offset/Z", number, 0],
      ["Pose Style", scheme(["None", "Axes", "Arrows"]), "None"],
      ["Length", number, 0.3, isPosed("Axes")],
      ["Radius", number, 0.03, isPosed("Axes")],
      ["Pose Color", color, "255; 85; 255", isPosed("Arrows")],
      ["Shaft Length", number, 0.1, isPosed("Arrows")],
      ["Head Length", number, 0.2, isPosed("Arrows")],
      ["Shaft Diameter", number, 0.1, isPosed("Arrows")],
      ["Head Diameter", number, 0.3, isPosed("Arrows")],
    ],
  },
  Pose: {
    types: ["geometry_msgs/PoseStamped"],
    settings: [["Topic", topic, ""], ["Shape", scheme(["Arrow", "Axes"]), "Arrow"], ...ARROW],
  },
  PoseWithCovariance: {
    types: ["geometry_msgs/PoseWithCovarianceStamped"],
    settings: [
      ["Topic", topic, ""],
      ["Shape", scheme(["Arrow", "Axes"]), "Arrow"],
      ...ARROW,
      ["Covariance/Position/Value", bool, true],
    ],
  },
  PoseArray: {
    types: ["geometry_msgs/PoseArray"],
    settings: [
      ["Topic", topic, ""],
      ["Shape", scheme(["Arrow (Flat)", "Arrow (3D)", "Axes"]), "Arrow (Flat)"],
      ["Color", color, "255; 25; 0", isArrow],
      ["Alpha", number, 1, isArrow],
      ["Arrow Length", number, 0.3, isShape("Arrow (Flat)")],
      ["Head Radius", number, 0.03, isShape("Arrow (3D)")],
      ["Head Length", number, 0.07, isShape("Arrow (3D)")],
      ["Shaft Radius", number, 0.01, isShape("Arrow (3D)")],
      ["Shaft Length", number, 0.23, isShape("Arrow (3D)")],
      ["Axes Length", number, 0.3, isAxes],
      ["Axes Radius", number, 0.01, isAxes],
    ],
  },
  Odometry: {
    types: ["nav_msgs/Odometry"],
    settings: [
      ["Topic", topic, ""],
      ["Keep", number, 100],
      ["Trail", number, 0],
      ["Position Tolerance", number, 0.1],
      ["Angle Tolerance", number, 0.1],
      ["Shape", { kind: "choice", options: ["Arrow", "Axes"] }, "Arrow"],
      ...ARROW,
      ["Covariance/Position/Value", bool, true],
    ],
  },
  Polygon: {
    types: ["geometry_msgs/PolygonStamped"],
    settings: [
      ["Topic", topic, ""],
      ["Color", color, "25; 255; 0"],
      ["Alpha", number, 1],
    ],
  },
  Range: {
    types: ["sensor_msgs/Range"],
    settings: [
      ["Topic", topic, ""],
      ["Color", color, "255; 255; 255"],
      ["Alpha", number, 0.5],
    ],
  },
  PointStamped: {
    types: ["geometry_msgs/PointStamped"],
    settings: [
      ["Topic", topic, ""],
      ["Color", color, "204; 41; 204"],
      ["Alpha", number, 1],
      ["Radius", number, 0.2],
      ["History Length", number, 1],
    ],
  },
  GridCells: {
    types: ["nav_msgs/GridCells"],
    settings: [
      ["Topic", topic, ""],
      ["Color", color, "25; 255; 0"],
      ["Alpha", number, 1],
    ],
  },
  WrenchStamped: {
    types: ["geometry_msgs/WrenchStamped"],
    settings: [
      ["Topic", topic, ""],
      ["Force Color", color, "204; 51; 51"],
      ["Torque Color", color, "204; 204; 51"],
      ["Alpha", number, 1],
      ["Force Arrow Scale", number, 2],
      ["Torque Arrow Scale", number, 2],
      ["Arrow Width", number, 0.5],
      ["Hide Small Values", bool, true],
    ],
  },
  Image: {
    types: ["sensor_msgs/Image"],
    topicKey: "Image Topic",
    isLinked: true,
    settings: [["Image Topic", topic, ""]],
  },
  Camera: {
    types: ["sensor_msgs/Image"],
    topicKey: "Image Topic",
    settings: [
      ["Image Topic", topic, ""],
      ["Image Rendering", scheme(["background and overlay", "background", "overlay"]), "background and overlay"],
      ["Overlay Alpha", number, 0.5, (settings) => settings["Image Rendering"] !== "background"],
      ["Zoom Factor", number, 1],
    ],
  },
  DepthCloud: {
    types: ["sensor_msgs/Image"],
    topicKey: "Depth Map Topic",
    settings: [
      ["Depth Map Topic", topic, ""],
      ["Color Image Topic", { kind: "topic", types: ["sensor_msgs/Image"] }, ""],
      ["Auto Size/Value", bool, true],
      ["Auto Size/Auto Size Factor", number, 1, (settings) => settings["Auto Size"]?.Value !== false],
      ...POINTS(""),
    ],
  },
};
CLASSES.Wrench = CLASSES.WrenchStamped;
const OFFERED_ONCE = new Set(["Camera", "DepthCloud", "Wrench"]);

const PREFIX_2 = /^rviz_(default_plugins|common)\//; // of classes in files of RViz 2
const NAMES_2 = { "Marker Topic": "Topic", "Image Topic": "Topic", "Update Topic": "Interactive Markers Namespace" };

/** Return a class without its package, of RViz or RViz 2. */
export const plainClass = (name) =>
  String(name ?? "")
    .replace(PREFIX_2, "")
    .replace(/^rviz(_plugin_tutorials)?\//, "");
export const classOf = (settings) => plainClass(settings.Class);
export const isOfRviz2 = ({ Class }) => PREFIX_2.test(String(Class ?? ""));
export const topicKeyOf = (name) => CLASSES[name]?.topicKey ?? "Topic";

/** Return the class that shows topics of a type, "" for none. */
export function classForType(type) {
  for (const [name, { types }] of Object.entries(CLASSES))
    if (types?.[0] === type && !OFFERED_ONCE.has(name)) return name;
  return "";
}

/** Return a setting by its path, "Offset/X". A value that RViz writes as a group has it as its "Value". */
export function getSetting(settings, path) {
  let found = settings;
  for (const name of nameIn(settings, path).split("/")) found = found?.[name];
  if (path === "Update Topic" && isOfRviz2(settings)) return found ? `${found}/update` : found;
  return found !== null && typeof found === "object" && !Array.isArray(found) && "Value" in found ? found.Value : found;
}

/** Set a setting by its path. */
export function setSetting(settings, path, value) {
  if (path === "Update Topic" && isOfRviz2(settings)) value = String(value).replace(/\/update$/, "");
  const names = nameIn(settings, path).split("/");
  const last = names.pop();
  let place = settings;
  for (const name of names) {
    if (place[name] === null || typeof place[name] !== "object") place[name] = {};
    place = place[name];
  }
  const old = place[last];
  if (old !== null && typeof old === "object" && "Value" in old) old.Value = value;
  else place[last] = value;
}

/** Return the name that a setting has in this display: some are others in RViz 2. */
const nameIn = (settings, path) => (isOfRviz2(settings) && NAMES_2[path]) || path;

/** Return new settings of a class with RViz's defaults. */
export function newSettings(name, topicName = "") {
  const settings = { Class: `rviz/${name}`, Name: name, Enabled: true, Value: true };
  complete(settings);
  if (topicName) setSetting(settings, topicKeyOf(name), topicName);
  return settings;
}

/** Fill in the settings that are missing. */
export function complete(settings) {
  for (const [path, , usual] of CLASSES[classOf(settings)]?.settings ?? []) {
    const value = getSetting(settings, path);
    if (value === undefined || value === null) setSetting(settings, path, usual);
  }
}
