// What a result costs: every setting as a point, and the front that no other setting beats.
const pointsMost = 2000;
const frontMost = 40;

/** Mean of a column over some rows, or null. */
const meanOf = (column, rows) => summary(rows.map((row) => column.number(row)).filter((value) => value !== null));

/** Ticks of a log axis from 1, 2, 5 times powers of ten, not too many. */
function logTicks(low, high) {
  const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const steps = to - from > 4 ? [1] : to - from > 2 ? [1, 3] : [1, 2, 5];
  const all = [];
  for (let power = from; power <= to; power++) for (const step of steps) all.push(step * 10 ** power);
  const stride = Math.max(1, Math.ceil(all.length / 10));
  const tickvals = all.filter((value, at) => at % stride === 0 && value >= low / 1.3 && value <= high * 1.3).map((value) => Number(value.toPrecision(2)));
  return tickvals.length > 1 ? { tickvals, ticktext: tickvals.map(plain) } : {};
}

function pareto(look, width) {
  const [cost, y] = [columnOf.get(state.cost), columnOf.get(state.y)];
  if (cost && cost === y) return { none: `Choose a cost other than ${y.label}.` };
  if (!cost || !y) return { none: "There is no cost to set against this result." };
  const bounds = ["low", "high"].map((end) => columnOf.get(`${cost.name}_${end}`));
  const bounded = bounds.every(Boolean);
  let points = [];
  settings.forEach((rows, setting) => {
    const both = rows.filter((row) => y.number(row) !== null && cost.number(row) !== null);
    if (both.length === 0) return;
    const point = { setting, rows: both, y: meanOf(y, both), cost: meanOf(cost, both) };
    if (bounded) point.bounds = bounds.map((column) => meanOf(column, both)?.mean ?? null);
    points.push(point);
  });
  if (points.length === 0) return { none: `No finished run has both ${y.label} and ${cost.label}.` };
  // A log axis has no place for 0, and a linear one would press the rest flat.
  const paid = points.filter((point) => point.cost.mean > 0);
  const spread = paid.map((point) => point.cost.mean);
  const free = paid.length > 1 && Math.max(...spread) / Math.min(...spread) > 20 ? points.length - paid.length : 0;
  if (free) points = paid;
  const order = front(points.map((point) => point.cost.mean), points.map((point) => point.y.mean), y.less);
  const best = order.map((at) => points[at]);
  const onFront = new Set(best);
  const all = points.length;
  const gl = hasGl && !onPaper && points.length > pointsMost;
  if (points.length > pointsMost && !gl) {
    const stride = Math.ceil(points.length / pointsMost);
    points = points.filter((point, at) => at % stride === 0 || onFront.has(point));
  }
  const means = points.map((point) => point.cost.mean);
  const [least, most] = [Math.min(...means), Math.max(...means)];
  const log = least > 0 && most / least > 20;
  const by = { x: drawn(cost.unit, log && most / least > 1e4 ? [Math.sqrt(least * most)] : means), y: drawn(y.unit, points.map((point) => point.y.high)) };
  const series = axisOf.get(state.series) ?? null;
  const kinds = series ? [...new Set(points.map((point) => series.codes[point.rows[0]]))].sort((a, b) => a - b) : [0];
  const grouped = series && kinds.length <= curvesMost;
  const data = [];
  const say = (point) => {
    const where = axes.filter((axis) => axis.varies).map((axis) => `${axis.label} = ${axis.column.text(point.rows[0])}`);
    const range = point.bounds?.every((end) => end !== null) ? ` (${point.bounds.map((end) => show(end, cost.unit)).join(" to ")})` : "";
    const half = point.y.half === null ? "" : ` ± ${show(point.y.half, y.unit)}`;
    return [`<b>${show(point.y.mean, y.unit)}</b>${half} ${escapeText(y.label)}`, `${show(point.cost.mean, cost.unit)}${range} ${escapeText(cost.label)}`,
      `n = ${point.y.n}`, ...where.map(escapeText)].join("<br>");
  };
  const few = points.length <= 60;
  const bars = (list) => bounded && list.length && list.every((point) => point.bounds.every((end) => end !== null))
    ? { type: "data", symmetric: false, thickness: 1.1, width: 2.5, array: list.map((point) => (point.bounds[1] - point.cost.mean) * by.x.by),
      arrayminus: list.map((point) => (point.cost.mean - point.bounds[0]) * by.x.by) } : undefined;
  const trace = (list, extra) => ({
    type: gl ? "scattergl" : "scatter", x: list.map((point) => point.cost.mean * by.x.by), y: list.map((point) => point.y.mean * by.y.by),
    mode: "markers", text: list.map(say), hovertemplate: "%{text}<extra></extra>", ...extra,
  });
  for (const kind of grouped ? kinds : [0]) {
    const style = grouped ? styleOf(series, kind, look) : { colour: look.soft, symbol: "circle" };
    const list = points.filter((point) => !onFront.has(point) && (!grouped || series.codes[point.rows[0]] === kind));
    const chosen = best.filter((point) => !grouped || series.codes[point.rows[0]] === kind);
    const name = grouped ? escapeText(series.shorts[kind]) : "settings";
    if (list.length) {
      data.push(trace(list, { name, legendgroup: String(kind), showlegend: false, error_x: few ? { ...bars(list), color: fade(style.colour, 0.4) } : undefined,
        marker: { color: style.colour, symbol: style.symbol, size: all > 400 ? 4.5 : 7, opacity: all > 400 ? 0.3 : 0.4 }, meta: { kind: "settings" } }));
    }
    // The key shows full colours.
    data.push({ type: "scatter", x: [null], y: [null], mode: "markers", name, legendgroup: String(kind), showlegend: Boolean(grouped), hoverinfo: "skip",
      marker: { color: style.colour, symbol: style.symbol, size: 8 }, meta: { kind: "key" } });
    if (chosen.length) {
      data.push({ ...trace(chosen, { name, legendgroup: String(kind), showlegend: false, error_x: { ...bars(chosen), color: fade(style.colour, best.length > 10 ? 0.45 : 0.8) },
        marker: { color: style.colour, symbol: style.symbol, size: 9, line: { color: look.ink, width: 1.2 } }, meta: { kind: "chosen" } }), type: "scatter" });
    }
  }
  data.push({ type: "scatter", mode: "lines", x: best.map((point) => point.cost.mean * by.x.by), y: best.map((point) => point.y.mean * by.y.by), name: "front",
    line: { shape: "hv", color: look.ink, width: 1.6 }, hoverinfo: "skip", meta: { kind: "front", settings: best.map((point) => point.setting) } });
  // The step lies under its points.
  data.unshift(data.pop());
  const wide = width >= 620;
  const legendWidth = grouped && wide ? Math.min(220, 84 + 7 * Math.max(series.label.length - 4, 5, ...kinds.map((at) => series.shorts[at].length))) : 16;
  const below = wide ? 0 : (grouped ? kinds.length + 2 : 1) * 25 + 14;
  const keyHeight = grouped && wide ? (kinds.length + 2) * 25 + 100 : 0;
  const height = Math.max(Math.round(Math.min(480, Math.max(340, width * 0.45))), keyHeight) + below;
  const inner = height - 14 - 56 - below;
  const ends = points.flatMap((point) => (bounded && (few || onFront.has(point)) && point.bounds.every((end) => end > 0) ? point.bounds : [point.cost.mean]));
  const span = [Math.min(least, ...ends), Math.max(most, ...ends)].map((end) => end * by.x.by);
  const room = log ? Math.log10(span[1] / span[0]) * 0.04 : (span[1] - span[0]) * 0.04 || 0.5;
  const layout = layoutLook(look, width, height, {
    margin: { l: 70, r: legendWidth, t: 14, b: 56 + below }, showlegend: true,
    xaxis: axisLook(look, { title: `${titled(cost.label, by.x.sign)}${log ? ", log scale" : ""}`, type: log ? "log" : "linear", ...(log ? logTicks(...span) : {}),
      range: log ? span.map((end, at) => Math.log10(end) + (at ? room : -room)) : [Math.max(span[0] - room, span[0] >= 0 ? -0.01 * span[1] : -Infinity), span[1] + room] }),
    yaxis: axisLook(look, { title: titled(y.label, by.y.sign), nticks: 7 }),
  });
  if (grouped) Object.assign(layout.legend, { title: { text: escapeText(series.label), font: { size: 13, color: look.soft } } });
  Object.assign(layout.legend, wide ? (grouped ? { x: 1.01, xanchor: "left", y: 1 } : { x: 0.99, xanchor: "right", y: 0.02, yanchor: "bottom" })
    : { x: 0, xanchor: "left", y: -64 / inner, yanchor: "top" });
  const caption = `Each point is one of ${plain(all)} settings: means over runs that differ in the seed alone (${countWords(points.map((point) => point.y.n))}), wherever the other ` +
    `figures hold their axes. The line is the front: no setting has ${y.less ? "less" : "more"} ${y.label} for less ${cost.label}.` +
    (bounded ? ` Bars${few ? "" : " on the front"} run from the low to the high bound of the chip's constants.` : "") +
    " A front of measured means is flattered by chance, more so with few runs." +
    (free ? ` ${plain(free)} more ${free === 1 ? "setting has" : "settings have"} 0 ${cost.label} and no place on this axis.` : "") +
    (points.length < all ? ` ${plain(points.length)} of the settings are drawn, evenly picked, the front whole.` : "");
  return { data, layout, caption, label: `${y.label} against ${cost.label}, with the Pareto front of ${best.length} settings`, more: [frontTable(best, y, cost)] };
}

