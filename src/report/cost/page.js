"use strict";
(() => {
  const { techniques: known, points, budget_ms } = JSON.parse(document.getElementById("cost-data").textContent);
  const SVG = "http://www.w3.org/2000/svg";
  const byId = (id) => document.getElementById(id);
  /** An element with attributes; `text` is its text, never markup. */
  const make = (name, attributes = {}, text = "", namespace = null) => {
    const element = namespace ? document.createElementNS(namespace, name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== "") element.textContent = text;
    return element;
  };
  const draw = (name, attributes, text) => make(name, attributes, text, SVG);
  const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
  /** Three digits that count. */
  const number = (x) => (x >= 1e-3 && x < 1e6 ? String(Number(x.toPrecision(3))) : x.toExponential(1));

  sortTables();
  if (points.length === 0) return;

  const present = new Set(points.map((point) => point.technique));
  const techniques = known.filter((technique) => present.has(technique));
  /** A place among all techniques there are, shown or not, so that each looks the same on every page; those beyond the sixth share one. */
  const LAST_LOOK = 5;
  const look = (technique) => Math.min(known.indexOf(technique), LAST_LOOK);
  const color = (technique) => `var(--tech-${look(technique)})`;
  /** A shape of its own for each technique, so that colour is not needed. */
  const SHAPES = [
    "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0Z", "M-4.5 -4.5h9v9h-9Z", "M0 -6L5.5 4.5H-5.5Z",
    "M0 -6.5L6 0L0 6.5L-6 0Z", "M0 6L5.5 -4.5H-5.5Z", "M-5 -2h10v4h-10Z",
  ];
  const shape = (technique) => SHAPES[look(technique)];
  for (const technique of techniques) {
    const entry = make("span", { style: `--color: ${color(technique)}` });
    const icon = draw("svg", { viewBox: "-7 -7 14 14", "aria-hidden": "true" });
    icon.append(draw("path", { d: shape(technique) }));
    entry.append(icon, technique);
    byId("legend").append(entry);
  }

  /** The points that no other beats, by rising time. */
  function front(candidates, metric) {
    let least = Infinity;
    return [...candidates]
      .sort((a, b) => a.ms - b.ms || a[metric] - b[metric])
      .filter((point) => point[metric] < least && ((least = point[metric]), true));
  }

  /** The time at which a front reaches an error, straight between its points on logarithmic axes; null beyond its ends. */
  function timeAt(line, metric, error) {
    for (let i = 1; i < line.length; i += 1) {
      const [a, b] = [line[i - 1], line[i]];
      const share = Math.log(a[metric] / error) / Math.log(a[metric] / b[metric]);
      if (share >= 0 && share <= 1) return Math.exp(Math.log(a.ms) + share * Math.log(b.ms / a.ms));
    }
    return null;
  }

  /** 1, 2 and 5 times the powers of ten within the range. */
  function roundValues(low, high, digits = [1, 2, 5]) {
    const values = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += 1) {
      for (const digit of digits) {
        const value = digit * 10 ** power;
        if (value >= low * 0.999 && value <= high * 1.001) values.push(value);
      }
    }
    return values;
  }

  const NAMES = {
    relmse_fovea: "foveal error (relative MSE)", mse_fovea: "MSE in the fovea, (W/(m² sr))²",
    mse_transition: "MSE in the transition, (W/(m² sr))²", mse_periphery: "MSE in the periphery, (W/(m² sr))²",
  };
  const [LEFT, RIGHT, TOP, BOTTOM, HEIGHT] = [62, 16, 14, 44, 460];
  /** Pixels of a plot below which levels are not told in full. */
  const NARROW = 640;
  const chart = byId("chart");
  let focused = null;

  function plot() {
    const metric = byId("metric").value;
    const shown = points.filter((point) => point[metric] > 0).sort((a, b) => a.ms - b.ms);
    const width = chart.clientWidth || 900;
    chart.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    chart.replaceChildren();
    if (shown.length === 0) {
      chart.append(draw("text", { x: LEFT, y: HEIGHT / 2 }, "no pixel of the picture lies there"));
      return;
    }
    const times = shown.flatMap((point) => [...point.quartiles_ms, point.ms]).concat(budget_ms ?? []);
    const errors = shown.map((point) => point[metric]);
    const range = (values) => [Math.min(...values) / 1.35, Math.max(...values) * 1.35];
    const [[t0, t1], [e0, e1]] = [range(times), range(errors)];
    const x = (ms) => LEFT + (Math.log(ms / t0) / Math.log(t1 / t0)) * (width - LEFT - RIGHT);
    const y = (error) => HEIGHT - BOTTOM - (Math.log(error / e0) / Math.log(e1 / e0)) * (HEIGHT - TOP - BOTTOM);

    const ticks = (low, high, most) => (high / low > most ? roundValues(low, high, [1]) : roundValues(low, high));
    for (const ms of ticks(t0, t1, 3000)) {
      chart.append(draw("path", { class: "grid", d: `M${x(ms)} ${TOP}V${HEIGHT - BOTTOM}` }));
      chart.append(draw("text", { x: x(ms), y: HEIGHT - BOTTOM + 17, "text-anchor": "middle" }, number(ms)));
    }
    for (const error of ticks(e0, e1, 300)) {
      chart.append(draw("path", { class: "grid", d: `M${LEFT} ${y(error)}H${width - RIGHT}` }));
      chart.append(draw("text", { x: LEFT - 8, y: y(error) + 4, "text-anchor": "end" }, number(error)));
    }
    chart.append(draw("path", { class: "axis", d: `M${LEFT} ${TOP}V${HEIGHT - BOTTOM}H${width - RIGHT}` }));
    chart.append(draw("text", { class: "name", x: width - RIGHT, y: HEIGHT - 8, "text-anchor": "end" }, "time of a frame, ms  (← faster)"));
    chart.append(draw("text", { class: "name", transform: `translate(14 ${TOP}) rotate(-90)`, "text-anchor": "end" }, `${NAMES[metric]}  (← more accurate)`));

    if (budget_ms) {
      chart.append(draw("path", { class: "budget", d: `M${x(budget_ms)} ${TOP}V${HEIGHT - BOTTOM}` }));
      chart.append(draw("text", { class: "halo", x: x(budget_ms) + 5, y: HEIGHT - BOTTOM - 7 }, `budget ${number(budget_ms)} ms`));
    }
    const line = front(shown, metric);
    chart.append(draw("path", { class: "front", d: line.map((point, i) => `${i ? "L" : "M"}${x(point.ms)} ${y(point[metric])}`).join("") }));
    shown.forEach((point) => chart.append(mark(point, metric, x, y, line.includes(point), [TOP, HEIGHT - BOTTOM])));
    levels(shown, metric, x, y, width);
    const marks = [...chart.querySelectorAll(".mark")];
    marks[clamp(focused ?? 0, 0, marks.length - 1)].setAttribute("tabindex", "0");
  }

  /** Levels of one error, with the time that each technique needs for it: three at most, where most techniques have been. */
  function levels(shown, metric, x, y, width) {
    const fronts = techniques.map((technique) => [technique, front(shown.filter((point) => point.technique === technique), metric)]);
    const errors = shown.map((point) => point[metric]);
    const crossed = roundValues(Math.min(...errors), Math.max(...errors))
      .map((error) => ({ error, at: fronts.map(([technique, line]) => [technique, timeAt(line, metric, error)]).filter(([, ms]) => ms) }))
      .filter(({ at }) => at.length > 0);
    const most = Math.max(0, ...crossed.map(({ at }) => at.length));
    const best = crossed.filter(({ at }) => at.length === most);
    const picked = best.length <= 3 ? best : [best[0], best[best.length >> 1], best.at(-1)];
    for (const { error, at } of picked) {
      chart.append(draw("path", { class: "level", d: `M${LEFT} ${y(error)}H${width - RIGHT}` }));
      for (const [technique, ms] of at) {
        chart.append(draw("path", { class: "crossing", style: `--color: ${color(technique)}`, d: `M${x(ms)} ${y(error) - 7}v14` }));
      }
      const words = at.sort((a, b) => a[1] - b[1]).map(([technique, ms]) => `${technique} ${number(ms)} ms`);
      // A narrow plot has no room for more than the level.
      const text = width < NARROW ? `error ${number(error)}` : `error ${number(error)}: ${words.join(", ")}`;
      // At the end where fewer marks stand in the way.
      const reach = 6.6 * text.length;
      const near = shown.filter((point) => Math.abs(y(point[metric]) - y(error) + 10) < 14).map((point) => x(point.ms));
      const isLeft = near.filter((at_) => at_ < LEFT + reach).length < near.filter((at_) => at_ > width - RIGHT - reach).length;
      const place = isLeft ? { x: LEFT + 6 } : { x: width - RIGHT - 4, "text-anchor": "end" };
      chart.append(draw("text", { class: "halo name", y: y(error) - 6, ...place }, text));
    }
  }

  function mark(point, metric, x, y, on, [top, bottom]) {
    const error = point[metric];
    const group = draw("g", {
      class: on ? "mark on" : "mark", style: `--color: ${color(point.technique)}`, tabindex: "-1", role: "img",
      "aria-label": `${point.label}: ${number(point.ms)} ms, error ${number(error)}`,
    });
    const [left, right] = point.quartiles_ms;
    const bars = [`M${x(left)} ${y(error)}H${x(right)}`];
    if (metric === "relmse_fovea" && point.relmse_fovea_se > 0) {
      const low = Math.max(error - point.relmse_fovea_se, error * 0.05);
      bars.push(`M${x(point.ms)} ${clamp(y(error + point.relmse_fovea_se), top, bottom)}V${clamp(y(low), top, bottom)}`);
    }
    group.append(draw("path", { class: "bar", d: bars.join("") }));
    group.append(draw("path", { class: "shape", d: shape(point.technique), transform: `translate(${x(point.ms)} ${y(error)})` }));
    if (point.is_chosen) group.append(draw("circle", { class: "chosen", cx: x(point.ms), cy: y(error), r: 10 }));
    group.addEventListener("pointerenter", () => tell(point, metric, x(point.ms), y(error)));
    group.addEventListener("pointerleave", () => (byId("tip").hidden = true));
    group.addEventListener("focus", () => tell(point, metric, x(point.ms), y(error)));
    group.addEventListener("blur", () => (byId("tip").hidden = true));
    return group;
  }

  function tell(point, metric, left, top) {
    const tip = byId("tip");
    const [low, high] = point.quartiles_ms.map(number);
    const lines = [
      `${number(point.ms)} ms (half of its frames ${low} to ${high})`,
      `${NAMES[metric]}: ${number(point[metric])}`,
      `foveal error: ${Math.round(100 * point.bias_share)} % bias, the rest noise`,
    ];
    if (point.is_chosen) lines.push("chosen for the budget");
    tip.replaceChildren(make("b", {}, point.label), ...lines.flatMap((line) => [line, make("br")]));
    tip.hidden = false;
    const space = chart.clientWidth;
    tip.style.left = `${clamp(left + 14, 0, Math.max(space - tip.offsetWidth, 0))}px`;
    tip.style.top = `${top + 14}px`;
  }

  chart.addEventListener("keydown", (event) => {
    const marks = [...chart.querySelectorAll(".mark")];
    const at = marks.indexOf(document.activeElement);
    const next = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: marks.length - 1 }[event.key];
    if (at < 0 || next === undefined) return;
    event.preventDefault();
    marks[at].setAttribute("tabindex", "-1");
    focused = clamp(next, 0, marks.length - 1);
    marks[focused].setAttribute("tabindex", "0");
    marks[focused].focus();
  });

  /** Shares of a frame's time for the points that no other beats; many are thinned out, the chosen one stays. */
  function stages() {
    const SHOWN = 9; // As many as there are colours that can be told apart.
    const names = [...new Set(points.flatMap((point) => point.pass_ms.map(([name]) => name)))].slice(0, SHOWN);
    const all = points.filter((point) => point.on_front || point.is_chosen).sort((a, b) => a.ms - b.ms);
    const stride = Math.max(1, Math.ceil(all.length / 12));
    for (const [i, name] of names.entries()) {
      const entry = make("span");
      entry.append(make("span", { class: "swatch", style: `--color: var(--pass-${i})` }), name);
      document.querySelector("#stages .entries").append(entry);
    }
    for (const point of all.filter((point, i) => i % stride === 0 || point.is_chosen)) {
      const total = point.pass_ms.reduce((sum, [, ms]) => sum + ms, 0) || 1;
      const stack = make("div", { class: "stack" });
      for (const [name, ms] of point.pass_ms) {
        const share = (100 * ms) / total;
        const title = `${name}: ${number(ms)} ms, ${share.toFixed(0)} %`;
        stack.append(make("i", { style: `--color: var(--pass-${Math.max(names.indexOf(name), 0)}); width: ${share}%`, title }));
      }
      const bar = make("div", { class: point.is_chosen ? "bar chosen" : "bar" });
      bar.append(make("span", { class: "name" }, point.label), make("span", { class: "ms" }, `${number(point.ms)} ms`), stack);
      document.querySelector("#stages .bars").append(bar);
    }
  }

  /** Heads become buttons that sort by their column: numbers by value, words by letter, nothing last. */
  function sortTables() {
    const value = (row, column) => {
      const cell = row.cells[column];
      const number_ = Number(cell.dataset.value ?? cell.textContent);
      return cell.textContent === "–" ? null : Number.isNaN(number_) ? cell.textContent : number_;
    };
    for (const table of document.querySelectorAll(".sortable")) {
      [...table.tHead.rows[0].cells].forEach((head, column) => {
        const button = make("button", { type: "button" }, head.textContent);
        head.replaceChildren(button);
        button.addEventListener("click", () => {
          const down = head.getAttribute("aria-sort") === "ascending";
          table.querySelectorAll("[aria-sort]").forEach((other) => other.removeAttribute("aria-sort"));
          head.setAttribute("aria-sort", down ? "descending" : "ascending");
          const rows = [...table.tBodies[0].rows].map((row) => [value(row, column), row]);
          rows.sort(([a], [b]) => (a === null) - (b === null) || (down ? -1 : 1) * (a < b ? -1 : a > b ? 1 : 0));
          table.tBodies[0].append(...rows.map(([, row]) => row));
        });
      });
    }
  }

  byId("plot").hidden = false;
  byId("stages").hidden = false;
  byId("metric").addEventListener("change", plot);
  new ResizeObserver(plot).observe(chart);
  plot();
  stages();
})();
