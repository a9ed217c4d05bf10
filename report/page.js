// SPDX-License-Identifier: Apache-2.0
// Draws every figure.chart of the page with uPlot. All charts share one time axis: zooming one zooms all.
"use strict";
(() => {
  const root = document.documentElement;
  const fail = (text) => { root.dataset.errors = (root.dataset.errors || "") + text + "\n"; };
  window.onerror = (message, file, line) => fail(message + " (line " + line + ")");
  window.onunhandledrejection = (event) => fail(String(event.reason));

  const figures = [...document.querySelectorAll("figure.chart")].map((figure) => ({
    plot: figure.querySelector(".plot"),
    data: JSON.parse(figure.querySelector("script").textContent),
    u: null,
  })).filter((f) => f.data.t.length > 0);
  const colour = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const firsts = figures.map((f) => f.data.t[0]);
  const lasts = figures.map((f) => f.data.t[f.data.t.length - 1]);
  let begin = Math.min(...firsts), end = Math.max(...lasts);
  if (!(end > begin)) { begin -= 0.5; end += 0.5; }
  const shortest = (end - begin) * 1e-6;
  let shown = [begin, end];

  const toolbar = document.getElementById("zoom");
  const digits = () => Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(shown[1] - shown[0]))));
  const zoom = (from, to) => {
    const width = Math.max(shortest, Math.min(to - from, end - begin));
    from = Math.max(begin, Math.min(from, end - width));
    shown = [from, from + width];
    figures.forEach((f) => f.u && f.u.setScale("x", {min: shown[0], max: shown[1]}));
    toolbar.hidden = width >= (end - begin) * (1 - 1e-9);
    document.getElementById("zoom-range").textContent =
      shown[0].toFixed(digits()) + " to " + shown[1].toFixed(digits()) + " s";
  };
  const reset = () => zoom(begin, end);

  const looks = {
    first: {width: 1.3, dash: []},
    second: {width: 1.3, dash: [7, 3]},
    third: {width: 1.5, dash: [2, 3]},
    bound: {width: 1, dash: []},
  };
  const value = (u, x) => x == null ? "–" : Number(x.toPrecision(4)).toString().replace("-", "−");

  const paintMarks = (data) => (u) => {
    const marks = data.marks.slice().sort((a, b) => a[0] - b[0]);
    const {ctx} = u, box = u.bbox, ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(box.left, box.top, box.width, box.height);
    ctx.clip();
    ctx.font = 11 * ratio + "px sans-serif";
    ctx.textBaseline = "top";
    let free = -1e9;
    for (const [from, to, label] of marks) {
      const left = u.valToPos(from, "x", true), width = Math.max(u.valToPos(to, "x", true) - left, 2 * ratio);
      if (left > box.left + box.width || left + width < box.left) continue;
      ctx.fillStyle = colour("mark");
      ctx.fillRect(left, box.top, width, box.height);
      ctx.fillStyle = colour("mark-edge");
      ctx.fillRect(left, box.top, ratio, box.height);
      const at = Math.max(left, box.left) + 4 * ratio;
      if (label && at > free) {
        ctx.fillText(label, at, box.top + 3 * ratio);
        free = at + ctx.measureText(label).width + 4 * ratio;
      }
    }
    ctx.restore();
  };

  // Drag zooms, Shift and drag pans, double click shows the whole log.
  const bindings = {
    mousedown: (u, target, handler) => (event) => {
      if (!event.shiftKey) return handler(event);
      const start = shown.slice(), x = event.clientX, scale = (shown[1] - shown[0]) / u.over.clientWidth;
      const move = (e) => zoom(start[0] - (e.clientX - x) * scale, start[1] - (e.clientX - x) * scale);
      const up = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", up); };
      addEventListener("mousemove", move);
      addEventListener("mouseup", up);
      event.preventDefault();
      return null;
    },
    dblclick: () => () => { reset(); return null; },
  };

  const axis = () => ({
    stroke: colour("soft"), grid: {stroke: colour("rule"), width: 1}, ticks: {stroke: colour("rule"), width: 1},
    font: "11px sans-serif",
  });

  const draw = (f, width) => {
    if (f.u) f.u.destroy();
    const {data} = f;
    f.u = new uPlot({
      width, height: data.series.length > 3 ? 260 : 220,
      scales: {x: {time: false, min: shown[0], max: shown[1], auto: false}},
      cursor: {bind: bindings, drag: {x: true, y: false, setScale: false}, sync: {key: "page", setSeries: false}},
      series: [{label: "t", value: (u, x) => x == null ? "–" : x.toFixed(digits() + 1) + " s"}].concat(
        data.series.map((s) => ({
          label: s.label, stroke: colour(s.line), width: looks[s.line].width, dash: looks[s.line].dash,
          points: {show: false}, value, spanGaps: false,
        }))),
      bands: data.bands.map(([upper, lower, pale]) => ({
        series: [upper + 1, lower + 1], fill: colour(pale ? "tolerance" : "spread"),
      })),
      axes: [Object.assign(axis(), {label: "time, s", labelSize: 18, labelFont: "11px sans-serif", size: 32}),
             Object.assign(axis(), {size: 62, values: (u, ticks) => ticks.map((x) => value(u, x))})],
      hooks: {
        drawClear: [paintMarks(data)],
        setSelect: [(u) => {
          const {left, width: wide} = u.select;
          if (wide > 2) zoom(u.posToVal(left, "x"), u.posToVal(left + wide, "x"));
          u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
        }],
      },
    }, [data.t, ...data.series.map((s) => s.y)], f.plot);
  };

  const drawAll = (width) => {
    figures.forEach((f) => draw(f, width || f.plot.clientWidth));
    root.dataset.charts = String(figures.length);
  };
  drawAll();

  let pending = 0;
  addEventListener("resize", () => {
    cancelAnimationFrame(pending);
    pending = requestAnimationFrame(() => figures.forEach((f) => f.u.setSize({width: f.plot.clientWidth, height: f.u.height})));
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawAll());
  addEventListener("beforeprint", () => { root.dataset.print = "1"; drawAll(680); });
  addEventListener("afterprint", () => { delete root.dataset.print; drawAll(); });

  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if ("reset" in button.dataset) reset();
    if (button.dataset.pan) {
      const step = Number(button.dataset.pan) * (shown[1] - shown[0]);
      zoom(shown[0] + step, shown[1] + step);
    }
    if (button.dataset.from) {
      const from = Number(button.dataset.from), to = Number(button.dataset.to);
      const margin = Math.max(0.5 * (to - from), Math.min(1, 0.1 * (end - begin)));
      zoom(from - margin, to + margin);
      const chart = document.querySelector("figure.chart");
      if (chart) chart.scrollIntoView({block: "center"});
    }
  });
  root.dataset.ready = "1";
})();
