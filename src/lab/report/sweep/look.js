// How figures look, in light, dark and on paper; the frame every figure is drawn in. Colours are those of the style sheet.
const sheet = getComputedStyle(document.documentElement);
const dashes = ["solid", "6px 3px", "2px 3px", "9px 3px 2px 3px", "12px 4px", "5px 2px", "2px 2px", "9px 3px 2px 3px 2px 3px"];
const symbols = ["circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x", "pentagon"];
const looks = ["light", "dark"].map((name, at) => {
  const tint = (variable) => /\((.*),(.*)\)/.exec(sheet.getPropertyValue(`--${variable}`))[at + 1].trim();
  const [ink, soft, grid, card] = ["ink", "soft", "grid", "card"].map(tint);
  return { name, ink, soft, grid, card, hues: sweep.hues.map(tint) };
});
let onPaper = false;

function theme() {
  const set = document.documentElement.style.colorScheme;
  const dark = set ? set === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  return looks[dark && !onPaper ? 1 : 0];
}

const colourScale = sweep.ramp.map((colour, at) => [at / (sweep.ramp.length - 1), colour]);
/** A colour of the map for lines: the palest on white and the darkest on black are left out. */
const lineShade = (look, part) => sweep.ramp[Math.round((look.name === "dark" ? 0.16 + 0.84 * part : 0.85 * part) * (sweep.ramp.length - 1))];
const fade = (colour, alpha) => colour + Math.round(255 * alpha).toString(16).padStart(2, "0");

/** Colour, dash and marker of a curve. Many ordered numbers get an ordered colour. */
function styleOf(axis, at, look) {
  const many = axis?.numeric && axis.texts.length > 8;
  const colour = many ? lineShade(look, at / (axis.texts.length - 1)) : look.hues[at % look.hues.length];
  return { colour, dash: dashes[at % dashes.length], symbol: symbols[at % symbols.length] };
}

function axisLook(look, { title, ...more }) {
  return {
    color: look.soft, gridcolor: look.grid, linecolor: look.soft, tickcolor: look.soft, zeroline: false, showline: true,
    ticks: "outside", ticklen: 4, automargin: true, tickfont: { size: 12.5 }, ...more,
    title: { text: escapeText(title), standoff: 10, font: { size: 13.5, color: look.ink } },
  };
}

function layoutLook(look, width, height, more) {
  const font = { family: getComputedStyle(document.body).fontFamily, size: 13, color: look.ink };
  return {
    width, height, paper_bgcolor: look.card, plot_bgcolor: look.card, font, margin: { l: 64, r: 16, t: 14, b: 52 }, hovermode: "closest",
    hoverlabel: { bgcolor: look.ink, bordercolor: look.ink, font: { ...font, color: look.card }, align: "left" }, ...more,
    legend: { tracegroupgap: 4, bgcolor: "rgba(0,0,0,0)", ...(width < 620 ? { orientation: "h", yref: "container", y: 0.01, yanchor: "bottom", x: 0, xanchor: "left" } : {}), ...more.legend },
  };
}

const keyTitle = (look, text) => ({ title: { text: escapeText(text), font: { size: 13, color: look.soft } } });
const barLook = (look, title) => ({ title: { text: escapeText(title), side: "right", font: { size: 13, color: look.ink } }, thickness: 14, outlinewidth: 0,
  tickfont: { size: 12.5, color: look.soft }, nticks: 6 });

/** Ticks at the values that an axis has; round numbers where they are many. Words stand at 0, 1, 2, ... */
function ticksOf(axis) {
  const type = axis.log ? "log" : "linear";
  if (axis.binned || (axis.numeric && axis.texts.length > 16)) return { type, nticks: 8 };
  return { type, tickvals: axis.numbers ?? axis.texts.map((_, at) => at), ticktext: axis.ticks.map(escapeText) };
}

function spanOf(axis) {
  if (!axis.numeric) return [-0.5, axis.texts.length - 0.5];
  const [low, high] = axis.column.ends.map((end) => (axis.log ? Math.log10(end) : end));
  const room = (high - low) * 0.035 || 0.5;
  return [low - room, high + room];
}

// A processor that plays the graphics card is slower at this than plain drawing.
const hasGl = (() => {
  const gl = document.createElement("canvas").getContext("webgl", { failIfMajorPerformanceCaveat: true });
  const named = gl?.getExtension("WEBGL_debug_renderer_info");
  const played = named && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(named.UNMASKED_RENDERER_WEBGL));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return Boolean(gl) && !played;
})();

// --- figures ---

const figures = [];

/** `build(look, width)` gives data, layout, caption, label, and more: markup below; or only `none`: why there is nothing. */
function figure(id, build) {
  const card = document.getElementById(id);
  const one = { id, build, card, plot: card.querySelector(".plot") };
  card.querySelectorAll("[data-save]").forEach((button) => button.addEventListener("click", () => save(one, button.dataset.save)));
  figures.push(one);
}

function draw(one) {
  const width = onPaper ? 700 : Math.max(280, Math.floor(one.plot.getBoundingClientRect().width));
  const built = one.build(theme(), width);
  const empty = "none" in built;
  one.plot.hidden = empty;
  one.card.querySelector(".save").hidden = empty;
  one.card.querySelector(".caption").textContent = empty ? built.none : built.caption;
  one.card.querySelector(".more").replaceChildren(...(built.more ?? []));
  if (empty) {
    Plotly.purge(one.plot);
    return;
  }
  one.plot.setAttribute("aria-label", built.label);
  one.plot.style.height = `${built.layout.height}px`;
  Plotly.react(one.plot, built.data, built.layout, { displayModeBar: false, responsive: false });
}

function download(name, address) {
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
}

/** Drawn anew on white, as wide as a page of a paper. */
async function save(one, format) {
  const { data, layout } = one.build(looks[0], 760);
  const { width, height } = layout;
  const address = await Plotly.toImage({ data, layout }, { format, width, height, scale: format === "png" ? 3 : 1 });
  download(`${sweep.name}-${one.id}.${format}`, address);
}
