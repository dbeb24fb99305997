// A small parser of XML, for robot descriptions. Pure. Not for documents with entities or namespaces of their own.
// It passes over the faults that ROS's parser (TinyXML) passes over, and notes each kind once, as
// minirospy/base/tinyxml.py does.

import { t } from "../texts.js";

export class XmlError extends Error {}

const NAMED = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };
const TOKEN =
  /<!--[\s\S]*?-->|<!\[CDATA\[([\s\S]*?)\]\]>|(<\?xml\b[\s\S]*?\?>)|<\?[\s\S]*?\?>|<!DOCTYPE[^>[]*(?:\[[^\]]*\])?[^>]*>|<\/([^\s>]+)\s*>|<([A-Za-z_][^\s/>=\x22\x27<]*)((?:\s*[^\s=/>\x22\x27<]+\s*=\s*(?:"[^"]*"|'[^']*'|[^\s\x22\x27<>=/]+(?=[\s/>])))*)\s*(\/?)>|([^<]+)/gy;
const ATTRIBUTE = /(\s*)([^\s=]+)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s\x22\x27<>=/]+))/g;
const PLAIN_DECLARATION = /^<\?xml\s+version\s*=\s*(["'])1(?:\.\d)?\1/;
const MAX_DEPTH = 500;

/**
 * Return the root element: {name, attributes, children, text}, and as `notes` a line for each kind of fault that was
 * passed over. Throws XmlError with the line.
 */
export function parseXml(text) {
  const top = { name: "", attributes: {}, children: [], text: "" };
  const open = [top];
  const notes = new Map();
  const lineAt = (at) => text.slice(0, at).split("\n").length;
  const fail = (at, what) => {
    throw new XmlError(t("line {line}: {what}", { line: lineAt(at), what }));
  };
  const note = (at, what) => {
    if (!notes.has(what)) notes.set(what, t("line {line}: {what}", { line: lineAt(at), what }));
  };
  const decode = (at, part) =>
    decoded(part, () => note(at, t("'&' is not allowed alone, and was ignored: write &amp;")));

  TOKEN.lastIndex = text.startsWith("\ufeff") ? 1 : 0;
  const first = TOKEN.lastIndex;
  while (TOKEN.lastIndex < text.length) {
    const start = TOKEN.lastIndex;
    const found = TOKEN.exec(text);
    const isDone = top.children.length === 1 && open.length === 1;
    if (isDone && (!found || !isFiller(found[0]))) {
      note(
        start + (/^\s*/.exec(text.slice(start))?.[0].length ?? 0),
        t("everything after the end of <{name}> is ignored", { name: top.children[0].name }),
      );
      break;
    }
    if (!found) fail(start, t('"{text}" is not XML', { text: text.slice(start, start + 30).split("\n")[0] }));
    const [whole, data, declaration, closed, name, attributes, isEmpty, plain] = found;
    const inside = open.at(-1);
    if (data !== undefined) inside.text += data;
    else if (declaration !== undefined) {
      if (start > first)
        note(start, t("the XML declaration has to be at the start of the text: delete what precedes it"));
      else if (!PLAIN_DECLARATION.test(declaration))
        note(start, t('the XML declaration has to begin with <?xml version="1.0"'));
    } else if (whole.startsWith("<!--")) {
      const comment = whole.slice(4, -3);
      if (comment.includes("--") || comment.endsWith("-")) note(start, t("'--' is not allowed inside a comment"));
    } else if (plain !== undefined) {
      if (open.length === 1 && plain.trim()) fail(start, t("there is not one element around all others"));
      inside.text += decode(start, plain);
    } else if (closed !== undefined) {
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
      for (const [, space, key, double, single, bare] of attributes.matchAll(ATTRIBUTE)) {
        const value = double ?? single ?? bare;
        if (!space) note(start, t("a space is missing between two attributes"));
        if (bare !== undefined) note(start, t("the value of an attribute is not in quotes"));
        if (value.includes("<")) note(start, t("'<' is not allowed in an attribute: write &lt;"));
        element.attributes[key] = decode(start, value);
      }
      inside.children.push(element);
      if (!isEmpty) open.push(element);
      if (open.length > MAX_DEPTH) fail(start, t("elements are nested too deeply"));
    }
  }
  if (open.length > 1) fail(text.length, t("</{name}> is missing", { name: open.at(-1).name }));
  if (top.children.length !== 1) fail(text.length, t("there is not one element around all others"));
  return Object.assign(top.children[0], { notes: [...notes.values()] });
}

/** Return whether a token may follow the root element. */
const isFiller = (token) =>
  !token.trim() || token.startsWith("<!--") || (token.startsWith("<?") && !token.startsWith("<?xml"));

/** Return the text with its entities replaced; a lone "&" is dropped, as in TinyXML, and `onLone` is called. */
function decoded(text, onLone) {
  if (!text.includes("&")) return text;
  return text.replace(/&(?:(#x[0-9a-fA-F]+|#\d+|\w+);)?/g, (whole, name) => {
    if (name?.startsWith("#")) {
      const code = name[1] === "x" ? parseInt(name.slice(2), 16) : Number(name.slice(1));
      return code <= 0x10ffff ? String.fromCodePoint(code) : whole;
    }
    if (name && Object.hasOwn(NAMED, name)) return NAMED[name];
    onLone();
    return whole.slice(1);
  });
}
