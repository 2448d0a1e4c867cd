// All settings at once: a line a run through its axes and results, coloured by the result.
const linesMost = 400;
const linesMostGl = 1500;
const shades = 8;
// Lines need more contrast to the page than areas: the palest end of the map on white, the darkest on black, is left out.
const lineShade = (look, part) => mix(look.name === "dark" ? 0.18 + 0.82 * part : 0.88 * part);
const lineScale = (look) => Array.from({ length: 11 }, (_, at) => [at / 10, lineShade(look, at / 10)]);

/** The axes that vary and the results of the other figures, as positions 0 to 1. */
function rulers() {
  const cost = columnOf.get(state.cost);
  const ofAxis = axes.filter((axis) => axis.varies).slice(0, 10).map((axis) => {
    if (!axis.numeric) return { label: axis.label, value: (row) => axis.texts.length - 1 - axis.codes[row], low: 0, high: axis.texts.length - 1,
      ticks: axis.texts.map((_, at) => axis.texts.length - 1 - at), texts: axis.shorts };
    const bend = axis.log ? Math.log10 : (value) => value;
    const numbers = axis.numbers;
    const [first, last] = [numbers[0], numbers[numbers.length - 1]];
    const round = () => (axis.log ? logTicks(first, last).tickvals ?? [first, last] : roundTicks(first, last, 6)).filter((mark) => mark >= first && mark <= last);
    const kept = numbers.length <= 12 ? numbers : round();
    return { label: axis.label, value: (row) => bend(axis.column.number(row)), low: bend(numbers[0]), high: bend(numbers[numbers.length - 1]),
      ticks: kept.map(bend), texts: kept.map((value) => plain(Number(value.toPrecision(3)))) };
  });
  return (rows) => {
    const ofResult = [cost, columnOf.get(state.y)].filter((column, at, all) => column && all.indexOf(column) === at).map((column) => {
      const values = rows.map((row) => column.number(row)).filter((value) => value !== null);
      let [low, high] = [Infinity, -Infinity];
      for (const value of values) [low, high] = [Math.min(low, value), Math.max(high, value)];
      const log = low > 0 && high / low > 50;
      const scale = drawn(column.unit, log ? [Math.sqrt(low * high)] : values);
      const bend = (value) => (log ? Math.log10(value * scale.by) : value * scale.by);
      const ends = [bend(low), bend(high)];
      if (!(ends[1] > ends[0])) ends[1] = ends[0] + 1;
      const marks = log ? logTicks(low * scale.by, high * scale.by).tickvals ?? [] : roundTicks(ends[0], ends[1], 5);
      const ticks = marks.map((mark) => (log ? Math.log10(mark) : mark)).filter((mark) => mark >= ends[0] && mark <= ends[1]);
      return { label: titled(column.label, scale.sign), value: (row) => { const value = column.number(row); return value === null ? null : bend(value); },
        low: ends[0], high: ends[1], ticks, texts: ticks.map((tick) => plain(Number((log ? 10 ** tick : tick).toPrecision(3)))) };
    });
    return [...ofAxis, ...ofResult];
  };
}

