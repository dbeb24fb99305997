// A small parser of XML, for robot descriptions. Pure. Not for documents with entities or namespaces of their own.

export class XmlError extends Error {}

const NAMED = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };
const TOKEN = /<!--[\s\S]*?-->|<!\[CDATA\[([\s\S]*?)\]\]>|<\?[\s\S]*?\?>|<!DOCTYPE[^>[]*(?:\[[^\]]*\])?[^>]*>|<\/([^\s>]+)\s*>|<([A-Za-z_][^\s/>]*)((?:\s+[^\s=/>]+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*(\/?)>|([^<]+)/gy;
const ATTRIBUTE = /([^\s=]+)\s*=\s*(?:"([^"]*)"|'([^']*)')/g;
const MOST_DEPTH = 500;

/** Return the root element: {name, attributes, children, text}. Throws XmlError with the line. */
export function parseXml(text) {
  const top = { name: "", attributes: {}, children: [], text: "" };
  const open = [top];
  const fail = (at, what) => { throw new XmlError(`line ${text.slice(0, at).split("\n").length}: ${what}`); };

  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < text.length) {
    const start = TOKEN.lastIndex;
    const found = TOKEN.exec(text);
    if (!found) fail(start, `"${text.slice(start, start + 30).split("\n")[0]}" is not XML`);
    const [, data, closed, name, attributes, isEmpty, plain] = found;
    const inside = open.at(-1);
    if (data !== undefined) inside.text += data;
    else if (plain !== undefined) inside.text += decoded(plain);
    else if (closed !== undefined) {
      if (inside.name !== closed || open.length === 1) fail(start, `</${closed}>, where ${inside.name ? `</${inside.name}>` : "the end"} is expected`);
      open.pop();
    } else if (name !== undefined) {
      const element = { name, attributes: Object.create(null), children: [], text: "" };
      for (const [, key, double, single] of attributes.matchAll(ATTRIBUTE)) element.attributes[key] = decoded(double ?? single);
      inside.children.push(element);
      if (!isEmpty) open.push(element);
      if (open.length > MOST_DEPTH) fail(start, "elements are nested too deeply");
    }
  }
  if (open.length > 1) fail(text.length, `</${open.at(-1).name}> is missing`);
  if (top.children.length !== 1) fail(text.length, "there is not one element around all others");
  return top.children[0];
}

function decoded(text) {
  if (!text.includes("&")) return text;
  return text.replace(/&(#x[0-9a-fA-F]+|#\d+|\w+);/g, (whole, name) => {
    if (!name.startsWith("#")) return NAMED[name] ?? whole;
    const code = name[1] === "x" ? parseInt(name.slice(2), 16) : Number(name.slice(1));
    return code <= 0x10ffff ? String.fromCodePoint(code) : whole;
  });
}
