// Calls pure functions of the dashboard's page: lines [module, function, arguments] in, the result or {error} out; results as JSON.
import { createInterface } from "node:readline";

const plain = (name, value) => {
  if (typeof value === "bigint" || (typeof value === "number" && !Number.isFinite(value))) return `${value}`;
  if (value instanceof Map) return Object.fromEntries(value);
  if (ArrayBuffer.isView(value)) return Array.from(value);
  return value;
};
for await (const line of createInterface({ input: process.stdin })) {
  const [module, name, given] = JSON.parse(line);
  let answer;
  try {
    const functions = await import(`../../../minirospy/dashboard/page/js/${module}.js`);
    // A Map is written as {"map": [[key, value], ...]}.
    answer = functions[name](...given.map((each) => (each?.map && !Array.isArray(each) ? new Map(each.map) : each))) ?? null;
  } catch (error) {
    answer = { error: error.message };
  }
  console.log(JSON.stringify(answer, plain));
}
