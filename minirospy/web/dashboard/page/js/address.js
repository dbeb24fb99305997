// The addresses of views: #/plot?path=/a/b. Pure.

/** Return the view and the settings of a fragment. */
export function addressOf(fragment) {
  const [path, query = ""] = fragment.replace(/^#/, "").split(/\?(.*)/s);
  return { view: path.replace(/^\//, ""), words: new URLSearchParams(query) };
}

/** Return settings as URLSearchParams; of an object those that are not empty, arrays as several of one name. */
export function wordsOf(words) {
  if (words instanceof URLSearchParams) return words;
  const pairs =
    typeof words === "string" || Array.isArray(words)
      ? new URLSearchParams(words)
      : Object.entries(words ?? {}).flatMap(([name, value]) =>
          (Array.isArray(value) ? value : [value]).map((each) => [name, each]),
        );
  return new URLSearchParams(
    [...pairs]
      .filter(([, value]) => value !== "" && value !== null && value !== undefined && value !== false)
      .map(([name, value]) => [name, value === true ? "1" : String(value)]),
  );
}

/** Return the fragment of a view with settings. */
export function fragmentOf(view, words) {
  const query = wordsOf(words).toString();
  return `#/${view}${query ? `?${query}` : ""}`;
}
