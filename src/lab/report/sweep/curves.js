// Curves: the mean of a result against an axis, with its interval; one curve a value of an axis, one panel of another.
const curvesMost = 16;
const panelsMost = 12;

/** Ends of the ordinate: it follows the means; intervals may stretch it by 0.6 as much, and no share leaves 0 to 100 %. */
function rangeOf(points, column) {
  const [low, high] = extent(points.map((point) => point.mean));
  const [least, most] = extent([low, high, ...points.flatMap((point) => ends(point) ?? [])]);
  const span = high - low || Math.abs(high) * 0.1 || 1;
  const range = [Math.max(least, low - 0.6 * span) - 0.05 * span, Math.min(most, high + 0.6 * span) + 0.05 * span];
  if (low >= 0) range[0] = Math.max(range[0], -0.02 * span);
  if (column.unit === "fraction") range[1] = Math.min(range[1], 1.005);
  return { range, span: range[1] - range[0], cut: least < range[0] || most > range[1] };
}

/** Neighbours that have an interval share a band: its outline, there along the upper ends and back along the lower. */
function bandsOf(line, place, by) {
  const runs = [[]];
  for (const point of line) ends(point) ? runs.at(-1).push(point) : runs.push([]);
  const kept = runs.filter((run) => run.length > 1);
  const outline = kept.flatMap((run) => [...run.map((point) => [point, 1]), ...run.toReversed().map((point) => [point, 0]), null]).slice(0, -1);
  return { banded: new Set(kept.flat()), x: outline.map((one) => one && place(one[0])), y: outline.map((one) => one && ends(one[0])[one[1]] * by) };
}

