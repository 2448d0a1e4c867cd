// All settings at once: a line a run through its axes and results, coloured by the result.
const linesMost = 400;
const linesMostGl = 1500;
const shades = 8;

/** A ruler: where a row lies between `low` and `high`, and what is marked there. */
function rulerOf(column) {
  const axis = axisOf.get(column.name);
  if (column.words) {
    const last = axis.texts.length - 1;
    return { label: axis.label, value: (row) => last - axis.codes[sweep.setting[row]], low: 0, high: last, ticks: axis.ticks.map((text, at) => [last - at, text]) };
  }
  const bend = column.log && column.ends[0] > 0 ? Math.log10 : (value) => value;
  const [low, high] = column.ends.map(bend);
  return { label: column.title, value: (row) => bend(column.number(row)), low, high: high > low ? high : low + 1, ticks: column.marks.map(([at, text]) => [bend(at), text]) };
}

function parallel(look, width) {
  const [y, cost] = [columnOf.get(state.y), columnOf.get(state.cost)];
  if (!y) return { none: "There is no result to draw." };
  const drawn = [...new Set([cost, y])].filter(Boolean);
  const done = sweep.setting.map((_, row) => row).filter((row) => drawn.every((column) => column.number(row) !== null) && varied.every((axis) => axis.codes[sweep.setting[row]] >= 0));
  if (done.length === 0) return { none: "No finished run has all of these." };
  if (varied.length === 0) return { none: "Parallel coordinates need an axis that varies." };
  const rulers = [...varied.slice(0, 10).map((axis) => axis.column), ...drawn].map(rulerOf);
  const gl = hasGl && !onPaper;
  const stride = Math.ceil(done.length / (gl ? linesMostGl : linesMost));
  const rows = done.filter((_, at) => at % stride === 0);
  const colours = rows.map((row) => y.number(row) * y.by);
  const [low, high] = y.ends.map((end) => end * y.by);
  const scale = { cmin: low, cmax: high > low ? high : low + 1e-9, showscale: true, colorbar: barLook(look, y.title), colorscale: Array.from({ length: 11 }, (_, at) => [at / 10, lineShade(look, at / 10)]) };
  // Too narrow for upright names: they lean.
  const crowded = rulers.some((one) => one.label.length * 7.2 > (width - 190) / (rulers.length - 1));
  const steep = crowded && (width - 190) / (rulers.length - 1) < 90;
  const lean = steep ? -55 : crowded ? -18 : 0;
  if (steep) for (const one of rulers) one.label = short(one.label, 20);
  const margin = { l: Math.max(60, 10 + 7 * Math.max(...rulers[0].ticks.map(([, text]) => text.length))), r: 40, t: steep ? 140 : crowded ? 96 : 56, b: 26 };
  const thinned = rows.length < done.length ? ` ${plain(rows.length)} of them are drawn, evenly picked.` : "";
  const caption = `One line a run, ${plain(done.length)} finished runs, coloured by ${y.label}.${thinned}`;
  const label = `Parallel coordinates of ${plain(done.length)} runs: ${rulers.map((one) => one.label).join(", ")}`;
  const height = steep ? 470 : crowded ? 430 : 400;
  if (gl) {
    const dimensions = rulers.map((one) => ({ label: escapeText(one.label), values: rows.map(one.value), range: [one.low, one.high], tickvals: one.ticks.map(([at]) => at), ticktext: one.ticks.map(([, text]) => escapeText(text)) }));
    const data = [{ type: "parcoords", labelangle: lean, labelfont: { size: 13, color: look.ink }, tickfont: { size: 12, color: look.soft }, rangefont: { size: 1, color: "rgba(0,0,0,0)" },
      line: { color: colours, ...scale }, unselected: { line: { color: look.grid, opacity: 0.35 } }, dimensions, meta: { kind: "parallel" } }];
    return { data, layout: layoutLook(look, width, height, { margin }), label, caption: `${caption} Drag along an axis to keep a range of it; drag a name to move the axis.` };
  }
  // Without WebGL: thin lines in a few shades, and as many as can still be told apart.
  const place = (one, value) => (value - one.low) / (one.high - one.low || 1);
  const shadeOf = (colour) => Math.min(shades - 1, Math.floor(((colour - low) / (high - low || 1)) * shades));
  const data = Array.from({ length: shades }, (_, shade) => {
    const own = rows.filter((_, at) => shadeOf(colours[at]) === shade);
    return { type: "scatter", mode: "lines", x: own.flatMap(() => [...rulers.keys(), null]), y: own.flatMap((row) => [...rulers.map((one) => place(one, one.value(row))), null]),
      line: { width: 1, color: lineShade(look, (shade + 0.5) / shades) }, opacity: 0.65, hoverinfo: "skip", showlegend: false, meta: { kind: "parallel" } };
  }).filter((trace) => trace.x.length);
  data.push({ type: "scatter", mode: "markers", x: [null], y: [null], showlegend: false, hoverinfo: "skip", marker: { color: [low], ...scale }, meta: { kind: "key" } });
  const note = (text, x, more) => ({ text: escapeText(text), x, showarrow: false, ...more });
  const annotations = rulers.flatMap((one, at) => [
    note(one.label, at, { y: 1, yref: "paper", yanchor: "bottom", yshift: 12, xanchor: steep || (crowded && at + 1 < rulers.length) ? "left" : "center", textangle: lean }),
    ...one.ticks.map(([tick, text]) => note(text, at, { y: place(one, tick), xanchor: "right", xshift: -3, font: { size: 12, color: look.soft }, bgcolor: fade(look.card, 0.75), borderpad: 0 })),
  ]);
  const shapes = rulers.map((_, at) => ({ type: "line", x0: at, x1: at, y0: 0, y1: 1, line: { color: look.soft, width: 1 }, layer: "above" }));
  const bare = (range) => ({ visible: false, range, fixedrange: true });
  return { data, layout: layoutLook(look, width, height, { margin, annotations, shapes, xaxis: bare([-0.12, rulers.length - 0.92]), yaxis: bare([-0.03, 1.03]) }), label, caption };
}
