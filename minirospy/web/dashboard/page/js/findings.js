// The texts of `minirospy doctor` in the person's language: the server sends them in English. Pure.

import { t } from "./texts.js";

const MAX_TEXT = 2000; // characters; longer ones stay English, because patterns are slow on them

// {name} stands for what differs. A text that is not in the list stays English, as a node's name does.
export const TEXTS = [
  // the master
  "no ROS master answers at {uri}: start one with `roscore`, or set ROS_MASTER_URI to the machine where it runs",
  "none runs on this machine at {uri}",
  "start `roscore`, or set ROS_MASTER_URI to the machine where it runs",
  "it answered, and then no more: {why}",
  "look at its terminal",
  "this machine does not know the name '{host}' of ROS_MASTER_URI={uri}",
  "use the address of that machine, or add '{host}' to the hosts file of this one",
  "{host} is there, but nothing listens at {uri}",
  "start `roscore` on {host}; if it runs, it listens on loopback alone, since ROS_IP or ROS_HOSTNAME is that there, or on another port",
  "see that {host} is on and has that address (`ping {again}`); if it answers, its firewall drops what comes to TCP port {port}",
  "no way leads to {uri}: {why}",
  "see that both machines are in one network, and that no firewall refuses",
  "{uri} accepts connections, but does not answer ({why})",
  "it is busy, or suspended: after Ctrl-Z, `fg` in its terminal continues it",
  "what answers at {uri} is not a ROS master: {why}",
  "correct the port in ROS_MASTER_URI, or end that program",
  "see docs/network.md",
  "that of {machine} is {seconds} s ahead of this one",
  "that of {machine} is {seconds} s behind this one",
  "the master's machine ({host})",
  "let both follow one time server (chrony, ntp): stamps and transforms of one are wrong for the other",
  // shared memory
  "does not work: {why}; large messages use sockets, which is slower",
  "in a container: allow memfd_create, eventfd2 and /proc, and enough memory",
  // topics, connections and services
  "nobody publishes {topics}",
  "start the publisher, or correct the topic's name",
  "{topic} has nodes of different types, which never connect: {types}",
  "use one type, or two names",
  "{subscriber} does not get {topics} of {publisher}",
  "{node} has another definition of {type} than this machine: build all sides from the same one",
  "run `minirospy doctor` on the machine of {node}: it does not reach '{host}', or has another definition of the type",
  "{service} of {node} does not answer: {why}",
  "start its node again; if that one runs elsewhere, its port for services is blocked: see MINIROSPY_PORTS",
  "its node has another definition of {type} than this machine",
  "build both machines from the same definition",
  // nodes that do not answer
  "are registered as being at '{host}', a name that this machine does not know",
  "on '{host}' set ROS_IP to its address and start them again, or add '{again}' to the hosts file here",
  "are registered as being at '{host}', by which each machine reaches itself alone",
  "on their machine set ROS_IP to its address and start them again",
  "nothing listens at their port on '{host}'",
  "if they were killed, `rosnode cleanup` makes the master forget them; if they run, they registered a wrong address: set ROS_IP on their machine",
  "connections to it on '{host}' are accepted, but nothing is answered ({why})",
  "another program answers at their port on '{host}': {why}",
  "`rosnode cleanup` makes the master forget them",
  "nothing comes back from '{host}'",
  "nothing comes back from {uri}",
  "no way leads to '{host}'",
  "if `ping {host}` fails too: on their machine set ROS_IP to an address that this one reaches (`rosnode cleanup` if it is off); if not, a firewall is in the way: see MINIROSPY_PORTS",
  "the name is not known",
  "the name '{host}' is not known",
  "no answer",
  "connection refused",
  "timed out",
  "timed out after {seconds} s",
  "it is the node {node}",
  "the master does not know its address",
  // the way back
  "no server can be opened here: {why}",
  "correct ROS_IP, or MINIROSPY_PORTS",
  "this machine does not reach its own node at '{host}': {why}",
  "set ROS_IP to an address of this machine, or unset ROS_IP and ROS_HOSTNAME",
  "the master reaches this machine, but {nodes} gets no topic from it",
  "a firewall lets only some ports through: open TCP port {port} too (see MINIROSPY_PORTS)",
  "{machine} does not reach this one at {address}: {why}",
  "{machine} does not reach this one at {address}",
  "a firewall keeps it from TCP ports {one} and {other} of this machine: open them, or set MINIROSPY_PORTS to ports that are open",
  "{advice}; or it takes '{host}' for another machine: {command}",
  "{command}; if that does not do, {advice}",
  "export ROS_IP=<the address by which it reaches this machine>",
  "the doctor that listens at '{host}' is not reached: {why}",
  "{service} did not answer as a doctor: {answer}",
  "end that node",
  "it reaches this machine, and this one does not reach it at {address}: {why}",
  "see there what to do",
  // frames
  "no transforms, but other bytes: {nodes}",
  "publish tf2_msgs/TFMessage there",
  "nothing came on /tf while listening",
  "`rosrun tf tf_monitor` shows when something does",
  "listeners ignore it: correct what that node publishes",
  "[{frame}] has {count} parents ({parents}), published by {nodes}: lookups jump from one to the other",
  "let one node publish it, with one parent",
  "[{frame}] is published by {count} nodes ({nodes}): it may jump",
  "stop all but one of them (two drivers, two robot_state_publishers, a bag that is played besides?)",
  "a loop, which makes every lookup there fail: {frames}",
  "take one of them out",
  "{count} trees that are not connected, with the roots {roots} ({hint}: was one of them meant?)",
  "{count} trees that are not connected, with the roots {roots}",
  "publish a transform between them (`rosrun tf2_ros static_transform_publisher`), or correct the name",
  "{node} stamps its transforms ({frame}) {seconds} s ahead: lookups of now fail, or take old ones",
  "set the clocks of both machines by the same server (chrony, ntp); `minirospy doctor` says whose is off",
  "{node} stamps its transforms ({frame}) {seconds} s behind: lookups of now fail (extrapolation into the future)",
  "if its machine's clock is right, the node is late or a bag is played without --clock and /use_sim_time",
  // Python and the libraries
  "{version}; `import rospy` finds nothing",
  "run without -I and -S, or install minirospy again: its .pth file puts rospy on the path",
  "Python 3.12.0 to 3.12.2 start no more threads once the main thread has ended, which nodes need until their end: use 3.12.3 or later",
  "install a newer Python, and make the environment again",
  "{file} hides the module {module} from programs in this folder",
  "give it another name",
  "not installed: {packages}",
  // variables
  "correct it, or unset it",
  "ROS_HOSTNAME={host} and ROS_IP={address} are both set, and say different things: ROS_HOSTNAME counts",
  "ROS_HOSTNAME={host} and ROS_IP={address} are both set: ROS_HOSTNAME counts",
  "ROS_IP={address} is a name, not an IP address",
  "ROS_IP={address} is not a whole IP address",
  "export ROS_IP=<an address of this machine>",
  "unset ROS_HOSTNAME; export ROS_IP=<an address of this machine>",
  "this machine's name '{host}'",
  "{variable} is neither an IP address nor a name that this machine knows",
  "{variable} is not a name that this machine knows",
  "{variable} is every address and none: nobody can connect to a node there",
  "{variable} is an IPv6 address, and nodes listen on IPv4 alone",
  "{variable} is this machine alone, but the master is on another one ({host})",
  "{variable} is {address} here, which other machines cannot use unless they know that name",
  "{variable} is not an address of this machine: right only behind NAT or in a container",
  "{variable} is {addresses}, not an address of this machine: right only behind NAT or in a container",
  "ROS_IPV6={value} has no effect",
  "export ROS_IPV6=on, or unset it",
  "ROS_NAMESPACE={name} is not a legal name",
  "letters, digits, _ and /, a letter first",
  "ROS_PACKAGE_PATH names {folder}, which is not a folder",
  "take it out of the variable",
  "ROS_PYTHON_LOG_CONFIG_FILE={file} is not a file",
  "unset it",
  "logs cannot be written to {folder}: {file} may not be written by this user",
  "logs cannot be written to {folder}: {file} is a file, no folder",
  "export {variable}=<a folder of your own>, or `sudo chown -R $USER {folder}`",
  "export {variable}=<a folder of your own>",
  // packages
  "the workspace {folder} is not in this terminal's environment",
  "{package} is in {folders}: the first counts",
  "remove or rename one of them",
  "{files} and others: changed since the last catkin_make; run it in {folder}",
  "{files}: changed since the last catkin_make; run it in {folder}",
  "correct its package.xml",
  "{package} needs {packages}, which is not a package here",
  "put it into a folder of ROS_PACKAGE_PATH; if it is not a ROS package, nothing need be done",
  // lists
  "{names} and {count} more",
];