function curves(look, width) {
  const [x, y] = [axisOf.get(state.x), columnOf.get(state.y)];
  if (!x || !y) return { none: "There is no axis or no result to draw." };
  const [series, panel] = [state.series, state.panel].map((name) => axisOf.get(name) ?? null);
  const rest = others([x, series, panel]);
  // Where values were drawn from a range, every setting is a point.
  const pooled = !x.binned && (rest.pooled.length > 0 || [series, panel].some((axis) => axis?.binned));
  const points = pointsOf(y, [panel, series, x], rest, pooled, x.binned);
  if (points.length === 0) return { none: `No finished run has ${y.label} here.${rest.text}` };
  const [allPanels, allLines] = [0, 1].map((at) => [...new Set(points.map((point) => point.at[at]))].sort((a, b) => a - b));
  const [panels, lines] = [allPanels.slice(0, panelsMost), allLines.slice(0, curvesMost)];

  // Panels share a scale, unless one of them would be pressed flat by another.
  const whole = rangeOf(points, y);
  const ranges = panels.map((at) => rangeOf(points.filter((point) => point.at[0] === at), y));
  const own = panels.length > 1 && Math.min(...ranges.map((one) => one.span)) < whole.span / 4;
  const across = Math.min(panels.length === 4 && width < 1000 ? 2 : 3, panels.length, Math.max(1, Math.floor(width / 300)));
  const down = Math.ceil(panels.length / across);
  const keyHeight = series ? lines.length * 25 + 110 : 0;
  const tall = panels.length === 1 ? Math.round(Math.min(460, Math.max(320, width * 0.42))) : 250 * down;
  const height = Math.max(tall + 52 * down + 20, width < 620 ? 0 : keyHeight) + (width < 620 ? keyHeight / 2 : 0);
  const layout = layoutLook(look, width, height, {
    grid: { rows: down, columns: across, pattern: "independent", xgap: own ? 0.2 : 0.1, ygap: 0.3 }, margin: { l: 70, r: 16, t: panel ? 30 : 14, b: 56 },
    annotations: panel ? panels.map((at, number) => ({ text: `<b>${escapeText(`${panel.label} ${panel.ticks[at]}`)}</b>`, xref: `x${number + 1} domain`,
      yref: `y${number + 1} domain`, x: 0, y: 1, xanchor: "left", yanchor: "bottom", yshift: 4, showarrow: false })) : [],
    showlegend: series !== null, legend: series ? keyTitle(look, series.label) : {},
  });
  const data = [];
  panels.forEach((panelAt, number) => {
    const suffix = number || "" ? String(number + 1) : "";
    const left = number % across === 0;
    const lowest = number + across >= panels.length;
    layout[`xaxis${suffix}`] = axisLook(look, { ...ticksOf(x), range: spanOf(x), showgrid: false, showticklabels: lowest, title: lowest ? x.label : "", ...(number ? { matches: "x" } : {}) });
    layout[`yaxis${suffix}`] = axisLook(look, { range: (own ? ranges[number] : whole).range.map((end) => end * y.by), nticks: 7, showticklabels: own || left,
      ticklen: own || left ? 4 : 0, title: left ? y.title : "", ...(number && !own ? { matches: "y" } : {}) });
    lines.forEach((lineAt, order) => {
      const line = points.filter((point) => point.at[0] === panelAt && point.at[1] === lineAt).sort((a, b) => a.at[2] - b.at[2]);
      if (line.length === 0) return;
      const style = styleOf(series, lineAt, look);
      // Words have no distance: their points stand side by side and are not joined.
      const dodge = ((order + 0.5) / lines.length - 0.5) * 0.5;
      const place = (point) => (x.binned ? x.column.number(rowsOf[point.settings[0]][0]) : x.numeric ? x.numbers[point.at[2]] : point.at[2] + dodge);
      const joined = x.numeric && !x.binned;
      const band = joined ? bandsOf(line, place, y.by) : { banded: new Set(), x: [] };
      const common = { xaxis: `x${suffix}`, yaxis: `y${suffix}`, legendgroup: String(lineAt), type: "scatter" };
      if (band.x.length) {
        data.push({ ...common, x: band.x, y: band.y, mode: "lines", line: { width: 0 }, fill: "toself", hoverinfo: "skip",
          fillcolor: fade(style.colour, lines.length > 4 ? 0.11 : 0.17), showlegend: false, meta: { kind: "band" } });
      }
      const reach = (point, end) => (band.banded.has(point) || !ends(point) ? 0 : Math.abs(ends(point)[end] - point.mean) * y.by);
      const where = (point) => [`${x.label} = ${x.binned ? plain(place(point)) : x.texts[point.at[2]]}`, series && `${series.label} = ${series.texts[lineAt]}`, panel && `${panel.label} = ${panel.texts[panelAt]}`];
      data.push({
        ...common, name: escapeText(series ? series.ticks[lineAt] : y.label), x: line.map(place), y: line.map((point) => point.mean * y.by),
        error_y: { symmetric: false, color: fade(style.colour, 0.75), thickness: 1.3, width: 3, array: line.map((point) => reach(point, 1)), arrayminus: line.map((point) => reach(point, 0)) },
        mode: joined ? "lines+markers" : "markers", line: { color: style.colour, width: 2, dash: style.dash },
        showlegend: series !== null && !data.some((trace) => trace.legendgroup === common.legendgroup && trace.showlegend),
        marker: { color: style.colour, symbol: style.symbol, size: x.binned ? 5 : 7, opacity: x.binned ? 0.7 : 1 },
        text: line.map((point) => hover(point, y, where(point))), hovertemplate: "%{text}<extra></extra>", customdata: line.map((point) => [point.n, point.mean, point.half]),
        meta: { kind: "mean", series: series ? series.texts[lineAt] : "", panel: panel ? panel.texts[panelAt] : "" },
      });
    });
  });

  // In words.
  const counts = points.map((point) => point.n);
  let caption = `Mean of runs that differ in the seed alone, ${countWords(points)} a point. ${x.numeric && !x.binned ? "Bands are" : "Bars are"} its 95${gap}% ` +
    `confidence interval (Student's t)${counts.includes(1) ? "; points with n = 1 have none" : ""}${counts.includes(2) ? "; with n = 2 it is wide" : ""}.`;
  if (pooled) {
    caption = `Mean over runs and over ${listed([...rest.pooled, series, panel].filter((axis) => axis && (axis.binned || rest.pooled.includes(axis))).map((axis) => axis.label))}, pooled: these are ` +
      `different settings, not repetitions, so the ${x.numeric ? "band" : "bar"} is the range from least to greatest, not a confidence interval. ${countWords(points)} a point.`;
  } else if (counts.every((n) => n === 1)) caption = "One run a point (n = 1), so there is no band.";
  if (x.binned) caption += ` Values of ${x.label} were drawn from a range or are many; every setting is a point, and points are not joined.`;
  if (own) caption += " Each panel has a scale of its own.";
  if ((own ? ranges : [whole]).some((one) => one.cut)) caption += " Some reach beyond the frame.";
  caption += rest.text;
  if (lines.length < allLines.length) caption += ` The first ${lines.length} of ${allLines.length} curves are drawn.`;
  if (panels.length < allPanels.length) caption += ` The first ${panels.length} of ${allPanels.length} panels are drawn.`;
  const label = `${y.label} against ${x.label}${series ? `, a curve for each ${series.label}` : ""}${panel ? `, a panel for each ${panel.label}` : ""}`;
  return { data, layout, caption, label };
}
