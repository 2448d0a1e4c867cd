// Curves: the mean of a result against an axis, with its interval; one curve a value of an axis, one panel of another.
const curvesMost = 16;
const panelsMost = 12;

/** Rows that have a result and lie where the axes that are not `shown` are held. */
function heldRows(shown) {
  const held = axes.filter((axis) => axis.varies && !shown.includes(axis) && state.hold[axis.name] !== undefined);
  const kept = [];
  for (let row = 0; row < rowCount; row++) {
    if (held.every((axis) => axis.codes[row] === state.hold[axis.name])) kept.push(row);
  }
  return kept;
}

/** What a caption says of the axes a figure does not show. */
function heldWords(shown) {
  const others = axes.filter((axis) => axis.varies && !shown.includes(axis));
  const fixed = others.filter((axis) => state.hold[axis.name] !== undefined);
  const pooled = others.filter((axis) => state.hold[axis.name] === undefined);
  const words = fixed.map((axis) => `${axis.label} = ${axis.texts[state.hold[axis.name]]}`);
  return { pooled, text: words.length ? ` Held: ${words.join(", ")}.` : "" };
}

const listed = (list) => (list.length < 2 ? list.join("") : `${list.slice(0, -1).join(", ")} and ${list[list.length - 1]}`);

function countWords(counts) {
  const low = Math.min(...counts);
  const high = Math.max(...counts);
  return low === high ? `n = ${low}` : `n = ${low} to ${high}`;
}

/** The interval of a summary as ends, or none: the range where settings are pooled. */
function ends(point, pooled) {
  if (pooled) return point.n > 1 ? [point.low, point.high] : null;
  return point.half === null ? null : [point.mean - point.half, point.mean + point.half];
}

function hover(point, measure, head, pooled) {
  const lines = [`<b>${show(point.mean, measure.unit)}</b> ${escapeText(measure.label)}`];
  if (!pooled && point.half !== null) {
    const [low, high] = ends(point, false);
    lines.push(`95${gap}%: ${show(low, measure.unit)} to ${show(high, measure.unit)}`);
  }
  if (pooled && point.n > 1) lines.push(`from ${show(point.low, measure.unit)} to ${show(point.high, measure.unit)}`);
  lines.push(`n = ${point.n}${pooled ? " (pooled)" : ""}`, ...head.filter(Boolean).map(escapeText));
  return lines.join("<br>");
}

