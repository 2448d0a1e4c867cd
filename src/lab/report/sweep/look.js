// How figures look, in light, dark and on paper; the frame every figure is drawn in.
const themes = {
  light: { name: "light", ink: "#131a22", soft: "#56616f", grid: "#e9edf1", line: "#c9d1d9", card: "#ffffff",
    hues: ["#0072b2", "#d55e00", "#009e73", "#b5508b", "#56b4e9", "#b88a00", "#5d6b7a", "#131a22"] },
  dark: { name: "dark", ink: "#e9eef4", soft: "#9ba8b6", grid: "#252d37", line: "#3a4552", card: "#161c24",
    hues: ["#3fa2e8", "#f27d35", "#2fc69a", "#e58fc0", "#9ad6fb", "#f7c64e", "#a3b1bf", "#e9eef4"] },
};
const dashes = ["solid", "6px 3px", "2px 3px", "9px 3px 2px 3px", "12px 4px", "5px 2px", "2px 2px", "9px 3px 2px 3px 2px 3px"];
const symbols = ["circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x", "pentagon"];
const font = 'system-ui, "Segoe UI", Roboto, "Helvetica Neue", "Noto Sans", "Liberation Sans", Arial, sans-serif';
// Dark violet to yellow, as the level maps of run reports.
const viridis = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137],
  [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37]];
const colourScale = viridis.map((rgb, at) => [at / (viridis.length - 1), `rgb(${rgb})`]);

function mix(part) {
  const along = Math.max(0, Math.min(1, part)) * (viridis.length - 1);
  const from = Math.min(viridis.length - 2, Math.floor(along));
  const rgb = viridis[from].map((value, i) => Math.round(value + (along - from) * (viridis[from + 1][i] - value)));
  return `rgb(${rgb})`;
}

