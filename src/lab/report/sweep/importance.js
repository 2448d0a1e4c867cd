// What matters: the share of the variance of a result that each axis explains. Shares come with the table.
function importance(look, width) {
  const y = columnOf.get(state.y);
  const found = y && sweep.importance[y.name];
  if (!found) return { none: "Needs three finished runs that differ in an axis and in the result." };
  const parts = found.parts.toReversed();
  const text = (share) => `${(100 * share).toFixed(1)}${gap}%`;
  const names = parts.map((part) => escapeText(short(part.name, width < 620 ? 16 : 34)));
  const most = Math.max(...parts.map((part) => part.share));
  const say = (part) => [`<b>${text(part.share)}</b> of the variance of ${escapeText(y.label)}`, escapeText(part.name), part.chance === null ? "" : `an axis that does nothing: ${text(part.chance)}`].filter(Boolean).join("<br>");
  const places = parts.map((_, at) => at);
  const data = [{ type: "bar", orientation: "h", x: parts.map((part) => 100 * part.share), y: places, marker: { color: parts.map((part) => (part.chance === null ? look.soft : look.hues[0])) },
    text: parts.map((part) => text(part.share)), textposition: "outside", cliponaxis: false, textfont: { color: look.ink, size: 12.5 }, customdata: parts.map(say), hovertemplate: "%{customdata}<extra></extra>", showlegend: false, meta: { kind: "importance", names: parts.map((part) => part.name) } },
  { type: "scatter", mode: "markers", x: parts.map((part) => (part.chance === null ? null : 100 * part.chance)), y: places, marker: { symbol: "line-ns-open", size: 20, color: look.ink, line: { width: 1.6 } }, hoverinfo: "skip", showlegend: false, meta: { kind: "chance" } }];
  const layout = layoutLook(look, width, 92 + 34 * parts.length, {
    bargap: 0.34, margin: { l: 20, r: 64, t: 6, b: 52 },
    xaxis: axisLook(look, { title: `share of the variance of ${y.label} (%)`, range: [0, Math.max(1, 100 * most)], nticks: 6, rangemode: "tozero" }),
    yaxis: axisLook(look, { title: "axis", tickvals: places, ticktext: names, showgrid: false, range: [-0.6, parts.length - 0.4], ticks: "" }),
  });
  const caption = `Share of an axis: the sum over its values of n × (mean of the runs with that value − mean)², over the sum over runs of (value − mean)²; ${plain(found.runs)} runs. ` +
    "Seeds: the same sum around the mean of each setting. The mark is what an axis that does nothing would explain by chance, (values − 1) / (runs − 1). " +
    (found.balanced ? "Every setting was run equally often, so the parts add up; axes together: what they explain only in combination." : "Not every setting was run equally often, or values were drawn: shares may overlap and need not add up.");
  return { data, layout, caption, label: `Share of the variance of ${y.label} by axis: ${found.parts.map((part) => `${part.name} ${text(part.share)}`).join(", ")}` };
}
