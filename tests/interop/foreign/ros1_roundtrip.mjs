// Decodes and encodes messages with the dashboard's own code: lines {type, text, hex} in, {hex, json} out.
import { createInterface } from "node:readline";
import { decode, encode, parseDefinition } from "../../../minirospy/web/dashboard/page/js/ros1.js";

const plain = (name, value) => {
  if (typeof value === "bigint") return `${value}`;
  if (ArrayBuffer.isView(value)) return Array.from(value);
  return value;
};
for await (const line of createInterface({ input: process.stdin })) {
  const { type, text, hex } = JSON.parse(line);
  let answer;
  try {
    const definition = parseDefinition(type, text);
    const value = decode(definition, Uint8Array.from(Buffer.from(hex, "hex")));
    answer = { hex: Buffer.from(encode(definition, value)).toString("hex"), json: JSON.stringify(value, plain) };
  } catch (error) {
    answer = { error: `${error.constructor.name}: ${error.message}` };
  }
  console.log(JSON.stringify(answer));
}
