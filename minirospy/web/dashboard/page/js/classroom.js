// The table of a class, from the parameters below /minirospy_class that `minirospy check` sets, and from the topics of
// that name that `minirospy check --share` publishes, which a fleet forwards. Pure.

const ROOT = "/minirospy_class/";
const TOPIC = "/minirospy_class";
const TYPE = "std_msgs/String";
const MAX_STUDENTS = 200;
const MAX_EXERCISES = 100; // columns: the course has 15
const MAX_NAME = 60; // characters of a student's name
const MAX_NODES = 10; // of a student
const MAX_FAILURES = 5; // of an exercise
const MAX_TEXT = 300; // characters, as `minirospy check` cuts them
const MAX_TIME = 4e9; // year 2096 in seconds since 1970, as in results.py
const MAX_MESSAGE = 150_000; // characters: 15 exercises with MAX_FAILURES texts of MAX_TEXT, each as \u0000
const RESULT = ["passed", "ever", "time", "number", "failures"]; // fields of an exercise
const NOW = ["leds", "buttons", "nodes", "beat"]; // fields of the board's state
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
 * Read a message of such a topic; return only the parts that the table shows. Return null if it is no student's.
 * @param {string} text
 */
export function readShared(text) {
  // Python counts characters, JavaScript the units of UTF-16, of which a character has one or two.
  if (text.length > 2 * MAX_MESSAGE || [...text].length > MAX_MESSAGE) return null;
  try {
    const { key, student, now, exercises } = JSON.parse(text);
    if (typeof key !== "string" || !NAME.test(key)) return null;
    const known = entries(exercises).filter(([name, each]) => NAME.test(name) && entries(only(each, RESULT)).length);
    return {
      key,
      student: typeof student === "string" ? cut(student, MAX_NAME) : "",
      now: only(now, NOW),
      // fromEntries, since an exercise may have the name __proto__.
      exercises: Object.fromEntries(known.slice(0, MAX_EXERCISES).map(([name, each]) => [name, only(each, RESULT)])),
    };
  } catch {
    return null;
  }
}

/**
 * Store a topic's message. If there is no room, first drop those of topics that are no channels any more.
 * @param {Map<string, any>} shared
 * @param {string} topic
 * @param {any} found as readShared returns it
 * @param {(topic: string) => boolean} isChannel
 */
export function storeShared(shared, topic, found, isChannel) {
  if (!shared.has(topic) && shared.size >= MAX_STUDENTS)
    for (const each of [...shared.keys()]) if (!isChannel(each)) shared.delete(each);
  if (shared.has(topic) || shared.size < MAX_STUDENTS) shared.set(topic, found);
}

/**
 * Return the student's name, with the robot's if it differs: fresh computers share a name.
 * @param {{name: string, robot: string}} student
 */
export function titleOf({ name, robot }) {
  return robot && robot !== name ? `${name} (${robot})` : name;
}

/**
 * Return the exercises, in the order of the course, and the students, by name. Values of other kinds, which any node
 * may set, are left out. A student with a parameter and a topic has one row, with the later state of the board and the
 * later result of each exercise.
 * @param {Map<string, any>} parameters
 * @param {Map<string, any>} shared The last message of each topic, as readShared returns it.
 * @param {(source: string, beat: number) => number} seenAt Return when a parameter's or topic's beat was first seen.
 */
export function classTable(parameters, shared = new Map(), seenAt = () => 0) {
  const students = new Map(); // id -> student
  const numbers = new Map(); // exercise -> its place in the course
  for (const [path, value] of parameters) {
    if (!path.startsWith(ROOT)) continue;
    const [key, ...parts] = path.slice(ROOT.length).split("/");
    const [part, name, field] = parts;
    if (!NAME.test(key) || !isShown(parts, value)) continue;
    const student = studentOf(students, key, key);
    if (student) setPart(student, numbers, part, name, field, value);
  }
  for (const student of students.values()) if (student.beat) student.at = seenAt(student.key, student.beat);
  for (const [topic, found] of [...shared].sort(([a], [b]) => order(a, b))) {
    const robot = topic.slice(1, -TOPIC.length);
    const known = students.get(found.key);
    const isKnown = known && known.topic === undefined;
    const student = isKnown ? known : studentOf(students, `${robot}/${found.key}`, found.key);
    if (!student) continue;
    student.topic = topic;
    student.robot = cut(robot, MAX_NAME);
    const sent = newStudent(student.key, student.name);
    if (found.student) setPart(sent, numbers, "student", "", "", found.student);
    for (const [name, value] of entries(found.now)) setPart(sent, numbers, "now", name, "", value);
    for (const [name, result] of entries(found.exercises)) {
      for (const [field, value] of entries(result)) setPart(sent, numbers, "exercises", name, field, value);
    }
    if (sent.beat) sent.at = seenAt(topic, sent.beat);
    merge(student, sent);
  }
  const exercises = [...numbers.keys()].sort((a, b) => numbers.get(a) - numbers.get(b) || (a < b ? -1 : 1));
  const listed = [...students.values()].sort(
    (a, b) => order(letters(a.name), letters(b.name)) || order(a.robot, b.robot) || order(a.key, b.key),
  );
  return { exercises, students: listed };
}

