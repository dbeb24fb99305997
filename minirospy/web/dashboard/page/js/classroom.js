// The table of a class, from the parameters below /minirospy_class that `minirospy check` sets. Pure.

const ROOT = "/minirospy_class/";
const MAX_STUDENTS = 200;
const MAX_EXERCISES = 100; // columns: the course has 15
const MAX_NODES = 10; // of a student
const MAX_FAILURES = 5; // of an exercise
const MAX_TEXT = 300; // characters, as `minirospy check` cuts them
const NAME = /^[A-Za-z0-9_]{1,64}$/;

/**
 * Return the exercises, in the order of the course, and the students, by name. Values of other kinds, which any node
 * may set, are left out.
 * @param {Map<string, any>} parameters
 */
export function classTable(parameters) {
  const students = new Map(); // key -> student
  const numbers = new Map(); // exercise -> its place in the course
  for (const [path, value] of parameters) {
    if (!path.startsWith(ROOT)) continue;
    const [key, part, name, field] = path.slice(ROOT.length).split("/");
    if (!NAME.test(key)) continue;
    if (!students.has(key)) {
      if (students.size >= MAX_STUDENTS) continue;
      students.set(key, { key, name: key, results: new Map(), leds: "", buttons: "", nodes: [], beat: 0 });
    }
    const student = students.get(key);
    if (part === "student" && typeof value === "string") student.name = value.slice(0, 60);
    else if (part === "now") setNow(student, name, value);
    else if (part === "exercises" && name && NAME.test(name)) setResult(student, numbers, name, field, value);
  }
  const exercises = [...numbers.keys()].sort((a, b) => numbers.get(a) - numbers.get(b) || (a < b ? -1 : 1));
  const listed = [...students.values()].sort((a, b) => a.name.localeCompare(b.name) || (a.key < b.key ? -1 : 1));
  return { exercises, students: listed };
}

function setNow(student, name, value) {
  if (["leds", "buttons"].includes(name) && isLevels(value)) student[name] = String(value);
  else if (name === "nodes" && Array.isArray(value)) student.nodes = texts(value, MAX_NODES);
  else if (name === "beat" && Number.isFinite(value)) student.beat = value;
}

function setResult(student, numbers, name, field, value) {
  if (!numbers.has(name)) {
    if (numbers.size >= MAX_EXERCISES) return;
    numbers.set(name, Number.MAX_SAFE_INTEGER);
  }
  if (!student.results.has(name)) student.results.set(name, { passed: false, ever: false, failures: [] });
  const result = student.results.get(name);
  if (field === "number" && Number.isFinite(value)) numbers.set(name, Math.min(numbers.get(name), value));
  else if (["passed", "ever"].includes(field)) result[field] = value === true;
  else if (field === "failures" && Array.isArray(value)) result.failures = texts(value, MAX_FAILURES);
}

function isLevels(value) {
  return ["string", "number"].includes(typeof value) && /^[01]{0,6}$/.test(String(value));
}

/** Return the texts among the first values of a list, each cut. */
function texts(values, most) {
  return values
    .slice(0, most)
    .filter((each) => typeof each === "string")
    .map((each) => each.slice(0, MAX_TEXT));
}
