// Calls pure functions of the dashboard's page: lines [module, function, arguments] in, the result or {error} out; results as JSON.
import { createInterface } from "node:readline";

const plain = (name, value) => {
  if (typeof value === "bigint" || (typeof value === "number" && !Number.isFinite(value))) return `${value}`;
  if (value instanceof Map) return Object.fromEntries(value);
  if (value instanceof Set) return [...value];
  if (ArrayBuffer.isView(value)) return Array.from(value);
  return value;
};
for await (const line of createInterface({ input: process.stdin })) {
  // A Map is written as {"map": [[key, value], ...]}.
  const [module, name, given] = JSON.parse(line, (_, value) => (Array.isArray(value?.map) && !Array.isArray(value) ? new Map(value.map) : value));
  let answer;
  try {
    const functions = await import(`../../../minirospy/web/dashboard/page/js/${module}.js`);
    answer = functions[name](...given) ?? null;
  } catch (error) {
    answer = { error: error.message };
  }
  console.log(JSON.stringify(answer, plain));
}