// Texts inside of others, as in a list of topics.
export const PARTS = ["; {topic} is published", "[{frame}] is nearly [{other}]"];

/** Return the names of what differs in a text, and a regular expression in which `value` stands for each. */
function patternOf(text, value) {
  const names = [...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
  const parts = text.split(/\{\w+\}/).map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  return { text, names, source: parts.join(value) };
}

const PATTERNS = TEXTS.map((text) => {
  const { names, source } = patternOf(text, "(.+)");
  return { text, names, pattern: new RegExp(`^${source}$`, "s") };
});
const INNER = PARTS.map((text) => {
  const { names, source } = patternOf(text, "([^\\s;()[\\]]+)");
  return { text, names, pattern: new RegExp(source, "g") };
});

/** Return a finding's text, or its advice, in the person's language. What is in it, as a reason, is translated too. */
export function translated(finding) {
  if (finding.length > MAX_TEXT) return finding;
  for (const { text, names, pattern } of PATTERNS) {
    const found = pattern.exec(finding);
    if (found) return filled({ text, names }, found.slice(1).map(translated));
  }
  // A finding about nodes starts with their names.
  const [, names, rest] = /^(\/[^:]*): (.+)$/s.exec(finding) ?? [];
  if (rest) return translated(names) + ": " + translated(rest);
  return INNER.reduce((text, part) => text.replace(part.pattern, (_, ...found) => filled(part, found)), finding);
}

/** Return a text in the person's language with these values. */
function filled({ text, names }, values) {
  return t(text, Object.fromEntries(names.map((name, index) => [name, values[index]])));
}