function parallel(look, width) {
  const y = columnOf.get(state.y);
  if (!y) return { none: "There is no result to draw." };
  const needed = [y, columnOf.get(state.cost)].filter(Boolean);
  let rows = [];
  for (let row = 0; row < rowCount; row++) {
    if (needed.every((column) => column.number(row) !== null) && axes.every((axis) => !axis.varies || axis.codes[row] >= 0)) rows.push(row);
  }
  if (rows.length === 0) return { none: "No finished run has all of these." };
  const all = rows.length;
  const lines = rulers()(rows);
  if (lines.length < 2) return { none: "Parallel coordinates need an axis that varies." };
  const scale = drawn(y.unit, rows.map((row) => y.number(row)));
  const values = rows.map((row) => y.number(row) * scale.by);
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (!(high > low)) high = low + 1e-9;
  const bar = { title: { text: escapeText(titled(y.label, scale.sign)), side: "right", font: { size: 13, color: look.ink } }, thickness: 14, outlinewidth: 0,
    tickfont: { size: 12.5, color: look.soft }, tickvals: roundTicks(low, high, 5) };
  // Too narrow for upright names: they lean.
  const step = (width - 190) / (lines.length - 1);
  const most = Math.max(8, Math.floor(step / 7.2));
  const crowded = lines.some((one) => one.label.length > most);
  const height = crowded ? 430 : 400;
  const left = Math.max(60, 10 + 7 * Math.max(...lines[0].texts.map((text) => text.length)));
  const gl = hasGl && !onPaper;
  const stride = Math.ceil(all / (gl ? linesMostGl : linesMost));
  rows = rows.filter((_, at) => at % stride === 0);
  const thinned = rows.length < all ? ` ${plain(rows.length)} of them are drawn, evenly picked.` : "";
  const words = `One line a run, ${plain(all)} finished runs, coloured by ${y.label}.${thinned}`;
  const label = `Parallel coordinates of ${plain(all)} runs: ${lines.map((one) => one.label).join(", ")}`;
  if (gl) {
    const data = [{
      type: "parcoords", labelangle: crowded ? -18 : 0, labelside: "top", labelfont: { size: 13, color: look.ink }, tickfont: { size: 12, color: look.soft },
      rangefont: { size: 1, color: "rgba(0,0,0,0)" }, line: { color: rows.map((row) => y.number(row) * scale.by), cmin: low, cmax: high, colorscale: lineScale(look), showscale: true, colorbar: bar },
      unselected: { line: { color: look.grid, opacity: 0.35 } },
      dimensions: lines.map((one) => ({ label: escapeText(one.label), values: rows.map(one.value), range: [one.low, one.high], tickvals: one.ticks, ticktext: one.texts.map(escapeText) })),
      meta: { kind: "parallel" },
    }];
    const layout = layoutLook(look, width, height, { margin: { l: left, r: 40, t: crowded ? 90 : 56, b: 26 } });
    return { data, layout, label, caption: `${words} Drag along an axis to keep a range of it; drag a name to move the axis.` };
  }
  // Without WebGL: thin lines in a few shades, and as many as can still be told apart.
  const kept = rows.map((row) => [row, y.number(row) * scale.by]);
  const place = (one, row) => (one.high > one.low ? (one.value(row) - one.low) / (one.high - one.low) : 0.5);
  const data = [];
  for (let shade = 0; shade < shades; shade++) {
    const own = kept.filter(([, value]) => Math.min(shades - 1, Math.floor(((value - low) / (high - low)) * shades)) === shade);
    if (own.length === 0) continue;
    const [xs, ys] = [[], []];
    for (const [row] of own) {
      lines.forEach((one, at) => { xs.push(at); ys.push(place(one, row)); });
      xs.push(null);
      ys.push(null);
    }
    data.push({ type: "scatter", mode: "lines", x: xs, y: ys, line: { width: 1, color: lineShade(look, (shade + 0.5) / shades) }, opacity: 0.65, hoverinfo: "skip", showlegend: false,
      meta: { kind: "parallel" } });
  }
  data.push({ type: "scatter", mode: "markers", x: [null], y: [null], showlegend: false, hoverinfo: "skip",
    marker: { color: [low], cmin: low, cmax: high, colorscale: lineScale(look), showscale: true, colorbar: bar }, meta: { kind: "key" } });
  const notes = lines.flatMap((one, at) => [
    { text: escapeText(one.label), x: at, y: 1, yref: "paper", yanchor: "bottom", yshift: 12, xanchor: crowded && at + 1 < lines.length ? "left" : "center", textangle: crowded ? -18 : 0, showarrow: false, font: { size: 13, color: look.ink } },
    ...one.ticks.map((tick, i) => ({ text: escapeText(one.texts[i]), x: at, y: one.high > one.low ? (tick - one.low) / (one.high - one.low) : 0.5, xanchor: "right", xshift: -3,
      showarrow: false, font: { size: 12, color: look.soft }, bgcolor: fade(look.card, 0.75), borderpad: 0 })),
  ]);
  const shapes = lines.map((_, at) => ({ type: "line", x0: at, x1: at, y0: 0, y1: 1, line: { color: look.soft, width: 1 }, layer: "above" }));
  const layout = layoutLook(look, width, height, {
    margin: { l: left, r: 16, t: crowded ? 96 : 56, b: 18 }, annotations: notes, shapes,
    xaxis: { visible: false, range: [-0.12, lines.length - 0.92], fixedrange: true }, yaxis: { visible: false, range: [-0.03, 1.03], fixedrange: true },
  });
  return { data, layout, label, caption: words };
}
