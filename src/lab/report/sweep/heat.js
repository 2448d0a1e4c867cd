// Heat map: the mean of a result over two axes, the value in each cell where there is room.
const cellsMost = 40;
const binsMost = 16;

/** Cells along an axis: its values, or ranges of them where there are too many. */
function cellsOf(axis) {
  if (!axis.numeric || axis.texts.length <= cellsMost) {
    return { texts: axis.numeric ? axis.numbers.map(plain) : axis.shorts, full: axis.texts, of: (row) => axis.codes[row], binned: false };
  }
  const bend = (value) => (axis.log ? Math.log(value) : value);
  const [low, high] = [bend(axis.numbers[0]), bend(axis.numbers[axis.numbers.length - 1])];
  const edge = (at) => {
    const value = low + ((high - low) * at) / binsMost;
    return plain(Number((axis.log ? Math.exp(value) : value).toPrecision(3)));
  };
  const texts = Array.from({ length: binsMost }, (_, at) => `${edge(at)} – ${edge(at + 1)}`);
  const starts = Array.from({ length: binsMost }, (_, at) => edge(at));
  const of = (row) => {
    const value = axis.column.number(row);
    return value === null ? -1 : Math.min(binsMost - 1, Math.floor(((bend(value) - low) / (high - low)) * binsMost));
  };
  return { texts: starts, full: texts, of, binned: true };
}

function heat(look, width) {
  const [x, y] = [axisOf.get(state.hx), axisOf.get(state.hy)];
  const value = columnOf.get(state.y);
  if (!x || !y || !value) return { none: "A heat map needs two axes and a result." };
  if (x === y) return { none: "Choose two different axes." };
  const held = heldWords([x, y]);
  const pooled = held.pooled.length > 0;
  const [across, down] = [cellsOf(x), cellsOf(y)];
  const groups = gather(heldRows([x, y]), value, (row) => {
    const [i, j] = [across.of(row), down.of(row)];
    return i < 0 || j < 0 ? null : j * across.texts.length + i;
  });
  if (groups.size === 0) return { none: `No finished run has ${value.label} here.${held.text}` };
  const grid = () => down.texts.map(() => across.texts.map(() => null));
  const [z, text, tips, counts] = [grid(), grid(), grid(), []];
  for (const line of text) line.fill("");
  const scale = drawn(value.unit, [...groups.values()].flatMap((group) => group.values));
  let [low, high] = [Infinity, -Infinity];
  const parts = [];
  for (const [key, group] of groups) {
    const point = summary(group.values);
    const [j, i] = [Math.floor(key / across.texts.length), key % across.texts.length];
    z[j][i] = point.mean * scale.by;
    [low, high] = [Math.min(low, z[j][i]), Math.max(high, z[j][i])];
    counts.push(point.n);
    parts.push([j, i]);
    tips[j][i] = hover(point, value, [`${x.label} = ${across.full[i]}`, `${y.label} = ${down.full[j]}`], pooled || across.binned || down.binned);
  }
  const most = Math.max(Math.abs(low), Math.abs(high));
  const digits = Math.max(0, Math.min(3, most >= 100 ? 0 : most >= 10 ? 1 : 2));
  for (const [j, i] of parts) text[j][i] = z[j][i].toFixed(digits).replace("-", "−");
  const longest = Math.max(...parts.map(([j, i]) => text[j][i].length));
  const left = 40 + 7.2 * Math.max(...down.texts.map((one) => one.length));
  const barWidth = width < 620 ? 86 : 118;
  const cellWidth = (width - left - barWidth) / across.texts.length;
  const cellHeight = Math.max(13, Math.min(44, 520 / down.texts.length));
  const roomy = cellWidth > longest * 7 + 6 && cellHeight >= 16;
  const turned = !x.numeric && Math.max(...across.texts.map((one) => one.length)) * 7.4 > cellWidth;
  const bottom = turned ? 62 + 4.6 * Math.max(...across.texts.map((one) => one.length)) : 58;
  const height = Math.round(Math.max(240, cellHeight * down.texts.length + bottom + 18));
  const places = (cells, room) => {
    const stride = Math.max(1, Math.ceil(cells.texts.length / Math.max(2, Math.floor(room))));
    const at = cells.texts.map((_, i) => i).filter((i) => i % stride === 0);
    return { tickvals: at, ticktext: at.map((i) => escapeText(cells.texts[i])) };
  };
  const widest = Math.max(...across.texts.map((one) => one.length)) * 7.4 + 8;
  const data = [{
    type: "heatmap", x: across.texts.map((_, i) => i), y: down.texts.map((_, i) => i), z, zmin: low, zmax: high > low ? high : low + 1e-9,
    text, customdata: tips, hovertemplate: "%{customdata}<extra></extra>",
    colorscale: colourScale, xgap: cellWidth > 8 ? 1.5 : 0, ygap: cellHeight > 8 ? 1.5 : 0, hoverongaps: false,
    colorbar: { title: { text: escapeText(titled(value.label, scale.sign)), side: "right", font: { size: 13, color: look.ink } }, thickness: 14, outlinewidth: 0,
      tickfont: { size: 12.5, color: look.soft }, ticks: "outside", ticklen: 3, tickcolor: look.soft, len: 1, tickvals: roundTicks(low, high, 5) },
    meta: { kind: "heat" },
  }];
  if (roomy) {
    // Dark words on light cells, light on dark.
    const inks = parts.map(([j, i]) => (high > low && (z[j][i] - low) / (high - low) < 0.55 ? "#ffffff" : "#131a22"));
    data.push({ type: "scatter", mode: "text", x: parts.map(([, i]) => i), y: parts.map(([j]) => j), text: parts.map(([j, i]) => text[j][i]),
      textfont: { size: 12.5, color: inks }, hoverinfo: "skip", showlegend: false, cliponaxis: false, meta: { kind: "words" } });
  }
  const layout = layoutLook(look, width, height, {
    margin: { l: left, r: 12, t: 12, b: bottom },
    xaxis: axisLook(look, { title: x.label, type: "linear", showgrid: false, showline: false, ...places(across, turned ? width / 20 : (width - left - barWidth) / widest),
      tickangle: turned ? -35 : 0, range: [-0.5, across.texts.length - 0.5] }),
    yaxis: axisLook(look, { title: y.label, type: "linear", showgrid: false, showline: false, ...places(down, (height - bottom) / 17),
      range: y.numeric ? [-0.5, down.texts.length - 0.5] : [down.texts.length - 0.5, -0.5] }),
  });
  let caption = pooled
    ? `Mean over runs and over ${listed(held.pooled.map((axis) => axis.label))}, pooled: different settings, not repetitions; ${countWords(counts)} a cell.`
    : `Mean of runs that differ in the seed alone, ${countWords(counts)} a cell.`;
  caption += ` Empty cells have no finished run.${held.text}`;
  if (across.binned || down.binned) caption += " Values drawn from a range are gathered into cells of equal width; each is marked at its lower end.";
  return { data, layout, caption, label: `${value.label} by ${x.label} and ${y.label}` };
}
