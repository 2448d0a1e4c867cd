// Learning: right answers, or returns of a policy, over epochs, a curve a value of an axis; the other axes are held.
const learnersMost = 16;

/** What several settings knew after an epoch: of one, its own mean and interval; of several, their mean alone. */
function knownAt(settings, at) {
  const there = settings.map((setting) => sweep.learning.settings[setting]).filter((one) => one && one.mean[at] !== null);
  if (there.length === 0) return null;
  if (there.length === 1) return { mean: there[0].mean[at], half: there[0].half[at], n: there[0].n };
  const n = there.reduce((sum, one) => sum + one.n, 0);
  return { mean: there.reduce((sum, one) => sum + one.n * one.mean[at], 0) / n, half: null, n };
}

function learning(look, width) {
  const known = sweep.learning;
  if (!known || known.epochs.length < 2) return { none: "No finished run has records of several epochs." };
  // shares are shown in percent, returns as they are
  const [by, unit] = known.shares ? [100, `${gap}%`] : [1, ""];
  const series = axisOf.get(state.learner) ?? null;
  const rest = others([series]);
  const groups = new Map();
  for (let setting = 0; setting < rowsOf.length; setting++) {
    if (!known.settings[setting] || rest.held.some((axis) => axis.codes[setting] !== state.hold[axis.name])) continue;
    const kind = series ? series.codes[setting] : 0;
    if (kind < 0) continue;
    if (!groups.has(kind)) groups.set(kind, []);
    groups.get(kind).push(setting);
  }
  const kinds = [...groups.keys()].sort((a, b) => a - b);
  if (kinds.length === 0) return { none: `No finished run has records here.${rest.text}` };
  const kept = kinds.slice(0, learnersMost);
  // What is known before the first update would press all else flat.
  const start = kept.map((kind) => knownAt(groups.get(kind), 0)?.mean).filter((mean) => mean !== undefined);
  const later = kept.map((kind) => knownAt(groups.get(kind), 1)?.mean).filter((mean) => mean !== undefined);
  const cut = known.epochs[0] === 0 && known.epochs.length > 2 && Math.max(...start) < Math.min(...later);
  const epochs = known.epochs.map((epoch, at) => [epoch, at]).slice(cut ? 1 : 0);
  const data = [];
  const all = [];
  for (const kind of kept) {
    const points = epochs.map(([epoch, at]) => ({ epoch, ...knownAt(groups.get(kind), at) })).filter((point) => point.mean !== undefined);
    const style = styleOf(series, kind, look);
    const banded = points.filter((point) => point.half !== null);
    if (banded.length > 1) {
      data.push({ type: "scatter", mode: "lines", x: [...banded, ...banded.toReversed()].map((point) => point.epoch), y: [...banded.map((point) => by * (point.mean + point.half)),
        ...banded.toReversed().map((point) => by * (point.mean - point.half))], line: { width: 0 }, fill: "toself", fillcolor: fade(style.colour, kept.length > 4 ? 0.1 : 0.16), hoverinfo: "skip", showlegend: false, meta: { kind: "band" } });
    }
    const say = (point) => [`<b>${(by * point.mean).toFixed(2)}${unit}</b> ${escapeText(known.label)}`, point.half === null ? "" : `±${gap}${(by * point.half).toFixed(2)}${unit} (95${gap}%)`, `epoch ${point.epoch}`, `n = ${point.n}`,
      series ? escapeText(`${series.label} = ${series.texts[kind]}`) : ""].filter(Boolean).join("<br>");
    data.push({ type: "scatter", mode: points.length > 24 ? "lines" : "lines+markers", x: points.map((point) => point.epoch), y: points.map((point) => by * point.mean), name: escapeText(series ? series.ticks[kind] : known.label),
      showlegend: series !== null, line: { color: style.colour, width: 2, dash: style.dash }, marker: { color: style.colour, symbol: style.symbol, size: 5 }, text: points.map(say), hovertemplate: "%{text}<extra></extra>",
      customdata: points.map((point) => [point.n, point.mean, point.half]), meta: { kind: "learning", series: series ? series.texts[kind] : "" } });
    all.push(...points);
  }
  const [low, high] = extent(all.map((point) => by * point.mean));
  const room = Math.max(0.5, 0.06 * (high - low));
  const keyHeight = series ? kept.length * 25 + 110 : 0;
  const tall = Math.round(Math.min(440, Math.max(320, width * 0.4)));
  const height = Math.max(tall, width < 620 ? 0 : keyHeight) + (width < 620 ? keyHeight / 2 : 0);
  const layout = layoutLook(look, width, height, {
    margin: { l: 70, r: 16, t: 14, b: 56 }, showlegend: series !== null, legend: series ? keyTitle(look, series.label) : {},
    xaxis: axisLook(look, { title: "epoch", range: [epochs[0][0] - 0.4, epochs.at(-1)[0] + 0.4], showgrid: false, tick0: 0, dtick: Math.max(1, Math.ceil((epochs.at(-1)[0] - epochs[0][0]) / 10)) }),
    yaxis: axisLook(look, { title: known.shares ? `${known.label} (%)` : known.label, range: known.shares ? [Math.max(0, low - room), Math.min(100.5, high + room)] : [low - room, high + room], nticks: 7 }),
  });
  let caption = `Mean over runs that differ in the seed alone, ${countWords(all)} a point; bands are its 95${gap}% confidence interval.` +
    (cut ? ` Before the first update it was ${extent(start).map((end) => `${(by * end).toFixed(1)}${unit}`).join(" to ")}, which is left out.` : "");
  if (rest.pooled.length) caption += ` Pooled over ${listed(rest.pooled.map((axis) => axis.label))}: different settings, no interval.`;
  caption += rest.text;
  if (kept.length < kinds.length) caption += ` The first ${kept.length} of ${kinds.length} curves are drawn.`;
  return { data, layout, caption, label: `${known.label} over epochs${series ? `, a curve for each ${series.label}` : ""}` };
}
