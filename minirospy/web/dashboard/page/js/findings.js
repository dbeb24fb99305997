// The texts of `minirospy doctor` in the person's language: the server sends them in English. Pure.

import { t } from "./texts.js";

// {name} stands for what differs. A text that is not in the list stays English, as a node's name does.
export const TEXTS = [
  "no ROS master answers at {uri}: start one with `roscore`, or set ROS_MASTER_URI to the machine where it runs",
  "none runs on this machine at {uri}",
  "start `roscore`, or set ROS_MASTER_URI to the machine where it runs",
  "it answered, and then no more: {why}",
  "nobody publishes {topics}",
  "start the publisher, or correct the topic's name",
  "{topic} has nodes of different types, which never connect: {types}",
  "use one type, or two names",
  "{nodes}: nothing listens at their port on '{host}'",
  "nothing listens at their port on '{host}'",
  "if they were killed, `rosnode cleanup` makes the master forget them; if they run, they registered a wrong address: set ROS_IP on their machine",
  "{nodes}: nothing comes back from '{host}'",
  "nothing comes back from '{host}'",
  "{subscriber} does not get {topics} of {publisher}",
  "{service} of {node} does not answer: {why}",
  "start its node again; if that one runs elsewhere, its port for services is blocked: see MINIROSPY_PORTS",
  "not installed: {packages}",
];

const PATTERNS = TEXTS.map((text) => {
  const names = [...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
  const parts = text.split(/\{\w+\}/).map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  return { text, names, pattern: new RegExp(`^${parts.join("(.+)")}$`, "s") };
});

/** Return a finding's text, or its advice, in the person's language. */
export function translated(finding) {
  for (const { text, names, pattern } of PATTERNS) {
    const found = pattern.exec(finding);
    if (found) return t(text, Object.fromEntries(names.map((name, index) => [name, found[index + 1]])));
  }
  return finding;
}
