// Log lines: their fields, what filters them, and their text. Pure.

export const LEVELS = [[1, "Debug"], [2, "Info"], [4, "Warn"], [8, "Error"], [16, "Fatal"]];
export const NAMES = new Map(LEVELS);

/** Return a line of rosgraph_msgs/Log. */
export function lineOf({ message, seconds }) {
  const stamp = message.header.stamp.secs + message.header.stamp.nsecs * 1e-9 || seconds;
  return { stamp, level: message.level, node: message.name, text: message.msg, file: message.file, line: message.line, function: message.function };
}

/** Return a function that says whether a line passes. Throws SyntaxError on a bad regular expression. */
export function filterOf({ levels, node, text, isRegex, isExcluded }) {
  const words = text.toLowerCase();
  const pattern = isRegex && text ? new RegExp(text, "i") : null;
  return (line) => {
    if (!levels.has(line.level) || (node && line.node !== node)) return false;
    if (!text) return true;
    const found = pattern ? pattern.test(line.text) || pattern.test(line.node) : `${line.node} ${line.text}`.toLowerCase().includes(words);
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
  const rows = lines.map((each) => [each.stamp.toFixed(6), NAMES.get(each.level) ?? each.level, each.node, each.text, `${each.file}:${each.line}`, each.function]);
  return [["time", "level", "node", "message", "file", "function"], ...rows].map((row) => row.map(quoted).join(",")).join("\r\n") + "\r\n";
}