function curves(look, width) {
  const x = axisOf.get(state.x);
  const y = columnOf.get(state.y);
  if (!x || !y) return { none: "There is no axis or no result to draw." };
  const series = axisOf.get(state.series) ?? null;
  const panel = axisOf.get(state.panel) ?? null;
  const shown = [x, series, panel];
  const held = heldWords(shown);
  const pooled = held.pooled.length > 0;
  const code = (axis, row) => (axis ? axis.codes[row] : 0);
  const groups = gather(heldRows(shown), y, (row) => {
    const key = [code(panel, row), code(series, row), x.codes[row]];
    return key.includes(-1) ? null : key.join(",");
  });
  if (groups.size === 0) return { none: `No finished run has ${y.label} here.${held.text}` };
  const points = [...groups].map(([key, group]) => {
    const [panelAt, seriesAt, xAt] = key.split(",").map(Number);
    return { panelAt, seriesAt, xAt, ...summary(group.values) };
  });
  const distinct = (pick) => [...new Set(points.map(pick))].sort((a, b) => a - b);
  const allPanels = distinct((point) => point.panelAt);
  const allSeries = distinct((point) => point.seriesAt);
  const panels = allPanels.slice(0, panelsMost);
  const lines = allSeries.slice(0, curvesMost);
  const scale = drawn(y.unit, points.map((point) => point.high));

  // Panels share a scale, unless one of them would be pressed flat by another.
  const framed = (list) => rangeOf(list, y.unit, pooled);
  const whole = framed(points);
  const byPanel = new Map(panels.map((at) => [at, framed(points.filter((point) => point.panelAt === at))]));
  const own = panels.length > 1 && Math.min(...[...byPanel.values()].map((one) => one.range[1] - one.range[0])) < (whole.range[1] - whole.range[0]) / 4;
  const cut = own ? [...byPanel.values()].some((one) => one.cut) : whole.cut;

  // Frame: panels in rows.
  const across = panels.length === 1 ? 1 : Math.min(panels.length === 4 && width < 1000 ? 2 : 3, panels.length, Math.max(1, Math.floor(width / 300)));
  const down = Math.ceil(panels.length / across);
  const wide = width >= 620;
  const legendWidth = series && wide ? Math.min(220, 74 + 7 * Math.max(series.label.length - 4, ...lines.map((at) => series.shorts[at].length))) : 16;
  const panelHeight = panels.length === 1 ? Math.round(Math.min(460, Math.max(320, width * 0.42))) : 250;
  const legendRows = series && !wide ? lines.length * 25 + 36 : 0;
  const margin = { l: 70, r: legendWidth, t: panel ? 30 : 14, b: 56 + legendRows };
  // High enough for the whole key, which would scroll otherwise and be cut on paper.
  const keyHeight = series && wide ? lines.length * 25 + 44 : 0;
  const height = Math.max(down * panelHeight + (down - 1) * 52, keyHeight) + margin.t + margin.b;
  const inner = { width: width - margin.l - margin.r, height: height - margin.t - margin.b };
  const gapX = across > 1 ? (own ? 56 / inner.width : 0.035) : 0;
  const cellX = (1 - gapX * (across - 1)) / across;
  const gapY = down > 1 ? 52 / inner.height : 0;
  const cellY = (1 - gapY * (down - 1)) / down;

  const data = [];
  const layout = {};
  const notes = [];
  const scatter = x.drawn;
  panels.forEach((panelAt, number) => {
    const suffix = number === 0 ? "" : String(number + 1);
    const [column, row] = [number % across, Math.floor(number / across)];
    const left = column * (cellX + gapX);
    const top = 1 - row * (cellY + gapY);
    const lowest = number + across >= panels.length;
    layout[`xaxis${suffix}`] = axisLook(look, {
      ...ticksAt(x, cellX * inner.width), domain: [left, left + cellX], anchor: `y${suffix}`, range: spanOf(x), showgrid: false,
      showticklabels: lowest, title: lowest ? x.label : "", ...(number ? { matches: "x" } : {}),
    });
    layout[`yaxis${suffix}`] = axisLook(look, {
      domain: [Math.max(0, top - cellY), top], anchor: `x${suffix}`, range: (own ? byPanel.get(panelAt) : whole).range.map((end) => end * scale.by), nticks: 7,
      showticklabels: own || column === 0, ticklen: own || column === 0 ? 4 : 0, title: column === 0 ? titled(y.label, scale.sign) : "", ...(number && !own ? { matches: "y" } : {}),
    });
    if (panel) {
      notes.push({ text: `<b>${escapeText(panel.label)} ${escapeText(panel.shorts[panelAt])}</b>`, xref: "paper", yref: "paper", x: left, y: top,
        xanchor: "left", yanchor: "bottom", yshift: 4, showarrow: false, font: { size: 13, color: look.ink } });
    }
    lines.forEach((seriesAt, order) => {
      const line = points.filter((point) => point.panelAt === panelAt && point.seriesAt === seriesAt);
      line.sort((a, b) => a.xAt - b.xAt);
      if (line.length === 0) return;
      const style = series ? styleOf(series, seriesAt, look) : styleOf(null, 0, look);
      const name = escapeText(series ? series.shorts[seriesAt] : y.label);
      // Words have no distance: their points stand side by side and are not joined.
      const dodge = x.numeric ? 0 : ((order + 0.5) / lines.length - 0.5) * 0.5;
      const place = (point) => (x.numeric ? x.numbers[point.xAt] : point.xAt + dodge);
      const common = { xaxis: `x${suffix}`, yaxis: `y${suffix}`, legendgroup: String(seriesAt), type: "scatter" };
      const band = x.numeric && !scatter ? bandOf(line, place, pooled, scale.by) : { alone: line.map(() => true) };
      if (band.x?.length) {
        data.push({ ...common, x: band.x, y: band.y, mode: "lines", line: { width: 0 }, fill: "toself", hoverinfo: "skip",
          fillcolor: fade(style.colour, lines.length > 4 ? 0.11 : 0.17), showlegend: false, meta: { kind: "band", series: name } });
      }
      const bars = line.map((point, at) => (band.alone[at] ? ends(point, pooled) : null));
      const errors = bars.some(Boolean) ? { type: "data", symmetric: false, color: fade(style.colour, 0.75), thickness: 1.3, width: 3,
        array: bars.map((bar, at) => (bar ? (bar[1] - line[at].mean) * scale.by : 0)),
        arrayminus: bars.map((bar, at) => (bar ? (line[at].mean - bar[0]) * scale.by : 0)) } : undefined;
      data.push({
        ...common, name, x: line.map(place), y: line.map((point) => point.mean * scale.by), error_y: errors,
        mode: x.numeric && !scatter ? "lines+markers" : "markers",
        line: { color: style.colour, width: 2, dash: style.dash }, showlegend: series !== null && !data.some((trace) => trace.legendgroup === String(seriesAt) && trace.showlegend),
        marker: { color: style.colour, symbol: style.symbol, size: scatter ? 5 : 7, opacity: scatter ? 0.7 : 1 },
        text: line.map((point) => hover(point, y, [`${x.label} = ${x.texts[point.xAt]}`, series && `${series.label} = ${series.texts[seriesAt]}`,
          panel && `${panel.label} = ${panel.texts[panelAt]}`], pooled)),
        hovertemplate: "%{text}<extra></extra>", customdata: line.map((point) => [point.n, point.mean, point.half, point.xAt]),
        meta: { kind: "mean", series: series ? series.texts[seriesAt] : "", panel: panel ? panel.texts[panelAt] : "" },
      });
    });
  });
  Object.assign(layout, layoutLook(look, width, height, { margin, annotations: notes, showlegend: series !== null }));
  if (series) Object.assign(layout.legend, { title: { text: escapeText(series.label), font: { size: 13, color: look.soft } } });
  if (series && wide) Object.assign(layout.legend, { x: 1.01, xanchor: "left", y: 1, yanchor: "top" });
  if (series && !wide) Object.assign(layout.legend, { x: 0, xanchor: "left", y: -64 / inner.height, yanchor: "top" });

  // In words.
  const counts = points.map((point) => point.n);
  let caption = "";
  if (pooled) {
    caption = `Mean over runs and over ${listed(held.pooled.map((axis) => axis.label))}, pooled: these are different settings, not repetitions, ` +
      `so the ${x.numeric ? "band" : "bar"} is the range from least to greatest, not a confidence interval. ${countWords(counts)} a point.`;
  } else if (Math.max(...counts) === 1) {
    caption = "One run a point (n = 1), so there is no band.";
  } else {
    caption = `Mean of runs that differ in the seed alone, ${countWords(counts)} a point. ${x.numeric ? "Bands are" : "Bars are"} its 95${gap}% ` +
      `confidence interval (Student's t)${Math.min(...counts) === 1 ? "; points with n = 1 have none" : ""}${Math.min(...counts.filter((n) => n > 1)) === 2 ? "; with n = 2 it is wide" : ""}.`;
  }
  if (own) caption += " Each panel has a scale of its own.";
  if (cut) caption += " Some reach beyond the frame.";
  caption += held.text;
  if (x.drawn) caption += ` Values of ${x.label} were drawn from a range; points are not joined.`;
  if (lines.length < allSeries.length) caption += ` The first ${lines.length} of ${allSeries.length} curves are drawn.`;
  if (panels.length < allPanels.length) caption += ` The first ${panels.length} of ${allPanels.length} panels are drawn.`;
  const label = `${y.label} against ${x.label}${series ? `, a curve for each ${series.label}` : ""}${panel ? `, a panel for each ${panel.label}` : ""}`;
  return { data, layout, caption, label };
}