function cell(tag, text, className) {
  const one = document.createElement(tag);
  one.textContent = text;
  if (className) one.className = className;
  return one;
}

function runLink(row) {
  const run = columnOf.get("run");
  const address = run ? run.text(row) : "";
  // Relative addresses only: a table may hold anything.
  if (address === "" || /^[a-z][a-z0-9+.-]*:|^\/\//i.test(address)) return cell("span", address);
  const link = cell("a", `run ${row + 1}`);
  link.href = address;
  return link;
}

/** The settings of the front, cheapest first. */
function frontTable(best, y, cost) {
  const details = document.createElement("details");
  details.open = best.length <= 12;
  details.append(cell("summary", `${best.length === 1 ? "The one setting" : `The ${best.length} settings`} of the front`));
  const table = document.createElement("table");
  const shown = axes.filter((axis) => axis.varies);
  const head = table.createTHead().insertRow();
  [...shown.map((axis) => axis.label), cost.label, y.label, "n", "runs"].forEach((text) => head.append(cell("th", text)));
  const body = table.createTBody();
  for (const point of best.slice(0, frontMost)) {
    const line = body.insertRow();
    shown.forEach((axis) => line.append(cell("td", axis.column.show(point.rows[0]))));
    const range = point.bounds?.every((end) => end !== null) ? ` (${point.bounds.map((end) => show(end, cost.unit)).join(" to ")})` : "";
    line.append(cell("td", show(point.cost.mean, cost.unit) + range));
    line.append(cell("td", show(point.y.mean, y.unit) + (point.y.half === null ? "" : ` ± ${show(point.y.half, y.unit)}`)));
    line.append(cell("td", String(point.y.n)));
    const links = cell("td", "");
    point.rows.slice(0, 10).forEach((row, at) => links.append(at ? ", " : "", runLink(row)));
    line.append(links);
  }
  const scroll = cell("div", "", "scroll");
  scroll.append(table);
  details.append(scroll);
  if (best.length > frontMost) details.append(cell("p", `The first ${frontMost} of ${best.length}.`, "note"));
  return details;
}
