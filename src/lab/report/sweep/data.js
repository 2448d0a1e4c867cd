// The table as the program wrote it: columns, axes, settings. Means, intervals, fronts and the order of values come with
// it: src/lab/report/sweep/statistics.rs and settings.rs are their only home. What a reader pools is put together here.
performance.mark("library read");
const sweep = JSON.parse(document.getElementById("sweep").textContent);
const rowCount = sweep.setting.length;
const gap = "\u202f";
const [six, four] = [6, 4].map((digits) => new Intl.NumberFormat("en", { maximumSignificantDigits: digits, useGrouping: "min2" }));

/** Six significant digits at most, in groups of three. */
const plain = (value, digits = six) => digits.format(value).replaceAll(",", gap).replace("-", "−");
const short = (text, most) => (text.length > most ? text.slice(0, most - 1) + "…" : text);
const listed = (list) => (list.length < 2 ? list.join("") : `${list.slice(0, -1).join(", ")} and ${list.at(-1)}`);
/** Words that Plotly would read as markup. */
const escapeText = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
const extent = (values) => values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);

/** `by` and `sign` say how figures draw it, `title` is its label with that sign. */
class Column {
  constructor(raw) {
    Object.assign(this, raw);
  }
  /** The cell as a number, or null. */
  number(row) {
    return this.words ? null : this.values[row];
  }
  /** The cell as exported, empty where missing. */
  text(row) {
    return String((this.words ? this.words[this.codes[row]] : this.values[row]) ?? "");
  }
  /** The cell as people read it. */
  show(row) {
    return this.words ? this.text(row) || "–" : this.print(this.values[row]);
  }
  /** A value in its unit. */
  print(value) {
    if (value === null) return "–";
    if (this.unit === "fraction") return `${(100 * value).toFixed(2).replace("-", "−")}${gap}%`;
    return this.unit === "seconds" || this.unit === "joules" ? `${plain(value * this.by, four)}${gap}${this.sign}` : plain(value);
  }
  /** What the runs of a setting say: how many, their mean, half its interval. */
  of(setting) {
    if (!this.mean) return { n: 1, mean: this.number(rowsOf[setting][0]), half: null };
    return { n: this.n[setting], mean: this.mean[setting], half: this.half[setting] };
  }
}

const columns = sweep.columns.map((raw) => new Column(raw));
const columnOf = new Map(columns.map((column) => [column.name, column]));
const outcomes = columns.filter((column) => column.role === "result");
const results = outcomes.filter((column) => !column.words);
const resultOf = new Map(results.map((column) => [column.name, column]));
const isDone = (row) => outcomes.some((column) => column.text(row) !== "");

/** `codes` says which of its `texts` a setting has, -1 for none; of many values, which range of them. */
const axes = sweep.axes.map((raw) => ({ ...raw, column: columnOf.get(raw.name), varies: raw.texts.length > 1 }));
const axisOf = new Map(axes.map((axis) => [axis.name, axis]));
const varied = axes.filter((axis) => axis.varies);

/** Runs of a setting: they differ in the seed alone. */
const rowsOf = [];
sweep.setting.forEach((setting, row) => (rowsOf[setting] ??= []).push(row));

/** Axes that are not `shown`: held at a value or pooled, and what a caption says of that. */
function others(shown) {
  const rest = varied.filter((axis) => !shown.includes(axis));
  const held = rest.filter((axis) => state.hold[axis.name] !== undefined);
  const words = held.map((axis) => `${axis.label} = ${axis.texts[state.hold[axis.name]]}`);
  return { held, pooled: rest.filter((axis) => !held.includes(axis)), text: words.length ? ` Held: ${words.join(", ")}.` : "" };
}

/** Runs of several settings together. Settings are no repetitions, so they have a range and no interval. */
function pool(column, settings) {
  const values = settings.flatMap((setting) => rowsOf[setting].map((row) => column.number(row))).filter((value) => value !== null);
  const [low, high] = extent(values);
  return { n: values.length, mean: values.length ? values.reduce((sum, value) => sum + value, 0) / values.length : null, low, high };
}

/** The points of a figure: settings gathered by their values `at` the axes `shown`, where the others are held. */
function pointsOf(column, shown, { held }, pooled, alone = false) {
  const groups = new Map();
  for (let setting = 0; setting < rowsOf.length; setting++) {
    if (held.some((axis) => axis.codes[setting] !== state.hold[axis.name])) continue;
    const at = shown.map((axis) => (axis ? axis.codes[setting] : 0));
    if (at.includes(-1)) continue;
    const key = alone ? setting : at.join(",");
    if (!groups.has(key)) groups.set(key, { at, settings: [] });
    groups.get(key).settings.push(setting);
  }
  const points = [...groups.values()].map((group) => ({ ...group, ...(pooled ? pool(column, group.settings) : column.of(group.settings[0])) }));
  return points.filter((point) => point.mean !== null);
}

/** The ends of a point's interval, or of its range where settings are pooled; null for one run. */
function ends({ n, mean, half, low, high }) {
  if (half === undefined) return n > 1 ? [low, high] : null;
  return half === null ? null : [mean - half, mean + half];
}

function countWords(points) {
  const [low, high] = extent(points.map((point) => point.n));
  return low === high ? `n = ${low}` : `n = ${low} to ${high}`;
}

/** What the pointer is told of a point. */
function hover(point, column, where) {
  const between = ends(point)?.map((end) => column.print(end)).join(" to ");
  const lines = [`<b>${column.print(point.mean)}</b> ${escapeText(column.label)}`];
  if (between) lines.push(point.half === undefined ? `from ${between}` : `95${gap}%: ${between}`);
  lines.push(`n = ${point.n}${point.half === undefined ? " (pooled)" : ""}`, ...where.filter(Boolean).map(escapeText));
  return lines.join("<br>");
}
