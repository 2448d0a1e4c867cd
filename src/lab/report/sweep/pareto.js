// What a result costs: every setting as a point, and the front that no other setting beats.
const pointsMost = 2000;
const frontMost = 40;

function pareto(look, width) {
  const [cost, y] = [columnOf.get(state.cost), columnOf.get(state.y)];
  if (cost && cost === y) return { none: `Choose a cost other than ${y.label}.` };
  if (!cost || !y) return { none: "There is no cost to set against this result." };
  const bounds = ["low", "high"].map((end) => columnOf.get(`${cost.name}_${end}`));
  const all = rowsOf.map((_, setting) => {
    const range = bounds.map((column) => column?.of(setting).mean ?? null);
    return { setting, y: y.of(setting), cost: cost.of(setting).mean, bounds: range.includes(null) ? null : range };
  }).filter((point) => point.y.mean !== null && point.cost !== null);
  if (all.length === 0) return { none: `No finished run has both ${y.label} and ${cost.label}.` };
  // A log axis has no place for 0, and a linear one would press the rest flat.
  const paid = all.filter((point) => !cost.log || point.cost > 0);
  const onFront = new Set(sweep.fronts[cost.name]?.[y.name]);
  const best = paid.filter((point) => onFront.has(point.setting)).sort((a, b) => a.cost - b.cost);
  const gl = hasGl && !onPaper && paid.length > pointsMost;
  const stride = gl ? 1 : Math.ceil(paid.length / pointsMost);
  const points = paid.filter((point, at) => at % stride === 0 || onFront.has(point.setting));
  const few = points.length <= 60;
  const series = axisOf.get(state.series) ?? null;
  const kinds = series ? [...new Set(points.map((point) => series.codes[point.setting]))].sort((a, b) => a - b) : [];
  const grouped = kinds.length > 0 && kinds.length <= curvesMost;
  const [by, data] = [[cost.by, y.by], []];
  const costWords = (point) => cost.print(point.cost) + (point.bounds ? ` (${point.bounds.map((end) => cost.print(end)).join(" to ")})` : "");
  const yWords = (point) => y.print(point.y.mean) + (point.y.half === null ? "" : ` ± ${y.print(point.y.half)}`);
  const say = (point) => [`<b>${yWords(point)}</b> ${escapeText(y.label)}`, `${costWords(point)} ${escapeText(cost.label)}`, `n = ${point.y.n}`,
    ...varied.map((axis) => escapeText(`${axis.label} = ${axis.column.show(rowsOf[point.setting][0])}`))].join("<br>");
  const places = (list) => ({ x: list.map((point) => point.cost * by[0]), y: list.map((point) => point.y.mean * by[1]) });
  const bars = (list, colour) => list.every((point) => point.bounds) ? { type: "data", symmetric: false, thickness: 1.1, width: 2.5, color: colour,
    array: list.map((point) => (point.bounds[1] - point.cost) * by[0]), arrayminus: list.map((point) => (point.cost - point.bounds[0]) * by[0]) } : undefined;
  data.push({ ...places(best), type: "scatter", mode: "lines", name: "front", line: { shape: "hv", color: look.ink, width: 1.6 }, hoverinfo: "skip",
    meta: { kind: "front", settings: best.map((point) => point.setting) } });
  for (const kind of grouped ? kinds : [null]) {
    const style = grouped ? styleOf(series, kind, look) : { colour: look.soft, symbol: "circle" };
    const of = (list) => list.filter((point) => !grouped || series.codes[point.setting] === kind);
    const add = (list, meta, type, marker, error_x) => list.length && data.push({ ...places(list), type, mode: "markers", name: grouped ? escapeText(series.ticks[kind]) : "settings",
      legendgroup: String(kind), showlegend: meta === "key" && grouped, text: list.map(say), hovertemplate: "%{text}<extra></extra>", error_x, meta: { kind: meta },
      marker: { color: style.colour, symbol: style.symbol, ...marker } });
    const [chosen, others] = [of(best), of(points.filter((point) => !onFront.has(point.setting)))];
    const pale = points.length > 400 ? { size: 4.5, opacity: 0.3 } : { size: 7, opacity: 0.4 };
    add(others, "settings", gl ? "scattergl" : "scatter", pale, few ? bars(others, fade(style.colour, 0.4)) : undefined);
    add(chosen, "chosen", "scatter", { size: 9, line: { color: look.ink, width: 1.2 } }, bars(chosen, fade(style.colour, best.length > 10 ? 0.45 : 0.8)));
    // The key shows full colours.
    if (grouped) data.push({ x: [null], y: [null], type: "scatter", mode: "markers", name: escapeText(series.ticks[kind]), legendgroup: String(kind), marker: { color: style.colour, symbol: style.symbol, size: 8 }, meta: { kind: "key" } });
  }
  const span = extent(points.flatMap((point) => (point.bounds && (few || onFront.has(point.setting)) && (!cost.log || point.bounds[0] > 0) ? point.bounds : [point.cost])).map((end) => end * by[0]));
  const bend = cost.log ? Math.log10 : (value) => value;
  const room = (bend(span[1]) - bend(span[0])) * 0.04 || 0.5;
  const height = Math.max(Math.round(Math.min(480, Math.max(340, width * 0.45))), grouped ? (kinds.length + 2) * 25 + 100 : 0);
  const layout = layoutLook(look, width, height, {
    margin: { l: 70, r: 16, t: 14, b: 56 }, showlegend: true, legend: grouped ? keyTitle(look, series.label) : { x: 0.99, xanchor: "right", y: 0.02, yanchor: "bottom" },
    xaxis: axisLook(look, { title: cost.title + (cost.log ? ", log scale" : ""), type: cost.log ? "log" : "linear", ...(cost.log ? { dtick: span[1] / span[0] > 1e3 ? 1 : "D2", exponentformat: "none" } : {}),
      range: [bend(span[0]) - room, bend(span[1]) + room] }),
    yaxis: axisLook(look, { title: y.title, nticks: 7 }),
  });
  const free = all.length - paid.length;
  const caption = `Each point is one of ${plain(paid.length)} settings: means over runs that differ in the seed alone (${countWords(points.map((point) => point.y))}), wherever the other ` +
    `figures hold their axes. The line is the front: no setting has ${y.less ? "less" : "more"} ${y.label} for less ${cost.label}.` +
    (best.some((point) => point.bounds) ? ` Bars${few ? "" : " on the front"} run from the low to the high bound of the chip's constants.` : "") +
    " A front of measured means is flattered by chance, more so with few runs." +
    (free ? ` ${plain(free)} more ${free === 1 ? "setting has" : "settings have"} 0 ${cost.label} and no place on this axis.` : "") +
    (points.length < paid.length ? ` ${plain(points.length)} of the settings are drawn, evenly picked, the front whole.` : "");
  const line = (point) => [...varied.map((axis) => axis.column.show(rowsOf[point.setting][0])), costWords(point), yWords(point), String(point.y.n),
    rowsOf[point.setting].slice(0, 10).flatMap((row, at) => [at ? ", " : "", runLink(row)])];
  const more = [frontTable([...varied.map((axis) => axis.label), cost.label, y.label, "n", "runs"], best.slice(0, frontMost).map(line), best.length)];
  return { data, layout, caption, more, label: `${y.label} against ${cost.label}: ${plain(paid.length)} settings, ${best.length} of them on the Pareto front` };
}

function element(tag, content, className = "") {
  const one = document.createElement(tag);
  one.className = className;
  one.append(...[content].flat());
  return one;
}

function runLink(row) {
  const address = columnOf.get("run")?.text(row);
  const link = element(address ? "a" : "span", `run ${row + 1}`);
  if (address) link.href = address;
  return link;
}

/** The settings of the front in numbers, with links to their runs. */
function frontTable(heads, lines, all) {
  const rows = (list, tag) => list.map((line) => element("tr", line.map((one) => element(tag, one))));
  const table = element("table", [element("thead", rows([heads], "th")), element("tbody", rows(lines, "td"))], "stack one");
  for (const row of table.tBodies[0].rows) [...row.cells].forEach((cell, at) => cell.setAttribute("data-head", heads[at]));
  const details = element("details", [element("summary", all === 1 ? "The one setting of the front" : `The ${all} settings of the front`), element("div", table, "scroll")]);
  details.open = all <= 12;
  if (all > lines.length) details.append(element("p", `The first ${lines.length} of ${all}.`, "note"));
  return details;
}
