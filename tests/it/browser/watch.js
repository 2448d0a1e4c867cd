// Runs before everything else on a page under test: writes down what goes wrong and what is asked of the outside.
window.probe = { errors: [], requests: [] };
{
  const note = (list) => (text) => probe[list].push(String(text));
  const wrong = note("errors");
  addEventListener("error", (event) => wrong(event.message || `${event.target.tagName} did not load`), true);
  addEventListener("unhandledrejection", (event) => wrong(event.reason));
  addEventListener("securitypolicyviolation", (event) => note("requests")(`${event.violatedDirective} ${event.blockedURI}`));
  for (const name of ["error", "warn"]) console[name] = (...words) => wrong(words.join(" "));
  // A page asks for a real graphics card; a test may give it the processor instead.
  window.anyGl = () => {
    const given = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, wishes) {
      return given.call(this, kind, wishes && { ...wishes, failIfMajorPerformanceCaveat: false });
    };
    const asked = WebGLRenderingContext.prototype.getParameter;
    WebGLRenderingContext.prototype.getParameter = function (what) {
      return what === 0x9246 ? "a card" : asked.call(this, what);
    };
  };
  // A page counts as loading while a frame in it loads: frame after frame, until the probe is done.
  const hold = (before) => {
    const frame = document.createElement("iframe");
    frame.srcdoc = "<p></p>";
    frame.hidden = true;
    frame.onload = () => {
      // The next before this one goes, or the page would have loaded.
      if (!window.probe.done) hold(frame);
    };
    document.documentElement.append(frame);
    before?.remove();
  };
  window.finish = (report) => {
    for (const one of performance.getEntriesByType("resource")) note("requests")(one.name);
    const all = JSON.stringify({ ...probe, ...report });
    // a page in a narrow frame tells the page around it
    if (parent !== window) parent.postMessage({ all }, "*");
    else answer(all);
    probe.done = true;
  };
  window.answer = (all) => {
    const pre = document.createElement("pre");
    pre.id = "probe";
    pre.textContent = all.replace(/[<>&\u00a0]/g, (one) => `\\u${one.charCodeAt(0).toString(16).padStart(4, "0")}`);
    document.documentElement.replaceChildren(pre);
    probe.done = true;
  };
  window.rest = (milliseconds) => new Promise((go) => setTimeout(go, milliseconds));
  document.addEventListener("DOMContentLoaded", () => hold());
}
