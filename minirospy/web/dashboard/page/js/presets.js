// Layouts that come with the page. Pure.

const MAX_ROBOTS = 8;
const SYSTEM = new Set([
  "rosout",
  "rosout_agg",
  "tf",
  "tf_static",
  "clock",
  "diagnostics",
  "diagnostics_agg",
  "statistics",
]);
const ROBOTIC = new Set(["cmd_vel", "button_state", "odom", "pose", "scan", "joint_states", "joy"]);

/** Name -> [title, what it is for, text of the layout]; that of the classroom is made of what there is. */
export const PRESETS = {
  workshop: [
    "Workshop",
    "the board, its button in a plot, the log lines, the graph",
    "row(45:column(60:board,40:console),55:column(plot?path=%2Fbutton_state&window=30,graph))",
  ],
  console: [
    "Console",
    "log lines, topics, diagnostics and parameters",
    "row(60:column(60:console,40:topics),40:column(diagnostics,parameters))",
  ],
  rviz: ["RViz", "the robot in 3D with its camera and diagnostics", "row(72:3d,28:column(image,diagnostics))"],
  teleop: [
    "Teleop",
    "a stick, the camera, and a plot of the speeds",
    "row(38:teleop,62:column(60:image,40:plot?path=%2Fcmd_vel%2Flinear%2Fx&path=%2Fcmd_vel%2Fangular%2Fz&window=30))",
  ],
  classroom: ["Classroom", "the boards and robots of a group side by side", null],
};

/** Return the namespaces of robots: /NAME of the topics /NAME/cmd_vel, /NAME/odom and the like. */
export function robotsOf(topics) {
  const found = new Set();
  for (const topic of topics) {
    const [, space, name, ...more] = topic.split("/");
    if (name && !more.length && ROBOTIC.has(name) && !SYSTEM.has(space)) found.add(`/${space}`);
  }
  return [...found].sort();
}

/**
 * Return the layout of a classroom: the table of the class, boards in a grid, below them for each robot what drives it
 * or what it has. The table is there before the first result, because the teacher opens the page first.
 */
export function classroom({ boards, topics }) {
  const names = new Set(topics);
  const query = (words) => new URLSearchParams(words).toString();
  const cells = boards.slice(0, MAX_ROBOTS).map((board) => `board?${query({ board })}`);
  const robots = robotsOf(topics)
    .slice(0, MAX_ROBOTS)
    .map((space) => {
      if (names.has(`${space}/button_state`)) return `plot?${query({ path: `${space}/button_state`, window: "30" })}`;
      if (names.has(`${space}/cmd_vel`)) return `teleop?${query({ topic: `${space}/cmd_vel` })}`;
      return `topics?${query({ filter: `${space}/` })}`;
    });
  const rows = [...grid(cells), ...grid(robots)];
  return `column(${["class", ...(rows.length ? [...rows, "console"] : ["row(board,console)"])].join(",")})`;
}

/** Return rows of about as many cells as there are rows, three at most. */
function grid(cells) {
  const width = Math.min(3, Math.ceil(Math.sqrt(cells.length)));
  const rows = [];
  for (let first = 0; first < cells.length; first += width)
    rows.push(`row(${cells.slice(first, first + width).join(",")})`);
  return rows;
}