/** Return whether a parameter has a value that the table shows. An empty dictionary is sent as a value, too. */
function isShown(parts, value) {
  const [part, name, field] = parts;
  if (parts.length > 3 || isDictionary(value)) return false;
  if (part === "student") return name === undefined && typeof value === "string";
  if (part === "now") return NOW.includes(name) && field === undefined;
  return part === "exercises" && NAME.test(name ?? "") && RESULT.includes(field);
}

/** Return a name's letters for sorting: in upper case, without accents. */
function letters(name) {
  return name.normalize("NFKD").replace(/\p{M}/gu, "").toUpperCase();
}

function order(a, b) {
  if (a === b) return 0;
  return a < b ? -1 : 1;
}

/** Add what a topic sent to a row that may already have the values of parameters. */
function merge(student, sent) {
  student.name = sent.name;
  // Beats begin at 1 again when `minirospy check --share` is restarted, so the time is compared first.
  if (sent.at > student.at || (sent.at === student.at && sent.beat >= student.beat)) {
    const { leds, buttons, nodes, beat, at } = sent;
    Object.assign(student, { leds, buttons, nodes, beat, at });
  }
  for (const [name, result] of sent.results) {
    const old = student.results.get(name);
    const ever = result.ever || old?.ever === true;
    student.results.set(name, { ...(old && old.time > result.time ? old : result), ever });
  }
}

/** Return the student with this id, a new one if there is room, else null. */
function studentOf(students, id, name) {
  if (!students.has(id)) {
    if (students.size >= MAX_STUDENTS) return null;
    students.set(id, newStudent(id, name));
  }
  return students.get(id);
}

/** Return a row without values; "at" is when its beat was first seen, -1 without one. */
function newStudent(key, name) {
  return { key, name, robot: "", results: new Map(), leds: "", buttons: "", nodes: [], beat: 0, at: -1 };
}

/** Return the texts, numbers and lists among the fields of a value, the lists cut. */
function only(value, fields) {
  const isPlain = (each) => Object(each) !== each || Array.isArray(each);
  const found = entries(value).filter(([name, each]) => fields.includes(name) && isPlain(each));
  return Object.fromEntries(found.map(([name, each]) => [name, Array.isArray(each) ? texts(each, MAX_NODES) : each]));
}

function entries(value) {
  return isDictionary(value) ? Object.entries(value) : [];
}

function isDictionary(value) {
  return value !== null && typeof value === "object" && !Array.isArray(value);
}

function setPart(student, numbers, part, name, field, value) {
  if (part === "student" && typeof value === "string") student.name = cut(value, MAX_NAME);
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
  if (!student.results.has(name)) student.results.set(name, { passed: false, ever: false, time: 0, failures: [] });
  const result = student.results.get(name);
  if (field === "number" && Number.isFinite(value)) numbers.set(name, Math.min(numbers.get(name), value));
  else if (field === "time" && typeof value === "number" && value >= 0 && value < MAX_TIME) result.time = value;
  else if (field === "failures" && Array.isArray(value)) result.failures = texts(value, MAX_FAILURES);
  else if (field === "passed") result.passed = value === true;
  if (["passed", "ever"].includes(field)) result.ever ||= value === true;
}

function isLevels(value) {
  return ["string", "number"].includes(typeof value) && /^[01]{0,6}$/.test(String(value));
}

/** Return the first texts of a list, each cut. */
function texts(values, most) {
  return values
    .filter((each) => typeof each === "string")
    .slice(0, most)
    .map((each) => cut(each, MAX_TEXT));
}

/**
 * Return the beginning of a text. Replace each unpaired surrogate by "?", as in Python. Whole characters are counted:
 * an emoji is one.
 */
function cut(text, most) {
  return [...text.slice(0, 2 * most)]
    .slice(0, most)
    .join("")
    .replace(/\p{Cs}/gu, "?");
}