/** Ends of the ordinate: it follows the points; intervals may stretch it by 0.6 as much, and no share leaves 0 to 100 %. */
function rangeOf(points, unit, pooled) {
  let low = Infinity;
  let high = -Infinity;
  for (const point of points) [low, high] = [Math.min(low, point.mean), Math.max(high, point.mean)];
  let [bandLow, bandHigh] = [low, high];
  for (const point of points) {
    const interval = ends(point, pooled);
    if (interval) [bandLow, bandHigh] = [Math.min(bandLow, interval[0]), Math.max(bandHigh, interval[1])];
  }
  const span = high - low || Math.abs(high) * 0.1 || 1;
  let range = [Math.max(bandLow, low - 0.6 * span), Math.min(bandHigh, high + 0.6 * span)];
  range = [range[0] - 0.05 * span, range[1] + 0.05 * span];
  if (unit === "fraction") range = [Math.max(range[0], -0.005), Math.min(range[1], 1.005)];
  else if (low >= 0) range[0] = Math.max(range[0], -0.02 * span);
  return { range, cut: bandLow < range[0] || bandHigh > range[1] };
}

/** Polygons around neighbouring points that have an interval; a point with no such neighbour is `alone`. */
function bandOf(own, place, pooled, by) {
  const alone = own.map(() => true);
  const out = { x: [], y: [], alone };
  let run = [];
  const close = () => {
    if (run.length > 1) {
      if (out.x.length) [out.x, out.y].forEach((list) => list.push(null));
      const back = [...run].reverse();
      out.x.push(...run.map((at) => place(own[at])), ...back.map((at) => place(own[at])));
      out.y.push(...run.map((at) => ends(own[at], pooled)[1] * by), ...back.map((at) => ends(own[at], pooled)[0] * by));
      run.forEach((at) => (alone[at] = false));
    }
    run = [];
  };
  own.forEach((point, at) => (ends(point, pooled) ? run.push(at) : close()));
  close();
  return out;
}
