// Calls the pure parts of the dashboard's 3D view: lines {call, ...} in, one line out for each.
import { createInterface } from "node:readline";
import { colorsOf, pointsOfCloud, pointsOfScan, suitableTransformer, wantedChannels } from "../../../minirospy/web/dashboard/page/js/scene/points.js";
import { Config, readView, writeView } from "../../../minirospy/web/dashboard/page/js/scene/config.js";
import { palette } from "../../../minirospy/web/dashboard/page/js/scene/colors.js";
import { Frames, missingText } from "../../../minirospy/web/dashboard/page/js/scene/transforms.js";
import { linkPoses, parseUrdf } from "../../../minirospy/web/dashboard/page/js/scene/urdf.js";
import { parseXml } from "../../../minirospy/web/dashboard/page/js/scene/xml.js";

let frames = new Frames();
const numbers = (bytes) => Uint8Array.from(Buffer.from(bytes, "hex"));
const CALLS = {
  clear: () => { frames = new Frames(); },
  insert: ({ parent, child, seconds, values: [x, y, z, qx, qy, qz, qw], isStatic }) =>
    frames.insert(parent, child, seconds, { translation: { x, y, z }, rotation: { x: qx, y: qy, z: qz, w: qw } }, isStatic),
  lookup({ target, source, seconds }) {
    try {
      const { p, q } = frames.lookup(target, source, seconds);
      return [...p, ...q];
    } catch (error) {
      return { kind: error.kind, status: missingText(source, target, error) };
    }
  },
  root: () => frames.mainRoot(),
  cloud({ message, settings = {}, stride }) {
    const found = pointsOfCloud({ ...message, data: numbers(message.data) }, wantedChannels(settings), stride);
    return { count: found.count, positions: [...found.positions], colors: settings["Color Transformer"] ? [...(colorsOf(found, settings) ?? [])] : null };
  },
  scan: ({ message }) => [...pointsOfScan(message).positions],
  transformer: ({ names }) => suitableTransformer(names),
  palette: ({ scheme, value }) => [...palette(scheme).slice(value * 4, value * 4 + 4)],
  urdf({ text, positions = {} }) {
    const robot = parseUrdf(text);
    const poses = linkPoses(robot, new Map(Object.entries(positions)));
    return { name: robot.name, root: robot.root, links: Object.fromEntries(robot.links), poses: Object.fromEntries([...poses].map(([name, { p, q }]) => [name, [...p, ...q]])) };
  },
  xml: ({ text }) => parseXml(text),
  config({ raw }) {
    const config = new Config(raw);
    const view = readView(config.view);
    writeView(config.view, view);
    return { fixed: config.fixedFrame, unknown: config.unknown(), shown: config.displays().map(({ settings, depth, isOn }) => [settings.Name, depth, isOn]), view, goal: config.toolTopic("SetGoal", "/usual"), raw: config.raw };
  },
};
for await (const line of createInterface({ input: process.stdin })) {
  const { call, ...words } = JSON.parse(line);
  let answer;
  try {
    answer = { value: CALLS[call](words) ?? null };
  } catch (error) {
    answer = { error: `${error.constructor.name}: ${error.message}` };
  }
  console.log(JSON.stringify(answer));
}
