"use strict";
// The map of the site: shapes in metres, x to the right and y up; marks are dragged, or moved by the arrow keys.
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const LOOK = {
    terrain: {stroke: "#b7a98c", width: 0.8}, obstacle: {stroke: "#6b4e16", width: 1.5, fill: "#d9c9a3"},
    exposed: {stroke: "#16365c", width: 1.5, fill: "#a9c4e0"}, round: {stroke: "#1d2733", width: 2},
    fragments: {stroke: "#a3301a", dash: "9 5"}, blast: {stroke: "#5b3a86", dash: "2 5"},
  };
  let view = null, data = null, host = null, svg = null, dragged = null, focused = "";
  let chosen = false;  // whether the user has chosen what is seen; else all is, whatever comes
  const make = (name, attributes, parent) => {
    const made = document.createElementNS(NS, name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    return parent.appendChild(made);
  };
  const named = (element, words) => { make("title", {}, element).textContent = words; };
  const scale = () => Math.min(svg.clientWidth, svg.clientHeight) / view.size;
  const place = point => [svg.clientWidth / 2 + (point[0] - view.x) * scale(), svg.clientHeight / 2 - (point[1] - view.y) * scale()];
  const there = event => {
    const box = svg.getBoundingClientRect();
    return [view.x + (event.clientX - box.left - box.width / 2) / scale(), view.y - (event.clientY - box.top - box.height / 2) / scale()];
  };
  function fit() {
    const seen = [[-40, -40], [40, 40], ...data.shapes.filter(one => one.kind !== "terrain").flatMap(one => one.points)];
    for (const {radius} of data.circles) for (const side of [-1, 1]) seen.push(data.origin.map(v => v + side * radius));
    const low = [0, 1].map(i => Math.min(...seen.map(p => p[i]))), high = [0, 1].map(i => Math.max(...seen.map(p => p[i])));
    view = {x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2, size: 1.1 * Math.max(high[0] - low[0], high[1] - low[1])};
    chosen = false;
  }
  function build() {
    host = document.getElementById("site-map");
    if (!host) return false;
    if (host.firstChild) return true;
    svg = make("svg", {role: "application", "aria-label": "Map of the site"}, host);
    const tools = host.appendChild(Object.assign(document.createElement("div"), {className: "tools"}));
    for (const [sign, words, act] of [["+", "Zoom in", () => { view.size /= 1.4; chosen = true; }], ["−", "Zoom out", () => { view.size *= 1.4; chosen = true; }], ["⤢", "Show all", fit]]) {
      const button = tools.appendChild(Object.assign(document.createElement("button"), {textContent: sign, type: "button"}));
      button.setAttribute("aria-label", words);
      button.addEventListener("click", () => { act(); draw(); });
    }
    host.appendChild(Object.assign(document.createElement("div"), {className: "readout"}));
    svg.addEventListener("wheel", event => {
      event.preventDefault();
      chosen = true;
      const before = there(event);
      view.size *= Math.exp(Math.sign(event.deltaY) * 0.18);
      const after = there(event);
      view.x += before[0] - after[0]; view.y += before[1] - after[1];
      draw();
    }, {passive: false});
    svg.addEventListener("pointerdown", event => {
      const mark = event.target.closest(".handle");
      chosen = true;
      const at = there(event), held = mark && data.handles[Number(mark.dataset.mark)].at;
      dragged = mark ? {mark: Number(mark.dataset.mark), off: [held[0] - at[0], held[1] - at[1]]} : {from: at};
      svg.setPointerCapture(event.pointerId);
      if (mark) { focused = mark.dataset.path; mark.focus(); }
    });
    svg.addEventListener("pointermove", event => {
      const at = there(event);
      readout(at);
      if (!dragged) return;
      if (dragged.from) { view.x += dragged.from[0] - at[0]; view.y += dragged.from[1] - at[1]; }
      else { data.handles[dragged.mark].at = [at[0] + dragged.off[0], at[1] + dragged.off[1]]; dragged.moved = true; }
      draw();
    });
    svg.addEventListener("pointerup", () => {
      if (dragged?.moved) send(data.handles[dragged.mark]);
      dragged = null;
    });
    svg.addEventListener("pointercancel", () => { dragged = null; });
    svg.addEventListener("keydown", event => {
      const mark = event.target.closest(".handle");
      const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
      if (!mark || !way) return;
      event.preventDefault();
      chosen = true;
      const handle = data.handles[Number(mark.dataset.mark)], step = event.shiftKey ? 10 : 1;
      handle.at = [handle.at[0] + step * way[0], handle.at[1] + step * way[1]];
      focused = mark.dataset.path;
      readout(handle.at);
      draw();
      clearTimeout(handle.wait);
      handle.wait = setTimeout(() => send(handle), 350);
    });
    new ResizeObserver(draw).observe(host);
    return true;
  }
  const send = handle => emitEvent("moved", [handle.path, handle.at[0], handle.at[1]]);
  function readout(at) {
    const away = [at[0] - data.origin[0], at[1] - data.origin[1]];
    let turn = Math.atan2(away[1], away[0]) * 180 / Math.PI, word = "azimuth";
    if (data.north !== null) { turn = data.north - turn; word = "bearing"; }
    host.querySelector(".readout").textContent =
      `x ${at[0].toFixed(1)} m, y ${at[1].toFixed(1)} m · ${Math.hypot(...away).toFixed(1)} m, ${word} ${(((turn % 360) + 360) % 360).toFixed(1)}°`;
  }
  function draw() {
    if (!data || !host || !svg.clientWidth) return;
    if (!chosen) fit();
    svg.replaceChildren();
    const k = scale();
    const path = (points, closed) => "M" + points.map(p => place(p).map(v => v.toFixed(1)).join(" ")).join("L") + (closed ? "Z" : "");
    for (const one of data.circles) {
      const [x, y] = place(data.origin), look = LOOK[one.kind] || LOOK.fragments;
      named(make("circle", {cx: x, cy: y, r: one.radius * k, fill: "none", stroke: look.stroke, "stroke-width": 1.6, "stroke-dasharray": look.dash}, svg), one.name);
      const label = make("text", {x, y: y - one.radius * k - 4, "font-size": 11, fill: look.stroke, "text-anchor": "middle", class: "halo"}, svg);
      label.textContent = one.name;
      if (label.getComputedTextLength() > Math.min(svg.clientWidth, 2 * one.radius * k)) label.textContent = one.short;
    }
    let labelled = null;
    for (const one of data.shapes) {
      const look = LOOK[one.kind];
      if (one.points.length === 1) {
        const [x, y] = place(one.points[0]);
        named(make("path", {d: `M${x - 6} ${y}H${x + 6}M${x} ${y - 6}V${y + 6}`, stroke: look.stroke, "stroke-width": 2}, svg), one.name);
      } else {
        named(make("path", {d: path(one.points, one.closed), fill: one.closed && look.fill ? look.fill : "none", "fill-opacity": 0.55, stroke: look.stroke,
          "stroke-width": look.width}, svg), one.name);
      }
      if (one.kind === "terrain" && one.points.length < 8) continue;
      const middle = one.kind === "terrain" ? one.points[Math.floor(one.points.length / 2)] : [0, 1].map(i => one.points.reduce((s, p) => s + p[i], 0) / one.points.length);
      const [x, y] = place(middle);
      if (one.kind === "round") {  // the names of a stack would lie over each other
        if (labelled && Math.hypot(x - labelled[0], y - labelled[1]) < 60) continue;
        labelled = [x, y];
      }
      const others = one.kind === "round" ? data.shapes.filter(other => other.kind === "round" && Math.hypot(...place(other.points[0]).map((v, i) => v - [x, y][i])) < 60).length - 1 : 0;
      const text = make("text", {x, y: y - 9, "font-size": one.kind === "terrain" ? 9.5 : 12, fill: look.stroke, "text-anchor": "middle", class: "halo"}, svg);
      text.textContent = others ? `${one.name} + ${others}` : one.name;
    }
    data.handles.forEach((one, index) => {
      const [x, y] = place(one.at), key = one.path.join(".");
      const mark = make("circle", {class: "handle", cx: x, cy: y, r: 7, fill: one.table === "exposed" ? "#16365c" : "#6b4e16", stroke: "#fff", "stroke-width": 2,
        tabindex: 0, role: "button", "aria-label": `${one.name}: ${one.at.map(v => v.toFixed(1)).join(", ")} m`, "data-mark": index, "data-path": key}, svg);
      named(mark, one.name);
      if (key === focused && document.activeElement !== mark && (!document.activeElement || document.activeElement === document.body)) mark.focus();
    });
    const bar = [1, 2, 5].flatMap(v => [0, 1, 2, 3, 4].map(p => v * 10 ** p)).sort((a, b) => a - b).filter(v => v * k < 0.3 * svg.clientWidth).pop() || 1;
    const foot = svg.clientHeight - 14;
    make("path", {d: `M12 ${foot - 5}v5h${bar * k}v-5`, fill: "none", stroke: "#1d2733", "stroke-width": 1.5}, svg);
    make("text", {x: 18 + bar * k, y: foot, "font-size": 11, fill: "#1d2733", style: "text-anchor:start"}, svg).textContent = `${bar} m`;
    if (data.north !== null) {
      const g = make("g", {transform: `translate(${svg.clientWidth - 28} 34) rotate(${90 - data.north})`, "aria-label": "North"}, svg);
      make("path", {d: "M0 18V-10M-5-4L0-15L5-4Z", stroke: "#1d2733", "stroke-width": 2, fill: "#1d2733"}, g);
      make("text", {x: 0, y: -17, "font-size": 12, "font-weight": 700, fill: "#1d2733", "text-anchor": "middle"}, g).textContent = "N";
    }
  }
  window.fragfieldMap = given => {
    data = given;
    if (!build()) return;
    draw();
  };
})();
