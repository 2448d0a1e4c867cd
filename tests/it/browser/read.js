// Reads a sweep's page once it is drawn: figures, captions, table.
window.look = () => {
  const figures = {};
  for (const plot of document.querySelectorAll(".plot")) {
    const card = plot.closest(".card");
    const axes = {};
    for (const [name, axis] of Object.entries(plot.layout ?? {})) {
      if (!/^[xy]axis\d*$/.test(name)) continue;
      axes[name] = { title: axis.title?.text ?? "", bare: axis.showticklabels === false || axis.visible === false };
    }
    figures[card.id] = {
      axes,
      empty: plot.hidden,
      drawn: plot.querySelectorAll("path, canvas").length,
      label: plot.getAttribute("aria-label"),
      caption: card.querySelector(".caption").textContent,
      links: [...card.querySelectorAll(".more a")].map((link) => link.getAttribute("href")),
      lines: card.querySelectorAll(".more tbody tr").length,
      traces: (plot.data ?? []).map(({ meta, type, x, y, z, zmin, zmax, name, customdata, error_x, error_y, text, dimensions }) => ({
        meta, type, x, y, z, zmin, zmax, name, customdata, error_x, error_y, text: type === "heatmap" ? text : undefined,
        bar: plot.data.find((trace) => trace.colorbar)?.colorbar.title.text, dimensions: dimensions?.map((one) => one.label),
      })),
    };
  }
  return {
    marks: performance.getEntriesByType("mark").map((mark) => `${mark.name} ${Math.round(mark.startTime)}`),
    ready: Number(document.documentElement.dataset.ready), figures, hash: location.hash,
    nodes: document.querySelectorAll("*").length,
    head: [...document.querySelectorAll("#table thead th")].map((cell) => cell.textContent),
    rows: [...document.querySelectorAll("#table tbody tr")].map((row) => [...row.cells].map((cell) => cell.textContent)),
    runs: [...document.querySelectorAll("#table tbody a")].map((link) => link.getAttribute("href")),
    found: document.getElementById("found").textContent,
    fits: document.querySelector("#rows .scroll").scrollWidth <= document.querySelector("#rows .scroll").clientWidth,
    unnamed: [...document.querySelectorAll("select, input, button")].filter((one) => !one.labels?.length && !one.textContent.trim() && !one.getAttribute("aria-label")).length,
  };
};
window.choose = (id, value) => {
  const select = document.getElementById(id);
  select.value = value;
  select.dispatchEvent(new Event("change"));
};
window.drawn = async () => {
  while (!document.documentElement.dataset.ready) await rest(10);
};
