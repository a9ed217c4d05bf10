// SPDX-License-Identifier: Apache-2.0
// What leads from one thing to another: moments in tables, the toolbar, keys.
"use strict";
(() => {
  if (charts.all.length === 0) return;
  const toolbar = document.getElementById("zoom");
  toolbar.innerHTML =
    '<span id="zoom-range"></span>' +
    '<button type="button" data-pan="-0.5" aria-label="Earlier" title="earlier (arrow left)">←</button>' +
    '<button type="button" data-pan="0.5" aria-label="Later" title="later (arrow right)">→</button>' +
    '<button type="button" data-by="0.5" aria-label="Closer" title="closer (+)">+</button>' +
    '<button type="button" data-by="2" aria-label="Farther" title="farther (−)">−</button>' +
    '<button type="button" data-reset title="the whole log (0)">whole log</button>' +
    '<button type="button" data-back hidden>back to the table</button>';
  const back = toolbar.querySelector("[data-back]");
  toolbar.hidden = false;
  let origin = null;  // the button that was followed

  const tell = () => {
    const [from, to] = charts.shown();
    toolbar.querySelector("#zoom-range").textContent =
      from.toFixed(charts.digits()) + " to " + to.toFixed(charts.digits()) + " s";
  };
  charts.onZoom(tell);
  tell();

  const pan = (share) => {
    const [from, to] = charts.shown(), step = share * (to - from);
    charts.zoom(from + step, to + step);
  };
  const by = (factor) => {
    const [from, to] = charts.shown(), middle = 0.5 * (from + to), half = 0.5 * factor * (to - from);
    charts.zoom(middle - half, middle + half);
  };
  const follow = (button) => {
    const from = Number(button.dataset.from), to = Number(button.dataset.to), [begin, end] = charts.whole();
    const margin = Math.max(0.5 * (to - from), Math.min(1, 0.1 * (end - begin)));
    charts.zoom(from - margin, to + margin);
    const signals = document.querySelector("#signals figure.chart");
    (signals || charts.all[0].figure).scrollIntoView({block: "start"});
    origin = button;
    back.hidden = false;
  };

  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if ("reset" in button.dataset) charts.reset();
    else if (button.dataset.pan) pan(Number(button.dataset.pan));
    else if (button.dataset.by) by(Number(button.dataset.by));
    else if (button.dataset.from) follow(button);
    else if ("back" in button.dataset) {
      origin.scrollIntoView({block: "center"});
      origin.focus({preventScroll: true});
      back.hidden = true;
    }
  });

  const keys = {
    ArrowLeft: () => pan(-0.25), ArrowRight: () => pan(0.25), "+": () => by(0.5), "=": () => by(0.5), "-": () => by(2),
    "0": () => charts.reset(), Home: () => charts.reset(),
  };
  for (const {plot, head} of charts.all) {
    plot.tabIndex = 0;
    plot.setAttribute("role", "group");
    plot.setAttribute("aria-label", head.title + ": arrow keys move, plus and minus zoom, 0 shows the whole log");
    plot.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || !keys[event.key]) return;
      keys[event.key]();
      event.preventDefault();
    });
  }
})();
