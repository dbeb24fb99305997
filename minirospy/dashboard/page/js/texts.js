// The texts of the page in the person's language. The English text is its own key: t("Pause"), t("{count} lines", { count }).

import { GERMAN } from "./german.js";

const TABLES = { en: {}, de: GERMAN };
export const LANGUAGES = { en: "English", de: "Deutsch" };

let table = TABLES.en;
export let language = "en";

/** Use the language that was chosen, else the first of the browser's that there is. */
export function chooseLanguage(wanted, offered = []) {
  const known = [wanted, ...offered].map((each) => String(each ?? "").slice(0, 2).toLowerCase());
  language = known.find((each) => Object.hasOwn(TABLES, each)) ?? "en";
  table = TABLES[language];
}

/** Return a text in the chosen language; {name} in it becomes values.name. */
export function t(text, values = null) {
  const found = Object.hasOwn(table, text) ? table[text] : text;
  return values ? found.replace(/\{(\w+)\}/g, (all, name) => (Object.hasOwn(values, name) ? String(values[name]) : all)) : found;
}
