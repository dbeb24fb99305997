// Actions as topics: which servers there are, the goals that their status names, ids of new goals. Pure.
// Source: http://wiki.ros.org/actionlib/DetailedDescription.

const STATUS_TYPE = "actionlib_msgs/GoalStatusArray";
const STATUSES = [
  "Pending",
  "Active",
  "Preempted",
  "Succeeded",
  "Aborted",
  "Rejected",
  "Preempting",
  "Recalling",
  "Recalled",
  "Lost",
];
const RUNNING = new Set([0, 1, 6, 7]);

/** Return the action servers among topics (name -> {type}): [{name, type}], type without its ending "Action". */
export function actionServers(channels) {
  const found = [];
  for (const [topic, { type }] of channels) {
    if (type !== STATUS_TYPE || !topic.endsWith("/status")) continue;
    const name = topic.slice(0, -"/status".length);
    const action =
      /^(.+)ActionFeedback$/.exec(channels.get(`${name}/feedback`)?.type ?? "") ??
      /^(.+)ActionResult$/.exec(channels.get(`${name}/result`)?.type ?? "");
    if (action) found.push({ name, type: action[1] });
  }
  return found;
}

/** Return a status in words. */
export function statusWord(status) {
  return STATUSES[status] ?? `status ${status}`;
}

/** Return whether a goal of this status still runs, so that it can be cancelled. */
export function isRunning(status) {
  return RUNNING.has(status);
}

/** Return a time as a stamp of a message, of seconds. */
export function stampOf(seconds) {
  const secs = Math.floor(seconds);
  return { secs, nsecs: Math.min(999_999_999, Math.round((seconds - secs) * 1e9)) };
}

/**
 * Return the share that a feedback names, from 0 to 1, by a field such as percent_complete; null if there is none.
 */
export function progressOf(feedback) {
  for (const [name, value] of Object.entries(feedback ?? {})) {
    if (typeof value !== "number" || !Number.isFinite(value)) continue;
    if (/percent/i.test(name)) return Math.min(1, Math.max(0, value / 100));
    if (/progress|fraction/i.test(name)) return Math.min(1, Math.max(0, value > 1 ? value / 100 : value));
  }
  return null;
}
