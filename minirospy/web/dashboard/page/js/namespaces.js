// Names as a tree by namespace: folders that are folded and unfolded, and the names in them, as rows of one list. Pure.

export const MAX_FLAT = 20; // names that are shown as they are, without folders
const MAX_ROWS = 60; // that are unfolded at first, level by level

/**
 * Return the rows of sorted names: {kind: "folder", path, label, depth, count, isOpen} and {kind: "name", name, label,
 * depth}.
 *
 * A namespace with one entry is joined with it, as in trees of files. toggled: path of a folder -> whether a person has
 * opened it; the other folders are open while the rows are few. needed: names whose folders are open, too. isAllOpen
 * opens all folders, for a filter.
 */
export function arranged(
  names,
  { toggled = new Map(), needed = new Set(), isAllOpen = false, maxFlat = MAX_FLAT } = {},
) {
  if (names.length <= maxFlat) return names.map((name) => ({ kind: "name", name, label: name, depth: 0 }));
  const root = treeOf(names);
  const open = new Set();
  for (const name of needed) for (const path of foldersOf(name)) open.add(path);
  const rows = (depth) => {
    const isOpen = (path, at) => isAllOpen || (toggled.get(path) ?? (at < depth || open.has(path)));
    return rowsOf(root, 0, "", isOpen);
  };
  let found = rows(0);
  for (let depth = 1; found.length <= MAX_ROWS; depth++) {
    const more = rows(depth);
    if (more.length > MAX_ROWS || more.length === found.length) break;
    found = more;
  }
  return found;
}

function treeOf(names) {
  const root = { path: "", parts: new Map(), name: null, count: 0 };
  for (const name of names) {
    let place = root;
    for (const path of [...foldersOf(name), name]) {
      place.count += 1;
      if (!place.parts.has(path)) place.parts.set(path, { path, parts: new Map(), name: null, count: 0 });
      place = place.parts.get(path);
    }
    place.name = name;
    place.count += 1;
  }
  return root;
}

/** Return the namespaces that a name is in, from the outermost on: /a and /a/b of /a/b/c. */
function foldersOf(name) {
  const found = [];
  for (let end = name.indexOf("/", 1); end > 0; end = name.indexOf("/", end + 1)) found.push(name.slice(0, end));
  return found;
}

function rowsOf(folder, depth, prefix, isOpen) {
  const rows = [];
  for (const first of folder.parts.values()) {
    let part = first;
    while (part.name === null && part.parts.size === 1) [part] = part.parts.values();
    const label = prefix ? part.path.slice(prefix.length + 1) : part.path;
    if (part.name !== null) rows.push({ kind: "name", name: part.name, label, depth });
    if (!part.parts.size) continue;
    const open = isOpen(part.path, depth);
    const count = part.count - Number(part.name !== null);
    rows.push({ kind: "folder", path: part.path, label: `${label}/`, depth, count, isOpen: open });
    if (open) rows.push(...rowsOf(part, depth + 1, part.path, isOpen));
  }
  return rows;
}
