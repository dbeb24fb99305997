// The table of a class, from the parameters below /minirospy_class that `minirospy check` sets, and from the topics of
// that name that `minirospy check --share` publishes, which a fleet forwards. Pure.

const ROOT = "/minirospy_class/";
const TOPIC = "/minirospy_class";
const TYPE = "std_msgs/String";
const MAX_STUDENTS = 200;
const MAX_EXERCISES = 100; // columns: the course has 15
const MAX_NODES = 10; // of a student
const MAX_FAILURES = 5; // of an exercise
const MAX_TEXT = 300; // characters, as `minirospy check` cuts them
const NAME = /^[A-Za-z0-9_]{1,64}$/;

/**
 * Return the topics of students' computers among the channels.
 * @param {Iterable<{topic: string, type: string}>} channels
 */
export function classTopics(channels) {
  const found = [...channels].filter(({ topic, type }) => type === TYPE && topic.endsWith(TOPIC));
  return found.map(({ topic }) => topic).slice(0, MAX_STUDENTS);
}

/**
 * Read a message of such a topic. Return null if it is no student's.
 * @param {string} text
 */
export function readShared(text) {
  try {
    const found = JSON.parse(text);
    return NAME.test(found.key) && typeof found.key === "string" ? found : null;
  } catch {
    return null;
  }
}

/**
 * Return the exercises, in the order of the course, and the students, by name. Values of other kinds, which any node
 * may set, are left out. A student with a parameter and a topic has one row, with the topic's values.
 * @param {Map<string, any>} parameters
 * @param {Map<string, any>} shared The last message of each topic, as readShared returns it.
 */
export function classTable(parameters, shared = new Map()) {
  const students = new Map(); // id -> student
  const numbers = new Map(); // exercise -> its place in the course
  for (const [path, value] of parameters) {
    if (!path.startsWith(ROOT)) continue;
    const [key, part, name, field] = path.slice(ROOT.length).split("/");
    if (!NAME.test(key)) continue;
    const student = studentOf(students, key, key);
    if (student) setPart(student, numbers, part, name, field, value);
  }
  for (const [topic, found] of shared) {
    const robot = topic.slice(1, -TOPIC.length);
    const known = students.get(found.key);
    const isKnown = known && known.topic === undefined;
    const student = isKnown ? known : studentOf(students, `${robot}/${found.key}`, found.key);
    if (!student) continue;
    student.topic = topic;
    student.robot = robot;
    setPart(student, numbers, "student", "", "", found.student);
    for (const [name, value] of entries(found.now)) setPart(student, numbers, "now", name, "", value);
    for (const [name, result] of entries(found.exercises)) {
      for (const [field, value] of entries(result)) setPart(student, numbers, "exercises", name, field, value);
    }
  }
  const exercises = [...numbers.keys()].sort((a, b) => numbers.get(a) - numbers.get(b) || (a < b ? -1 : 1));
  const listed = [...students.values()].sort((a, b) => a.name.localeCompare(b.name) || (a.key < b.key ? -1 : 1));
  return { exercises, students: listed };
}

/** Return the student with this id, a new one if there is room, else null. */
function studentOf(students, id, name) {
  if (!students.has(id)) {
    if (students.size >= MAX_STUDENTS) return null;
    students.set(id, { key: id, name, robot: "", results: new Map(), leds: "", buttons: "", nodes: [], beat: 0 });
  }
  return students.get(id);
}

function entries(value) {
  return value && typeof value === "object" && !Array.isArray(value) ? Object.entries(value) : [];
}

function setPart(student, numbers, part, name, field, value) {
  if (part === "student" && typeof value === "string") student.name = value.slice(0, 60);
  else if (part === "now") setNow(student, name, value);
  else if (part === "exercises" && name && NAME.test(name)) setResult(student, numbers, name, field, value);
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
