// Log lines: their fields, what filters them, and their text. Pure.

/** @type {[number, string][]} */
export const LEVELS = [
  [1, "Debug"],
  [2, "Info"],
  [4, "Warn"],
  [8, "Error"],
  [16, "Fatal"],
];
export const NAMES = new Map(LEVELS);

/** Return a line of rosgraph_msgs/Log. */
export function lineOf({ message, seconds }) {
  const stamp = message.header.stamp.secs + message.header.stamp.nsecs * 1e-9 || seconds;
  return {
    stamp,
    level: message.level,
    node: message.name,
    text: message.msg,
    file: message.file,
    line: message.line,
    function: message.function,
  };
}

// As rosout.log has a line, a node's own log, and what a node prints.
const HEADS = [
  /^(?<stamp>\d+\.\d+) (?<level>DEBUG|INFO|WARN|ERROR|FATAL) +(?<node>\S+) \[(?<file>[^\]]*?):(?<line>\d+)\((?<function>[^)]*)\)\](?: \[topics: [^\]]*\])? ?(?<text>.*)$/,
  /^\[(?<node>[\w.]+)\]\[(?<level>DEBUG|INFO|WARNING|ERROR|CRITICAL)\] (?<day>\d{4}-\d\d-\d\d) (?<time>\d\d:\d\d:\d\d),(?<part>\d{3}): ?(?<text>.*)$/,
  /^\[ ?(?<level>DEBUG|INFO|WARN|ERROR|FATAL)\] \[(?<stamp>\d+\.\d+)(?:, \d+\.\d+)?\]: ?(?<text>.*)$/,
];
const WORDS = { DEBUG: 1, INFO: 2, WARN: 4, WARNING: 4, ERROR: 8, CRITICAL: 16, FATAL: 16 };

/**
 * Return the lines of a log file; what follows a line without a head of its own belongs to it. `name` is for those that
 * name no node.
 */
export function linesOf(text, name) {
  const found = [];
  for (const row of text.replace(/\x1b\[[\d;]*m/g, "").split(/\r?\n/)) {
    const { groups: head } = HEADS.map((each) => each.exec(row)).find(Boolean) ?? {};
    if (head) {
      const stamp = head.stamp
        ? Number(head.stamp)
        : new Date(`${head.day}T${head.time}.${head.part}`).getTime() / 1000;
      found.push({
        stamp,
        level: WORDS[head.level],
        node: head.node ?? name,
        text: head.text,
        file: head.file ?? name,
        line: Number(head.line ?? 0),
        function: head.function ?? "",
      });
    } else if (found.length) found.at(-1).text += `\n${row}`;
    else if (row.trim()) found.push({ stamp: 0, level: 2, node: name, text: row, file: name, line: 0, function: "" });
  }
  for (const line of found) line.text = line.text.trimEnd();
  return found;
}

/** Return a function that says whether a line passes. Throws SyntaxError on a bad regular expression. */
export function filterOf({ levels, node, text, isRegex, isExcluded }) {
  const words = text.toLowerCase();
  const pattern = isRegex && text ? new RegExp(text, "i") : null;
  return (line) => {
    if (!levels.has(line.level) || (node && line.node !== node)) return false;
    if (!text) return true;
    const found = pattern
      ? pattern.test(line.text) || pattern.test(line.node)
      : `${line.node} ${line.text}`.toLowerCase().includes(words);
    return found !== isExcluded;
  };
}

export function timeText(seconds) {
  // Simulated time starts at 0: it is shown as it is.
  if (seconds < 1e8) return seconds.toFixed(3);
  const date = new Date(seconds * 1000);
  const two = (value, digits = 2) => String(value).padStart(digits, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${two(date.getMilliseconds(), 3)}`;
}

/** Return a line as rosconsole prints it. */
export function plainText(line) {
  return `[${(NAMES.get(line.level) ?? String(line.level)).toUpperCase()}] [${line.stamp.toFixed(6)}] [${line.node}]: ${line.text}`;
}

/** Return lines as CSV. */
export function csv(lines) {
  const quoted = (value) => `"${String(value).replaceAll('"', '""')}"`;
  const rows = lines.map((each) => [
    each.stamp.toFixed(6),
    NAMES.get(each.level) ?? each.level,
    each.node,
    each.text,
    `${each.file}:${each.line}`,
    each.function,
  ]);
  return (
    [["time", "level", "node", "message", "file", "function"], ...rows]
      .map((row) => row.map(quoted).join(","))
      .join("\r\n") + "\r\n"
  );
}
