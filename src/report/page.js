"use strict";
(() => {
  const { report, frames } = JSON.parse(document.getElementById("report-data").textContent);
  if (frames.length === 0) return;

  const SVG = "http://www.w3.org/2000/svg";
  const byId = (id) => document.getElementById(id);
  const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
  const fixed = (x, digits) => (x == null ? "–" : x.toFixed(digits).replace("-", "−"));
  const sum = (values) => values.reduce((total, x) => total + (x ?? 0), 0);
  const milliseconds = (ms) => fixed(ms, ms >= 100 ? 0 : ms >= 10 ? 1 : 2);
  const color = (state) => (["tracked", "held", "predicted", "fallback", "replay"].includes(state) ? `var(--${state})` : "var(--other)");
  /** An element with attributes; `text` is its text, never markup. */
  const make = (name, attributes = {}, text = "", namespace = null) => {
    const element = namespace ? document.createElementNS(namespace, name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== "") element.textContent = text;
    return element;
  };
  const draw = (name, attributes, text) => make(name, attributes, text, SVG);

  // ---- The viewer ----

  let current = 0;
  const onShow = []; // Every part of the page that follows the current frame.
  const [width, height] = report.picture_size;

  /** For each frame and eye, the frame whose picture is shown: its own, or the nearest earlier one, or the first. */
  const pictured = [0, 1].map((eye) => {
    const first = frames.findIndex((frame) => frame.eyes[eye].picture);
    let last = first;
    return frames.map((frame, i) => (last = frame.eyes[eye].picture ? i : last));
  });

  const overlays = { gaze: true, fovea: true, transition: true };
  const path = (points) => points.map(([u, v], i) => `${i ? "L" : "M"}${(u * width).toFixed(2)} ${(v * height).toFixed(2)}`).join("");

  function drawOverlay(svg, eye, state) {
    const strokes = eye.outlines.filter((outline) => overlays[outline.region]).map((outline) => [path(outline.points), outline.region]);
    if (overlays.gaze && eye.gaze) {
      const [x, y] = [eye.gaze[0] * width, eye.gaze[1] * height];
      const arm = 0.028 * Math.min(width, height);
      const gap = 0.3 * arm;
      const cross = [[1, 0], [-1, 0], [0, 1], [0, -1]].map(([dx, dy]) => `M${x + dx * gap} ${y + dy * gap}L${x + dx * arm} ${y + dy * arm}`).join("");
      strokes.push([cross, state === "tracked" || state === "replay" ? "gaze" : "gaze unsure"]);
    }
    const halos = strokes.map(([d]) => draw("path", { d, class: "halo" }));
    svg.replaceChildren(...halos, ...strokes.map(([d, name]) => draw("path", { d, class: name })));
  }

  document.querySelectorAll(".eye").forEach((figure) => {
    const eye = Number(figure.dataset.eye);
    const [image, svg, stale] = ["img", "svg", ".stale"].map((name) => figure.querySelector(name));
    figure.querySelector(".picture").style.aspectRatio = `${width} / ${height}`;
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    let shown = -1;
    onShow.push(() => {
      const source = pictured[eye][current];
      if (source !== shown && source >= 0) {
        const block = byId(`picture-${source}-${eye}`);
        image.src = `data:${block.type};base64,${block.textContent}`;
        shown = source;
      }
      stale.textContent = source < 0 ? "(no picture)" : source === current ? "" : `(picture of frame ${frames[source].index})`;
      drawOverlay(svg, frames[current].eyes[eye], frames[current].state);
    });
  });

  onShow.push(() => {
    const frame = frames[current];
    const angle = (i, positive, negative) => {
      const degrees = frame.angles_deg?.[i];
      return degrees == null ? "–" : `${Math.abs(degrees).toFixed(1)}° ${degrees >= 0 ? positive : negative}`;
    };
    const state = make("dd");
    state.append(make("span", { class: "swatch", style: `--color: ${color(frame.state)}` }), frame.state);
    const rows = [
      ["frame", make("dd", {}, String(frame.index))],
      ["time", make("dd", {}, `${frame.time_s.toFixed(3)} s`)],
      ["all passes", make("dd", {}, `${milliseconds(sum(frame.pass_ms))} ms`)],
      null,
      ["gaze", state],
      ["age of sample", make("dd", {}, frame.age_ms == null ? "–" : `${frame.age_ms.toFixed(1)} ms`)],
      ["azimuth", make("dd", {}, angle(0, "right", "left"))],
      ["elevation", make("dd", {}, angle(1, "up", "down"))],
      ...(report.counts.length ? [null] : []),
      ...report.counts.map((name, i) => [name, make("dd", {}, frame.counts[i] == null ? "–" : frame.counts[i].toLocaleString("en"))]),
    ];
    byId("facts").replaceChildren(...rows.flatMap((row) => (row ? [make("dt", {}, row[0]), row[1]] : [make("div", { class: "break" })])));
  });

  const scrubber = byId("scrubber");
  scrubber.max = frames.length - 1;
  onShow.push(() => {
    scrubber.value = current;
    scrubber.setAttribute("aria-valuetext", `frame ${frames[current].index}, ${frames[current].time_s.toFixed(2)} seconds`);
    byId("position").textContent = `${current + 1} of ${frames.length} · ${frames[current].time_s.toFixed(2)} s`;
  });

  let linkTimer = 0;
  function show(frame) {
    current = clamp(Math.round(frame), 0, frames.length - 1);
    onShow.forEach((update) => update());
    // The address follows once the frame rests: a link to it opens the page there. Browsers limit how often it may change.
    clearTimeout(linkTimer);
    if (!playing) linkTimer = setTimeout(() => history.replaceState(null, "", `#frame=${frames[current].index}`), 400);
  }

  // ---- Playing ----

  let playing = null; // { wall_ms, time_s } when it started, and the timer that waits for the next frame.
  const speed = () => Number(byId("speed").value);
  function play(start) {
    clearTimeout(playing?.timer);
    playing = start ? { wall_ms: performance.now(), time_s: frames[current].time_s } : null;
    byId("viewer").classList.toggle("playing", start);
    byId("play").setAttribute("aria-label", start ? "Pause" : "Play");
    if (start) tick();
    else show(current);
  }
  /** Shows the frame whose time has come, skipping those that the browser was too slow for, and waits for the next. */
  function tick() {
    const time_s = playing.time_s + ((performance.now() - playing.wall_ms) / 1000) * speed();
    let next = current;
    while (next + 1 < frames.length && frames[next + 1].time_s <= time_s) next += 1;
    if (next !== current) show(next);
    if (current === frames.length - 1) return play(false);
    playing.timer = setTimeout(tick, ((frames[current + 1].time_s - time_s) * 1000) / speed());
  }
  const toggle = () => {
    if (!playing && current === frames.length - 1) show(0);
    play(!playing);
  };
  const jump = (frame) => {
    if (playing) play(false);
    show(frame);
  };
  byId("play").addEventListener("click", toggle);
  byId("speed").addEventListener("change", () => playing && play(true));
  scrubber.addEventListener("input", () => jump(Number(scrubber.value)));
  document.querySelectorAll("[data-overlay]").forEach((box) =>
    box.addEventListener("change", () => {
      overlays[box.dataset.overlay] = box.checked;
      show(current);
    }),
  );
  document.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || event.target.closest("select")) return;
    const step = event.shiftKey ? 10 : 1;
    const actions = {
      " ": () => toggle(),
      ArrowLeft: () => jump(current - step),
      ArrowRight: () => jump(current + step),
      Home: () => jump(0),
      End: () => jump(frames.length - 1),
    };
    // A focused button or box keeps the space bar for itself.
    if (!actions[event.key] || (event.key === " " && event.target.closest("button, input[type=checkbox]"))) return;
    event.preventDefault();
    actions[event.key]();
  });

  // ---- The plots ----

  const LEFT = 44;
  const RIGHT = 8;
  const [start_s, end_s] = [frames[0].time_s, frames.at(-1).time_s];
  const span_s = end_s - start_s || 1;
  /** A frame lasts until the next; the last as long as the one before. */
  const ends = frames.map((frame, i) => frames[i + 1]?.time_s ?? frame.time_s + span_s / Math.max(frames.length - 1, 1));
  const last_s = ends.at(-1);

  /** About `count` round values from `low` to `high`. */
  function ticks(low, high, count) {
    const raw = (high - low) / count || 1;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const values = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) values.push([k * step, fixed(k * step || 0, digits)]);
    return values;
  }

  function nearest(time_s) {
    let [low, high] = [0, frames.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (ends[middle] <= time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /**
   * A plot over time: `range` is [low, high] or null, `entries` are its legend ({ name, color, dashed, value(frame) }),
   * `body(svg, x, y)` draws it.
   */
  function plot({ title, unit, size, range, entries, note, timeAxis, body }) {
    const figure = make("figure", { class: "plot" });
    const caption = make("figcaption");
    caption.append(make("b", {}, title));
    for (const entry of entries) {
      const item = make("span", { class: "entry" });
      const value = make("span", { class: "value" });
      item.append(make("span", { class: "swatch", style: `--color: ${entry.color}` }), `${entry.name} `);
      if (entry.value) {
        item.append(value);
        onShow.push(() => (value.textContent = entry.value(frames[current])));
      }
      caption.append(item);
    }
    if (note) caption.append(make("span", {}, note));
    const svg = draw("svg", { role: "img", "aria-label": `${title} over time` });
    figure.append(caption, svg);
    byId("plots").append(figure);

    const bottom = timeAxis ? 20 : 3;
    let [inner, cursor] = [1, null];
    const x = (time_s) => LEFT + ((time_s - start_s) / (last_s - start_s)) * inner;
    const y = (value) => size - ((value - range[0]) / (range[1] - range[0])) * size + 6;
    const moveCursor = () => {
      const at = x((frames[current].time_s + ends[current]) / 2);
      cursor?.setAttribute("d", `M${at} 6V${size + 6}`);
    };
    const render = () => {
      const full = svg.clientWidth || 800;
      inner = full - LEFT - RIGHT;
      svg.setAttribute("viewBox", `0 0 ${full} ${size + 6 + bottom}`);
      svg.replaceChildren();
      if (range) {
        for (const [value, label] of ticks(range[0], range[1], Math.max(2, Math.floor(size / 28)))) {
          svg.append(draw("path", { class: "grid", d: `M${LEFT} ${y(value)}H${full - RIGHT}` }));
          svg.append(draw("text", { x: LEFT - 7, y: y(value) + 4, "text-anchor": "end" }, label));
        }
        svg.append(draw("text", { x: 0, y: 12 }, unit));
      }
      body(svg, x, y);
      svg.append(draw("path", { class: "axis", d: `M${LEFT} ${size + 6}H${full - RIGHT}` }));
      if (timeAxis) {
        for (const [value, label] of ticks(start_s, end_s, Math.max(2, Math.floor(full / 110)))) {
          svg.append(draw("path", { class: "axis", d: `M${x(value)} ${size + 6}v4` }));
          svg.append(draw("text", { x: x(value), y: size + 20, "text-anchor": "middle" }, `${label} s`));
        }
      }
      cursor = draw("path", { class: "cursor" });
      svg.append(cursor);
      moveCursor();
    };
    const point = (event) => {
      const time_s = start_s + ((event.clientX - svg.getBoundingClientRect().left - LEFT) / inner) * (last_s - start_s);
      jump(nearest(time_s));
    };
    svg.addEventListener("pointerdown", point);
    svg.addEventListener("pointermove", (event) => event.buttons & 1 && point(event));
    onShow.push(moveCursor);
    new ResizeObserver(render).observe(svg);
    render();
  }

  /** The path of a step function between two heights per frame. */
  const steps = (low, high, x, y) => {
    const top = frames.map((_, i) => `${x(frames[i].time_s)} ${y(high[i])}H${x(ends[i])}`);
    const under = frames.map((_, i) => `${x(ends[i])} ${y(low[i])}H${x(frames[i].time_s)}`).reverse();
    return `M${top.join("L")}L${under.join("L")}Z`;
  };

  /** Lines through the values that there are, broken where there is none. */
  const line = (values, x, y) => {
    let pen = "M";
    return frames.map((frame, i) => {
      if (values[i] == null) return ((pen = "M"), "");
      const piece = `${pen}${x((frame.time_s + ends[i]) / 2).toFixed(2)} ${y(values[i]).toFixed(2)}`;
      pen = "L";
      // A lone value is a dot.
      return piece + (values[i + 1] == null && values[i - 1] == null ? "h.01" : "");
    }).join("");
  };

  /** An axis for values from zero; a few that tower over the rest do not flatten it: they are marked instead. */
  function limit(values) {
    const sorted = [...values].sort((a, b) => a - b);
    const [p95, max] = [sorted[Math.floor(0.95 * (sorted.length - 1))], sorted.at(-1)];
    return max > 2.5 * p95 && p95 > 0 ? 1.3 * p95 : 1.05 * max || 1;
  }

  const marks = (values, top, svg, x) =>
    values.forEach((value, i) => {
      if (value > top) svg.append(draw("path", { class: "beyond", d: `M${x((frames[i].time_s + ends[i]) / 2)} -1l3.5 5h-7z` }));
    });

  const beyond = (values, top, format) => {
    const high = values.filter((value) => value > top);
    return high.length ? `▲ ${high.length} beyond the axis, up to ${format(Math.max(...high))}` : "";
  };

  function plotTimes() {
    const SHOWN = 8; // As many as there are colours that can be told apart; the rest is summed up.
    const cost = report.passes.map((_, p) => sum(frames.map((frame) => frame.pass_ms[p])));
    const costly = new Set([...cost.keys()].sort((a, b) => cost[b] - cost[a]).slice(0, report.passes.length > SHOWN + 1 ? SHOWN : SHOWN + 1));
    const series = [...cost.keys()].filter((p) => costly.has(p)).map((p, i) => ({
      name: report.passes[p], color: `var(--pass-${i})`, ms: (frame) => frame.pass_ms[p] ?? 0,
    }));
    const rest = [...cost.keys()].filter((p) => !costly.has(p));
    if (rest.length) {
      series.push({ name: `${rest.length} others`, color: "var(--pass-8)", ms: (frame) => sum(rest.map((p) => frame.pass_ms[p])) });
    }
    const totals = frames.map((frame) => sum(frame.pass_ms));
    const top = limit(totals);
    plot({
      title: "Time per pass", unit: "ms", size: 170, range: [0, top], note: beyond(totals, top, (ms) => `${milliseconds(ms)} ms`),
      entries: series.map(({ name, color, ms }) => ({ name, color, value: (frame) => milliseconds(ms(frame)) })),
      body: (svg, x, y) => {
        let low = frames.map(() => 0);
        for (const { color, ms } of series) {
          const high = frames.map((frame, i) => low[i] + ms(frame));
          const cut = (values) => values.map((value) => Math.min(value, top));
          svg.append(draw("path", { class: "area", style: `--color: ${color}`, d: steps(cut(low), cut(high), x, y) }));
          low = high;
        }
        marks(totals, top, svg, x);
      },
    });
  }

  function plotAngles() {
    const angles = [0, 1].map((i) => frames.map((frame) => frame.angles_deg?.[i] ?? null));
    const values = angles.flat().filter((value) => value != null);
    const reach = [Math.min(-1, ...values), Math.max(1, ...values)];
    const pad = 0.06 * (reach[1] - reach[0]);
    const value = (i) => (frame) => (frame.angles_deg ? `${fixed(frame.angles_deg[i], 1)}°` : "–");
    plot({
      title: "Gaze in the head", unit: "deg", size: 120, range: [reach[0] - pad, reach[1] + pad],
      entries: [
        { name: "azimuth (right +)", color: "var(--azimuth)", value: value(0) },
        { name: "elevation (up +), dashed", color: "var(--elevation)", value: value(1) },
      ],
      body: (svg, x, y) => {
        svg.append(draw("path", { class: "line", style: "--color: var(--azimuth)", d: line(angles[0], x, y) }));
        svg.append(draw("path", { class: "line dashed", style: "--color: var(--elevation)", d: line(angles[1], x, y) }));
      },
    });
  }

  function plotStates() {
    const states = [...new Set(frames.map((frame) => frame.state))];
    plot({
      title: "Gaze state", size: 18, range: null,
      entries: states.map((state) => ({ name: state, color: color(state) })),
      body: (svg, x) => {
        for (let first = 0, i = 1; i <= frames.length; i += 1) {
          if (frames[i]?.state === frames[first].state) continue;
          const [left, right] = [x(frames[first].time_s), x(ends[i - 1])];
          const run = draw("rect", { class: "band", style: `--color: ${color(frames[first].state)}`, x: left, y: 6, width: Math.max(right - left, 1), height: 18 });
          run.append(draw("title", {}, `${frames[first].state}: frames ${frames[first].index} to ${frames[i - 1].index}`));
          svg.append(run);
          first = i;
        }
      },
    });
  }

  function plotAges() {
    const ages = frames.map((frame) => frame.age_ms);
    const known = ages.filter((age) => age != null);
    const top = limit(known.length ? known : [1]);
    plot({
      title: "Age of the gaze sample", unit: "ms", size: 80, range: [0, top], timeAxis: true, note: beyond(known, top, (ms) => `${milliseconds(ms)} ms`),
      entries: [{ name: "age", color: "var(--azimuth)", value: (frame) => (frame.age_ms == null ? "–" : `${frame.age_ms.toFixed(1)} ms`) }],
      body: (svg, x, y) => {
        svg.append(draw("path", { class: "line", style: "--color: var(--azimuth)", d: line(ages.map((age) => age == null ? null : Math.min(age, top)), x, y) }));
        marks(ages, top, svg, x);
      },
    });
  }

  byId("viewer").hidden = false;
  byId("plots").hidden = false;
  if (report.passes.length) plotTimes();
  plotAngles();
  plotStates();
  plotAges();

  /** `#frame=42` opens the page at the frame with that number, or the one next to it. */
  function followLink() {
    const match = /^#frame=(\d+)$/.exec(location.hash);
    if (!match) return;
    const wanted = Number(match[1]);
    const distance = (frame) => Math.abs(frame.index - wanted);
    show(frames.reduce((best, frame, i) => (distance(frame) < distance(frames[best]) ? i : best), 0));
  }
  addEventListener("hashchange", followLink);
  show(0);
  followLink();
})();
