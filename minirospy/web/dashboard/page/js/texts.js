// The texts of the page in the person's language. The English text is its own key: t("Pause"), t("{count} lines", {
// count }).

import { GERMAN } from "./german.js";

const TABLES = { en: {}, de: GERMAN };
export const LANGUAGES = { en: "English", de: "Deutsch" };

let table = TABLES.en;
export let language = "en";

/**
 * Use the language that was chosen, else the first of the browser's that there is.
 * @param {string | null} wanted
 * @param {readonly string[]} offered
 */
export function chooseLanguage(wanted, offered = []) {
  const known = [wanted, ...offered].map((each) =>
    String(each ?? "")
      .slice(0, 2)
      .toLowerCase(),
  );
  language = known.find((each) => Object.hasOwn(TABLES, each)) ?? "en";
  table = TABLES[language];
}

/** Return the text of an error; a TextError's is translated. */
export const errorText = ({ message, text, values }) => (text === undefined ? message : t(text, values));

/** Return the parts of a text as [part, isCode]: code is what is between two backticks. */
export function codeParts(text) {
  const parts = String(text).split(/`([^`]+)`/);
  return parts.map((part, index) => [part, index % 2 === 1]).filter(([part]) => part !== "");
}

const missing = new Set();
const made = new Set();
let isWatched = false;

/** Note from now on the texts that have no translation; return the set of them. For tests. */
export function watchMissing() {
  isWatched = true;
  return missing;
}

/**
 * Return a text in the chosen language; {name} in it becomes values.name. A text without a translation stays as it is.
 */
export function t(text, values = null) {
  const isKnown = Object.hasOwn(table, text);
  const found = isKnown ? table[text] : text;
  const result = values
    ? found.replace(/\{(\w+)\}/g, (all, name) => (Object.hasOwn(values, name) ? String(values[name]) : all))
    : found;
  if (isWatched) {
    if (!isKnown && !made.has(text)) missing.add(text);
    made.add(result);
  }
  return result;
}
