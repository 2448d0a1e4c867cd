// Heat map: the mean of a result over two axes, the value in each cell where there is room. The least step of colour is
// the interval of a cell (src/lab/report/sweep/heat.rs), so that noise is not blown up to the whole map.
function shadesOf(points, by, pooled) {
  const [low, high] = extent(points.map((point) => point.mean * by));
  const wide = pooled ? [] : points.filter((point) => point.half !== null).map((point) => 2 * point.half * by).sort((a, b) => a - b);
  const step = wide[Math.floor(wide.length / 2)] ?? 0;
  const [least, most] = sweep.shades;
  if (step <= 0 || (high - low) / step > most) return { low, high, steps: null, scale: colourScale, place: (value) => (high > low ? (value - low) / (high - low) : 0.5) };
  const steps = Math.max(least, Math.min(most, Math.ceil((high - low) / step)));
  const [from, to] = [0.5 * (low + high - steps * step), 0.5 * (low + high + steps * step)];
  const place = (value) => (Math.min(steps - 1, Math.floor(((value - from) / (to - from)) * steps)) + 0.5) / steps;
  const shade = (part) => sweep.ramp[Math.round(part * (sweep.ramp.length - 1))];
  const scale = Array.from({ length: steps }, (_, at) => [[at / steps, shade((at + 0.5) / steps)], [(at + 1) / steps, shade((at + 0.5) / steps)]]).flat();
  return { low: from, high: to, steps, step, scale, place };
}

function heat(look, width) {
  const [x, y] = [axisOf.get(state.hx), axisOf.get(state.hy)];
  const value = columnOf.get(state.y);
  if (!x || !y || !value) return { none: "A heat map needs two axes and a result." };
  if (x === y) return { none: "Choose two different axes." };
  const rest = others([x, y]);
  const gathered = [...rest.pooled, x, y].filter((axis) => axis.binned || rest.pooled.includes(axis));
  const points = pointsOf(value, [x, y], rest, gathered.length > 0);
  if (points.length === 0) return { none: `No finished run has ${value.label} here.${rest.text}` };
  const shades = shadesOf(points, value.by, gathered.length > 0);
  const { low, high } = shades;
  const most = Math.max(Math.abs(low), Math.abs(high));
  const decimals = most >= 100 ? 0 : most >= 10 ? 1 : 2;
  const words = (point) => (point.mean * value.by).toFixed(decimals).replace("-", "−");
  const grid = (empty, of) => {
    const rows = y.texts.map(() => x.texts.map(() => empty));
    for (const point of points) rows[point.at[1]][point.at[0]] = of(point);
    return rows;
  };
  const wide = (axis) => 7.4 * Math.max(...axis.ticks.map((text) => text.length));
  const cellWidth = (width - 200) / x.texts.length;
  const cellHeight = Math.max(13, Math.min(44, 520 / y.texts.length));
  const data = [{
    type: "heatmap", z: grid(null, (point) => point.mean * value.by), zmin: low, zmax: high > low ? high : low + 1e-9, hoverongaps: false,
    text: grid("", words),
    customdata: grid("", (point) => hover(point, value, [`${x.label} = ${x.texts[point.at[0]]}`, `${y.label} = ${y.texts[point.at[1]]}`])),
    hovertemplate: "%{customdata}<extra></extra>", colorscale: shades.scale, xgap: cellWidth > 8 ? 1.5 : 0, ygap: cellHeight > 8 ? 1.5 : 0,
    colorbar: barLook(look, value.title), meta: { kind: "heat", steps: shades.steps, step: shades.step },
  }];
  if (cellWidth > 7 * Math.max(...points.map((point) => words(point).length)) + 6 && cellHeight >= 16) {
    // Dark words on light cells, light on dark.
    const inks = points.map((point) => (shades.place(point.mean * value.by) < 0.55 ? "#ffffff" : "#131a22"));
    data.push({ type: "scatter", mode: "text", x: points.map((point) => point.at[0]), y: points.map((point) => point.at[1]), text: points.map(words),
      textfont: { size: 12.5, color: inks }, hoverinfo: "skip", showlegend: false, cliponaxis: false, meta: { kind: "words" } });
  }
  // As many ticks as there is room for; the first is kept. Words read from the top, numbers rise.
  const ticks = (axis, room) => {
    const stride = Math.max(1, Math.ceil(axis.texts.length / Math.max(2, room)));
    const kept = axis.ticks.map((text, at) => [at, escapeText(text)]).filter(([at]) => at % stride === 0);
    const span = [-0.5, axis.texts.length - 0.5];
    return { title: axis.label, type: "linear", showgrid: false, showline: false, tickvals: kept.map(([at]) => at), ticktext: kept.map(([, text]) => text),
      range: axis === y && !axis.numeric ? span.reverse() : span };
  };
  const turned = !x.numeric && wide(x) > cellWidth;
  const layout = layoutLook(look, width, Math.round(Math.max(240, cellHeight * y.texts.length + 76 + (turned ? 0.6 * wide(x) : 0))), {
    xaxis: axisLook(look, { ...ticks(x, (width - 200) / (turned ? 20 : wide(x) + 8)), tickangle: turned ? -35 : 0 }), yaxis: axisLook(look, ticks(y, 31)),
    margin: { l: 64, r: 12, t: 12, b: 58 },
  });
  let caption = gathered.length
    ? `Mean over runs and over ${listed(gathered.map((axis) => axis.label))}, pooled: different settings, not repetitions; ${countWords(points)} a cell.`
    : `Mean of runs that differ in the seed alone, ${countWords(points)} a cell.`;
  caption += shades.steps ? ` One step of colour is ${plain(shades.step, four)}${value.unit === "fraction" ? `${gap}%` : value.sign && gap + value.sign}, the 95${gap}% interval of a cell (median, end to end): cells of one colour are not told apart by these runs.`
    : gathered.length || points.every((point) => point.half === null) ? " No cell has an interval: colours run from least to greatest, and may show noise." : "";
  caption += ` Empty cells have no finished run.${rest.text}`;
  if (x.binned || y.binned) caption += " Many values are gathered into cells of equal width; each is marked at its lower end.";
  return { data, layout, caption, label: `${value.label} by ${x.label} and ${y.label}` };
}
