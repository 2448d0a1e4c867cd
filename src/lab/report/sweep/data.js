// The table: columns, distinct values, numbers in their units, means and intervals.
performance.mark("library read");
const sweep = JSON.parse(document.getElementById("sweep").textContent);
const rowCount = sweep.rows;
const gap = "\u202f";

class Column {
  constructor(raw) {
    Object.assign(this, raw);
    this.words = raw.words ?? null;
  }
  /** The cell as a number, or null. */
  number(row) {
    return this.words ? null : this.values[row];
  }
  /** The cell as exported, empty where missing. */
  text(row) {
    const value = this.words ? this.words[this.codes[row]] : this.values[row];
    return value === null || value === undefined ? "" : String(value);
  }
  /** The cell as people read it. */
  show(row) {
    if (this.words) return this.text(row) || "–";
    return show(this.values[row], this.unit, this.role === "result");
  }
  /** What it is measured in, after its label. */
  get title() {
    return this.label;
  }
}

const columns = sweep.columns.map((raw) => new Column(raw));
const columnOf = new Map(columns.map((column) => [column.name, column]));
const results = columns.filter((column) => column.role === "result" && !column.words);
const outcomes = columns.filter((column) => column.role === "result");
const isDone = (row) => outcomes.some((column) => column.text(row) !== "");

/** Distinct values of an axis in order; `codes` says which one a row has, -1 for none. */
class Axis {
  constructor(raw) {
    Object.assign(this, raw);
    this.column = columnOf.get(raw.name);
    this.numeric = !this.column.words;
    const seen = new Map();
    for (let row = 0; row < rowCount; row++) {
      const text = this.column.text(row);
      if (text !== "" && !seen.has(text)) seen.set(text, this.column.number(row));
    }
    const texts = [...seen.keys()];
    const place = new Map(raw.order.map((text, at) => [text, at]));
    const key = (text) => place.get(text) ?? raw.order.length;
    if (this.numeric) texts.sort((a, b) => seen.get(a) - seen.get(b));
    else texts.sort((a, b) => key(a) - key(b) || (a < b ? -1 : 1));
    this.texts = texts;
    this.numbers = this.numeric ? texts.map((text) => seen.get(text)) : null;
    const index = new Map(texts.map((text, at) => [text, at]));
    this.codes = new Int32Array(rowCount);
    for (let row = 0; row < rowCount; row++) this.codes[row] = index.get(this.column.text(row)) ?? -1;
    this.log = this.log && this.numeric && this.numbers.every((number) => number > 0);
  }
  get varies() {
    return this.texts.length > 1;
  }
  /** Texts short enough for ticks and keys. */
  get shorts() {
    return this.texts.map((text) => short(text, 24));
  }
}

const axes = sweep.axes.map((raw) => new Axis(raw));
const axisOf = new Map(axes.map((axis) => [axis.name, axis]));

/** Rows that differ in the seed alone share a number. */
const settingOf = new Int32Array(rowCount);
const settings = [];
{
  const known = new Map();
  for (let row = 0; row < rowCount; row++) {
    const key = axes.map((axis) => axis.codes[row]).join(",");
    if (!known.has(key)) {
      known.set(key, settings.length);
      settings.push([]);
    }
    settingOf[row] = known.get(key);
    settings[settingOf[row]].push(row);
  }
}

// --- numbers ---

function short(text, most) {
  return text.length > most ? text.slice(0, most - 1) + "…" : text;
}

/** Words that Plotly would read as markup. */
function escapeText(text) {
  return text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
}

/** Six significant digits at most, no zeros behind them. */
function plain(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e15 || size < 1e-5) return Number(value.toPrecision(4)).toExponential().replace("-", "−").replace("+", "");
  const text = Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(6)));
  const [whole, part] = text.replace("-", "−").split(".");
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, gap) : whole;
  return part ? `${grouped}.${part}` : grouped;
}

const prefixes = ["a", "f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P"];
const signs = { seconds: "s", joules: "J", cycles: "cycles" };

