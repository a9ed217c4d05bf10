// SPDX-License-Identifier: Apache-2.0
// Draws every figure.chart of the page with uPlot, those in view first. All charts share one time axis.
"use strict";
const charts = (() => {
  const root = document.documentElement;
  const fail = (text) => { root.dataset.errors = (root.dataset.errors || "") + text + "\n"; };
  window.onerror = (message, file, line) => fail(message + " (line " + line + ")");
  window.onunhandledrejection = (event) => fail(String(event.reason));

  const most = 2000;  // bins of a series in one drawing
  const colour = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const looks = {
    first: {width: 1.3, dash: [], marker: "solid"},
    second: {width: 1.3, dash: [7, 3], marker: "dashed"},
    third: {width: 1.5, dash: [2, 3], marker: "dotted"},
    bound: {width: 1, dash: [], marker: "solid"},
  };
  const number = (x) => x == null ? "–" : Number(x.toPrecision(4)).toString().replace("-", "−");

  const clocks = {};
  for (const element of document.querySelectorAll(".clock")) {
    const [head, packed] = element.children;
    clocks[element.id] = {head: JSON.parse(head.textContent), packed, times: null};
  }
  const timesOf = (clock) => clock.times = clock.times || series.unpackTimes(clock.head, clock.packed.textContent);

  const all = [...document.querySelectorAll("figure.chart")].map((figure) => {
    const [head, ...packed] = figure.querySelectorAll("script");
    const chart = {figure, plot: figure.querySelector(".plot"), head: JSON.parse(head.textContent), packed,
                   u: null, seen: false, stale: false};
    chart.clock = clocks[chart.head.clock];
    return chart;
  }).filter((chart) => chart.clock);

  let begin = Infinity, end = -Infinity;
  for (const {head} of Object.values(clocks)) {
    begin = Math.min(begin, head.start);
    end = Math.max(end, head.end);
  }
  if (!(end > begin)) { begin -= 0.5; end += 0.5; }
  const shortest = (end - begin) * 1e-7;
  let shown = [begin, end];
  const digits = () => Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(shown[1] - shown[0]))));

  const paintMarks = (marks) => (u) => {
    const {ctx} = u, box = u.bbox, ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(box.left, box.top, box.width, box.height);
    ctx.clip();
    ctx.font = 11 * ratio + "px sans-serif";
    ctx.textAlign = "left";
    const free = [-1e9, -1e9];  // of the labels at the top, and of those at the time axis
    for (const [from, to, label, pin] of marks) {
      const left = u.valToPos(from, "x", true), width = Math.max(u.valToPos(to, "x", true) - left, 2 * ratio);
      if (left > box.left + box.width || left + width < box.left) continue;
      const foot = box.top + box.height;
      let at = Math.max(left, box.left) + 4 * ratio;
      if (pin) {
        ctx.fillStyle = colour("ink");
        ctx.beginPath();
        ctx.moveTo(left, foot - 9 * ratio);
        ctx.lineTo(left - 5 * ratio, foot);
        ctx.lineTo(left + 5 * ratio, foot);
        ctx.fill();
        ctx.textBaseline = "bottom";
        at += 4 * ratio;
      } else {
        ctx.fillStyle = colour("mark");
        ctx.fillRect(left, box.top, width, box.height);
        ctx.fillStyle = colour("mark-edge");
        ctx.fillRect(left, box.top, ratio, box.height);
        ctx.textBaseline = "top";
      }
      if (label && at > free[pin]) {
        ctx.fillText(label, at, pin ? foot - ratio : box.top + 3 * ratio);
        free[pin] = at + ctx.measureText(label).width + 4 * ratio;
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

  const look = (chart) => series.view(chart.times, chart.lines, shown[0], shown[1], most).data;

  const draw = (chart, width) => {
    if (chart.u) chart.u.destroy();
    const {head} = chart;
    chart.stale = false;
    chart.u = new uPlot({
      width: width || chart.plot.clientWidth, height: 230,
      scales: {x: {time: false, min: shown[0], max: shown[1], auto: false}},
      cursor: {bind: bindings, drag: {x: true, y: false, setScale: false}, sync: {key: "page", setSeries: false}},
      legend: {markers: {dash: (u, i) => i ? looks[head.series[i - 1].line].marker : "solid"}},
      series: [{label: "t", value: (u, x) => x == null ? "–" : x.toFixed(digits() + 1) + " s"}].concat(
        head.series.map((s) => ({
          label: s.label, stroke: colour(s.line), width: looks[s.line].width, dash: looks[s.line].dash,
          points: s.line === "bound" ? {show: false} : {size: 4}, value: (u, x) => number(x), spanGaps: false,
        }))),
      bands: head.bands.map(([upper, lower, pale]) => ({
        series: [upper + 1, lower + 1], fill: colour(pale ? "tolerance" : "spread"),
      })),
      axes: [Object.assign(axis(), {label: "time, s", labelSize: 18, labelFont: "11px sans-serif", size: 32}),
             Object.assign(axis(), {size: 62, values: (u, ticks) => ticks.map(number)})],
      hooks: {
        drawClear: [paintMarks(head.marks.slice().sort((a, b) => a[0] - b[0]))],
        setSelect: [(u) => {
          const {left, width: wide} = u.select;
          if (wide > 2) zoom(u.posToVal(left, "x"), u.posToVal(left + wide, "x"));
          u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
        }],
      },
    }, look(chart), chart.plot);
  };

  const refresh = (chart) => {
    chart.stale = false;
    chart.u.batch(() => {
      chart.u.setData(look(chart), false);
      chart.u.setScale("x", {min: shown[0], max: shown[1]});
    });
  };

  // At once, but not more often than every 16 ms.
  let pending = 0, last = -1e9;
  const refreshSeen = () => {
    clearTimeout(pending);
    const wait = last + 16 - performance.now();
    if (wait > 0) {
      pending = setTimeout(refreshSeen, wait);
      return;
    }
    all.forEach((chart) => { if (chart.stale && chart.seen) refresh(chart); });
    last = performance.now();
  };
  const listeners = [];
  const zoom = (from, to) => {
    const width = Math.max(shortest, Math.min(to - from, end - begin));
    from = Math.max(begin, Math.min(from, end - width));
    shown = [from, from + width];
    all.forEach((chart) => { chart.stale = chart.u !== null; });
    listeners.forEach((tell) => tell());
    refreshSeen();
  };
  const reset = () => zoom(begin, end);

  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      const chart = all.find((c) => c.plot === entry.target);
      chart.seen = entry.isIntersecting;
      if (chart.seen && chart.stale) refresh(chart);
    }
  }, {rootMargin: "200px"});

  const unpack = async (chart) => {
    chart.times = await timesOf(chart.clock);
    chart.lines = await Promise.all(chart.head.series.map((s, i) => series.unpack(s, chart.packed[i].textContent)));
  };
  const inWindow = (chart) => {
    const {top, bottom} = chart.plot.getBoundingClientRect();
    return bottom > 0 && top < innerHeight;
  };

  // One chart after the other, those in the window first. data-opened: ms from navigation to the first of them drawn and
  // none in the window missing.
  const drawAll = async () => {
    const waiting = all.slice();
    while (waiting.length > 0) {
      const [chart] = waiting.splice(Math.max(0, waiting.findIndex(inWindow)), 1);
      await unpack(chart);
      draw(chart);
      watch.observe(chart.plot);
      if (!root.dataset.opened && !waiting.some(inWindow)) root.dataset.opened = performance.now().toFixed(0);
      root.dataset.charts = String(all.length - waiting.length);
      await new Promise((resume) => setTimeout(resume));
    }
    root.dataset.ready = "1";
  };

  const drawn = () => all.filter((chart) => chart.u);
  const fit = () => drawn().forEach((c) => c.u.setSize({width: c.plot.clientWidth, height: c.u.height}));
  let resizing = 0;
  addEventListener("resize", () => { clearTimeout(resizing); resizing = setTimeout(fit, 50); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawn().forEach((c) => draw(c)));
  addEventListener("beforeprint", () => { root.dataset.print = "1"; drawn().forEach((c) => draw(c, 680)); });
  addEventListener("afterprint", () => { delete root.dataset.print; drawn().forEach((c) => draw(c)); });

  if (typeof DecompressionStream === "undefined") {
    for (const {plot} of all) {
      plot.textContent = "This browser is too old to draw the charts: they need Chromium 80, Firefox 113, Safari 16.4 or " +
        "later. All words and tables are here.";
      plot.className = "plot warning";
    }
    root.dataset.ready = "1";
  } else {
    drawAll();
  }
  return {all, zoom, reset, digits, shown: () => shown, whole: () => [begin, end], onZoom: (tell) => listeners.push(tell)};
})();