function isDark() {
  const set = document.documentElement.style.colorScheme;
  return set ? set === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

let onPaper = false;
const theme = () => (isDark() && !onPaper ? themes.dark : themes.light);

/** Colour, dash and marker of a curve. Many ordered numbers get an ordered colour. */
function styleOf(axis, at, look) {
  const many = axis && axis.numeric && axis.texts.length > 8;
  const along = many ? at / (axis.texts.length - 1) : 0;
  const colour = many ? mix(look.name === "dark" ? 0.15 + 0.85 * along : 0.82 * along) : look.hues[at % look.hues.length];
  return { colour, dash: dashes[at % dashes.length], symbol: symbols[at % symbols.length] };
}

function fade(colour, alpha) {
  if (colour.startsWith("rgb(")) return colour.replace("rgb(", "rgba(").replace(")", `,${alpha})`);
  const parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgba(${parts},${alpha})`;
}

function axisLook(look, extra) {
  return {
    color: look.soft, gridcolor: look.grid, linecolor: look.soft, tickcolor: look.soft, zeroline: false, showline: true,
    ticks: "outside", ticklen: 4, automargin: true, tickfont: { size: 12.5 }, minor: { ticks: "" }, ...extra,
    title: { text: escapeText(extra.title), standoff: 10, font: { size: 13.5, color: look.ink } },
  };
}

function layoutLook(look, width, height, extra) {
  return {
    width, height, paper_bgcolor: look.card, plot_bgcolor: look.card,
    font: { family: font, size: 13, color: look.ink }, margin: { l: 64, r: 16, t: 14, b: 52 },
    hovermode: "closest", dragmode: "zoom",
    hoverlabel: { bgcolor: look.ink, bordercolor: look.ink, font: { family: font, size: 13, color: look.card }, align: "left" },
    legend: { font: { size: 13 }, bgcolor: "rgba(0,0,0,0)", tracegroupgap: 4 },
    ...extra,
  };
}

/** Ticks of an abscissa at the values it has. Words stand at 0, 1, 2, ... */
function ticksAt(axis, width) {
  const all = axis.numeric ? axis.numbers : axis.texts.map((_, at) => at);
  const texts = axis.numeric ? axis.numbers.map(plain) : axis.shorts;
  const safe = texts.map(escapeText);
  if (axis.drawn || (axis.numeric && all.length > 40)) return { type: axis.log ? "log" : "linear", nticks: 8 };
  // As many as there is room for, the first kept: on a log axis by place, not by number.
  const place = (value) => (axis.log ? Math.log10(value) : value);
  const span = place(all[all.length - 1]) - place(all[0]) || 1;
  const kept = [];
  let end = -Infinity;
  all.forEach((value, at) => {
    const centre = ((place(value) - place(all[0])) / span) * width;
    const half = Math.min(texts[at].length, axis.numeric ? 99 : 4) * 3.6 + 4;
    if (centre - half < end) return;
    kept.push(at);
    end = centre + half;
  });
  const widest = Math.max(...texts.map((text) => text.length)) * 7;
  const room = width / Math.max(1, all.length);
  return {
    type: axis.log ? "log" : "linear", tickvals: kept.map((at) => all[at]), ticktext: kept.map((at) => safe[at]),
    tickangle: !axis.numeric && widest > room ? -35 : 0,
  };
}

function spanOf(axis) {
  if (!axis.numeric) return [-0.5, axis.texts.length - 0.5];
  const ends = [axis.numbers[0], axis.numbers[axis.numbers.length - 1]].map((end) => (axis.log ? Math.log10(end) : end));
  const room = (ends[1] - ends[0]) * 0.035 || 0.5;
  return [ends[0] - room, ends[1] + room];
}

// A processor that plays the graphics card is slower at this than plain drawing.
const hasGl = (() => {
  try {
    const gl = document.createElement("canvas").getContext("webgl", { failIfMajorPerformanceCaveat: true });
    if (!gl) return false;
    const named = gl.getExtension("WEBGL_debug_renderer_info");
    const played = named && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(named.UNMASKED_RENDERER_WEBGL));
    gl.getExtension("WEBGL_lose_context")?.loseContext();
    return !played;
  } catch {
    return false;
  }
})();

// --- figures ---

const figures = [];

/** `build(look, width)` gives data, layout, caption, label, and more: markup below; or only `none`: why there is nothing. */
function figure(id, build) {
  const card = document.getElementById(id);
  const one = { id, build, card, plot: card.querySelector(".plot") };
  card.querySelectorAll("[data-save]").forEach((button) => button.addEventListener("click", () => save(one, button)));
  figures.push(one);
  return one;
}

function draw(one) {
  const width = onPaper ? 700 : Math.max(280, Math.floor(one.plot.getBoundingClientRect().width));
  const built = one.build(theme(), width);
  const empty = "none" in built;
  one.plot.hidden = empty;
  one.card.querySelector(".save").hidden = empty;
  one.card.querySelector(".caption").textContent = empty ? built.none : built.caption;
  const more = one.card.querySelector(".more");
  more.replaceChildren(...(built.more ?? []));
  if (empty) {
    Plotly.purge(one.plot);
    return;
  }
  one.plot.setAttribute("aria-label", built.label);
  one.plot.style.height = `${built.layout.height}px`;
  Plotly.react(one.plot, built.data, built.layout, { displayModeBar: false, responsive: false, displaylogo: false });
}

function download(name, address) {
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
}

/** What a saved figure holds: drawn anew on white, as wide as a page of a paper. */
function forPaper(one) {
  const built = one.build(themes.light, 760);
  return { data: built.data, layout: { ...built.layout, paper_bgcolor: "#ffffff", plot_bgcolor: "#ffffff" } };
}

async function save(one, button) {
  const format = button.dataset.save;
  const spec = forPaper(one);
  const { width, height } = spec.layout;
  const address = await Plotly.toImage(spec, { format, width, height, scale: format === "png" ? 3 : 1 });
  download(`${sweep.name}-${one.id}.${format}`, address);
}