/** Three to four digits and a prefix: `12.3 nJ`. */
function prefixed(value, unit, digits = 4) {
  if (value === 0) return `0${gap}${unit}`;
  const power = Math.floor(Math.log10(Math.abs(value)) / 3 + 1e-12);
  const at = Math.max(0, Math.min(prefixes.length - 1, power + 6));
  const number = value / 1000 ** (at - 6);
  const text = Math.abs(number) >= 1000 ? String(Math.round(number)) : number.toPrecision(digits);
  return `${text.replace("-", "−")}${gap}${prefixes[at]}${unit}`;
}

/** A value in its unit. Axis values are shown as they were written. */
function show(value, unit, measured = true) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (!measured) return plain(value);
  if (unit === "fraction") return `${(100 * value).toFixed(2).replace("-", "−")}${gap}%`;
  if (unit in signs) return prefixed(value, signs[unit]);
  return plain(value);
}

/** How to draw values of a unit: all multiplied by `by`; `sign` goes to the title. */
function drawn(unit, values) {
  if (unit === "fraction") return { by: 100, sign: "%" };
  let most = 0;
  for (const value of values) most = Math.max(most, Math.abs(value));
  if (most === 0 || unit === "plain") return { by: 1, sign: unit in signs ? signs[unit] : "" };
  const power = Math.floor(Math.log10(most) / 3 + 1e-12) * 3;
  if (unit === "seconds" || unit === "joules") {
    const at = Math.max(-18, Math.min(15, power));
    return { by: 10 ** -at, sign: prefixes[at / 3 + 6] + signs[unit] };
  }
  const at = most < 1e5 ? 0 : power;
  const times = at === 0 ? "" : `10${[...String(at)].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]).join("")}`;
  return { by: 10 ** -at, sign: [times, unit === "cycles" ? "cycles" : ""].filter(Boolean).join(" ") };
}

/** About `parts` round steps (1, 2 or 5 times a power of ten) inside a range. */
function roundTicks(low, high, parts) {
  const raw = (high - low) / parts || 1;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((lead) => raw / power <= lead * 1.0001);
  const ticks = [];
  for (let at = Math.ceil(low / step - 1e-9); at * step <= high + 1e-9 * step; at++) ticks.push(Number((at * step).toPrecision(12)));
  return ticks;
}

const titled = (label, sign) => (sign ? `${label} (${sign})` : label);

// --- statistics: src/lab/report/sweep/statistics.rs is the law ---

function student(degrees) {
  if (degrees <= sweep.student.length) return sweep.student[degrees - 1];
  const z = 1.959963984540054;
  const first = (z ** 3 + z) / (4 * degrees);
  const second = (5 * z ** 5 + 16 * z ** 3 + 3 * z) / (96 * degrees ** 2);
  const third = (3 * z ** 7 + 19 * z ** 5 + 17 * z ** 3 - 15 * z) / (384 * degrees ** 3);
  return z + first + second + third;
}

/** Count, mean, half the 95 % interval (null for one), least and greatest. */
function summary(values) {
  const n = values.length;
  if (n === 0) return null;
  let sum = 0;
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    sum += value;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  const mean = sum / n;
  let squares = 0;
  for (const value of values) squares += (value - mean) ** 2;
  const half = n > 1 ? student(n - 1) * Math.sqrt(squares / (n - 1) / n) : null;
  return { n, mean, half, low, high };
}

/** Which points no other beats: less cost and more value (less, where `less`). In order of cost. */
function front(costs, values, less) {
  const worth = (at) => (less ? -values[at] : values[at]);
  const order = costs.map((_, at) => at);
  order.sort((a, b) => costs[a] - costs[b] || worth(b) - worth(a) || a - b);
  let best = -Infinity;
  return order.filter((at) => {
    const better = worth(at) > best;
    best = Math.max(best, worth(at));
    return better;
  });
}

/** Rows by key, each with the values of a column; rows without a value are left out. */
function gather(rows, column, keyOf) {
  const groups = new Map();
  for (const row of rows) {
    const value = column.number(row);
    if (value === null) continue;
    const key = keyOf(row);
    if (key === null) continue;
    let group = groups.get(key);
    if (!group) groups.set(key, (group = { values: [], rows: [] }));
    group.values.push(value);
    group.rows.push(row);
  }
  return groups;
}
