// A small parser of XML, for robot descriptions. Pure. Not for documents with entities or namespaces of their own.

import { t } from "../texts.js";

export class XmlError extends Error {}

const NAMED = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };
const TOKEN =
  /<!--[\s\S]*?-->|<!\[CDATA\[([\s\S]*?)\]\]>|<\?[\s\S]*?\?>|<!DOCTYPE[^>[]*(?:\[[^\]]*\])?[^>]*>|<\/([^\s>]+)\s*>|<([A-Za-z_][^\s/>]*)((?:\s+[^\s=/>]+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*(\/?)>|([^<]+)/gy;
const ATTRIBUTE = /([^\s=]+)\s*=\s*(?:"([^"]*)"|'([^']*)')/g;
const MAX_DEPTH = 500;

/** Return the root element: {name, attributes, children, text}. Throws XmlError with the line. */
export function parseXml(text) {
  const top = { name: "", attributes: {}, children: [], text: "" };
  const open = [top];
  const fail = (at, what) => {
    throw new XmlError(t("line {line}: {what}", { line: text.slice(0, at).split("\n").length, what }));
  };

  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < text.length) {
    const start = TOKEN.lastIndex;
    const found = TOKEN.exec(text);
    if (!found) fail(start, t('"{text}" is not XML', { text: text.slice(start, start + 30).split("\n")[0] }));
    const [, data, closed, name, attributes, isEmpty, plain] = found;
    const inside = open.at(-1);
    if (data !== undefined) inside.text += data;
    else if (plain !== undefined) inside.text += decoded(plain);
    else if (closed !== undefined) {
      if (inside.name !== closed || open.length === 1)
        fail(
          start,
          t("</{name}>, where {wanted} is expected", {
            name: closed,
            wanted: inside.name ? `</${inside.name}>` : t("the end"),
          }),
        );
      open.pop();
    } else if (name !== undefined) {
      const element = { name, attributes: Object.create(null), children: [], text: "" };
      for (const [, key, double, single] of attributes.matchAll(ATTRIBUTE))
        element.attributes[key] = decoded(double ?? single);
      inside.children.push(element);
      if (!isEmpty) open.push(element);
      if (open.length > MAX_DEPTH) fail(start, t("elements are nested too deeply"));
    }
  }
  if (open.length > 1) fail(text.length, t("</{name}> is missing", { name: open.at(-1).name }));
  if (top.children.length !== 1) fail(text.length, t("there is not one element around all others"));
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
