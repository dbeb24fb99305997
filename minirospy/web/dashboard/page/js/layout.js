// Layouts: views side by side as a tree of rows and columns, and its text in links and files:
// row(2:board,column(plot?path=%2Fbutton_state,graph)). A number in front of a part is its share. Pure.

export const MAX_PANES = 24;
const MAX_TEXT = 20_000;
const SIDES = { left: ["row", 0], right: ["row", 1], top: ["column", 0], bottom: ["column", 1] };

/**
 * A tree of {kind: "pane", id, view, words, weight} and {kind: "row" or "column", parts, weight}; words is the text of
 * a query.
 */
export class Layout {
  constructor() {
    this.root = null;
    this.nextId = 1;
  }

  /** Return the layout of a text. Throws Error with what is wrong. */
  static parse(text) {
    const layout = new Layout();
    if (!text) return layout;
    if (text.length > MAX_TEXT) throw new Error("the layout is too long");
    const reader = { text, at: 0 };
    layout.root = layout.read(reader);
    if (reader.at < text.length)
      throw new Error(`"${text.slice(reader.at, reader.at + 20)}" is not expected in a layout`);
    layout.tidy();
    return layout;
  }

  read(reader) {
    const match = /^(?:(\d+(?:\.\d+)?):)?(\w+)/.exec(reader.text.slice(reader.at));
    if (!match) throw new Error(`"${reader.text.slice(reader.at, reader.at + 20)}" is not a view of a layout`);
    reader.at += match[0].length;
    const weight = Math.min(1000, Math.max(0.01, Number(match[1] ?? 1)));
    if (reader.text[reader.at] === "(") {
      if (match[2] !== "row" && match[2] !== "column")
        throw new Error(`"${match[2]}(" in a layout is neither row( nor column(`);
      const parts = [];
      do {
        reader.at += 1; // "(" or ","
        parts.push(this.read(reader));
      } while (reader.text[reader.at] === ",");
      if (reader.text[reader.at] !== ")") throw new Error('a ")" is missing in the layout');
      reader.at += 1;
      return { kind: match[2], parts, weight };
    }
    const words = /^(?:\?([^(),]*))?/.exec(reader.text.slice(reader.at));
    reader.at += words[0].length;
    if (this.nextId > MAX_PANES) throw new Error(`a layout has ${MAX_PANES} views at most`);
    return this.pane(match[2], words[1] ?? "", weight);
  }

  pane(view, words, weight = 1) {
    return { kind: "pane", id: this.nextId++, view, words, weight };
  }

  toString() {
    return this.root ? text(this.root, "") : "";
  }

  /** Return all panes, in reading order. */
  panes() {
    const found = [];
    const visit = (node) => {
      if (node.kind === "pane") found.push(node);
      else node.parts.forEach(visit);
    };
    if (this.root) visit(this.root);
    return found;
  }

  find(id) {
    return this.panes().find((pane) => pane.id === id) ?? null;
  }

  parentOf(child, node = this.root) {
    if (!node || node.kind === "pane") return null;
    if (node.parts.includes(child)) return node;
    for (const part of node.parts) {
      const found = this.parentOf(child, part);
      if (found) return found;
    }
    return null;
  }

  /**
   * Add a view at a side of a pane, or of the whole layout if that is null; return its pane, null if there are
   * too many.
   */
  add(view, words, side = "right", target = null) {
    if (this.panes().length >= MAX_PANES) return null;
    const pane = this.pane(view, words);
    this.insert(pane, side, target);
    return pane;
  }

  insert(pane, side, target) {
    const [kind, after] = SIDES[side];
    if (!this.root) {
      this.root = pane;
      return;
    }
    const other = target ?? this.root;
    const parent = this.parentOf(other);
    if (parent?.kind === kind) {
      // The two share the place of the one.
      other.weight /= 2;
      pane.weight = other.weight;
      parent.parts.splice(parent.parts.indexOf(other) + after, 0, pane);
    } else {
      const split = { kind, parts: after ? [other, pane] : [pane, other], weight: other.weight };
      other.weight = pane.weight = 1;
      if (parent) parent.parts[parent.parts.indexOf(other)] = split;
      else this.root = split;
    }
    this.tidy();
  }

  remove(pane) {
    const parent = this.parentOf(pane);
    if (parent) parent.parts.splice(parent.parts.indexOf(pane), 1);
    else if (this.root === pane) this.root = null;
    this.tidy();
  }

  /** Move a pane to a side of another one (null: of the whole layout); "center" lets them change places. */
  move(pane, side, target) {
    if (pane === target) return;
    if (side === "center") {
      const [one, other] = [this.parentOf(pane), this.parentOf(target)];
      const [at, to] = [one.parts.indexOf(pane), other.parts.indexOf(target)];
      one.parts[at] = target;
      other.parts[to] = pane;
      [pane.weight, target.weight] = [target.weight, pane.weight];
      return;
    }
    if (this.root === pane) return;
    this.remove(pane);
    this.insert(pane, side, target);
  }

  /** Let the part in front of a divider have this share (0 to 1) of what the two beside it have together. */
  resize(split, index, share) {
    const [one, other] = [split.parts[index], split.parts[index + 1]];
    const both = one.weight + other.weight;
    one.weight = both * Math.min(0.95, Math.max(0.05, share));
    other.weight = both - one.weight;
  }

  /** Remove rows and columns with one part, and join those that are inside of one of the same kind. */
  tidy() {
    const tidied = (node) => {
      if (node.kind === "pane") return node;
      const parts = [];
      for (const part of node.parts.map(tidied)) {
        if (!part) continue;
        if (part.kind === node.kind) {
          const sum = part.parts.reduce((total, each) => total + each.weight, 0);
          for (const each of part.parts) parts.push(Object.assign(each, { weight: (part.weight * each.weight) / sum }));
        } else parts.push(part);
      }
      if (parts.length < 2) return parts.length ? Object.assign(parts[0], { weight: node.weight }) : null;
      return Object.assign(node, { parts });
    };
    this.root = this.root && tidied(this.root);
  }
}

function text(node, share) {
  if (node.kind === "pane") return `${share}${node.view}${node.words ? `?${node.words}` : ""}`;
  const total = node.parts.reduce((sum, each) => sum + each.weight, 0);
  const isEven = node.parts.every((each) => Math.abs(each.weight / total - 1 / node.parts.length) < 0.001);
  const parts = node.parts.map((each) =>
    text(each, isEven ? "" : `${Math.max(1, Math.round((each.weight / total) * 100))}:`),
  );
  return `${share}${node.kind}(${parts.join(",")})`;
}

/** Return the side of a box that a point (0 to 1 in both directions) is nearest to; "center" in its middle. */
export function sideAt(x, y) {
  const distances = { left: x, right: 1 - x, top: y, bottom: 1 - y };
  const [side, distance] = Object.entries(distances).sort((one, other) => one[1] - other[1])[0];
  return distance < 0.28 ? side : "center";
}
