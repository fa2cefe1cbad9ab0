"use strict";
// What all parts of the page share: the data, what is selected and hidden, and texts of numbers.

const doc = JSON.parse(document.getElementById("data").textContent);
const layout = doc.chart;
const families = new Map(layout.families.map((family) => [family.name, family]));
const points = doc.points.map((point, index) => ({
  index,
  steps: point.steps,
  family: point.family,
  at: point.at,
  front: point.front,
  chosen: point.chosen,
  failure: point.failure,
  predicted: { seconds: point.predicted.seconds, error: point.predicted.error, bytes: point.predicted.bytes },
  measured: point.measured
    ? { seconds: point.measured.typical, error: point.measured.error ? point.measured.error.nrmse : null, bytes: point.measured.bytes }
    : { seconds: null, error: null, bytes: null },
  source: point,
}));
const state = { selected: null, hidden: new Set(), opener: null };
const isSweep = Boolean(doc.sweep);

const secondsText = (s) => {
  if (s === null || s === undefined) return "–";
  for (const [size, unit] of [[1, "s"], [1e-3, "ms"], [1e-6, "µs"]])
    if (s >= 0.9995 * size) return `${Number((s / size).toPrecision(3))} ${unit}`;
  return `${Number((s * 1e9).toPrecision(3))} ns`;
};
const plainError = (e) => (e === null || e === undefined ? "–" : `${Number(e.toPrecision(3))}`);
const decibelText = (e) => (e > 0 ? ` (${(-20 * Math.log10(e)).toFixed(1)} dB)` : "");
const errorText = (e) => plainError(e) + decibelText(e);
const bytesText = (b) => (b === null || b === undefined ? "–" : `${(b / 2 ** 20).toFixed(1)} MiB`);
const pathText = (point) => point.steps.join(" > ") || "(the input itself)";
const numbersText = (values) => `${secondsText(values.seconds)}, error ${errorText(values.error)}, ${bytesText(values.bytes)}`;

/** The mark of a family, as a path around (0, 0). */
function symbol(name, size) {
  const polygon = (corners, turn) => {
    const radius = size * (corners === 3 ? 1.25 : 1.08);
    const corner = (i) => {
      const angle = turn + (2 * Math.PI * i) / corners;
      return `${(radius * Math.sin(angle)).toFixed(2)},${(-radius * Math.cos(angle)).toFixed(2)}`;
    };
    return `M${d3.range(corners).map(corner).join("L")}Z`;
  };
  switch (name) {
    case "square": return polygon(4, Math.PI / 4);
    case "up": return polygon(3, 0);
    case "down": return polygon(3, Math.PI);
    case "diamond": return polygon(4, 0);
    case "pentagon": return polygon(5, 0);
    default: return `M${-size},0a${size},${size} 0 1,0 ${2 * size},0a${size},${size} 0 1,0 ${-2 * size},0Z`;
  }
}

/** Where a value lies on a logarithmic axis: 0 has a place of its own, below all others. */
function placeOn(axis, value) {
  if (value <= 0) return axis.zero === null ? axis.low : axis.zero;
  return Math.min(Math.max(value, axis.low), axis.high);
}

function logScale(axis, range) {
  const scale = d3.scaleLog().domain([axis.low, axis.high]).range(range);
  return { axis, place: (value) => scale(placeOn(axis, value)), scale };
}

/** A d3 axis with the ticks that the data came with. */
function ticksOf(make, log) {
  const text = new Map(log.axis.ticks.map((tick) => [tick.at, tick.text]));
  return make(log.scale).tickValues(log.axis.ticks.map((tick) => tick.at)).tickFormat((at) => text.get(at));
}

const visible = (point) => !state.hidden.has(point.family);

/** @param opener  where the focus goes back to when the path is let go; absent: it stays where it is */
function select(index, opener = null) {
  if (index === null && state.opener && state.opener.isConnected) state.opener.focus();
  state.opener = index === null ? null : opener;
  state.selected = index;
  const hash = index === null ? " " : `#select=${index}`;
  history.replaceState(null, "", index === null ? location.pathname + location.search : hash);
  showSelection();
  if (index === null) return;
  const detail = document.getElementById("detail");
  if (opener) detail.focus({ preventScroll: true });
  detail.scrollIntoView({ block: "nearest" });
}

function showSelection() {
  d3.selectAll(".mark").classed("selected", function () { return Number(this.dataset.index) === state.selected; })
    .attr("aria-pressed", function () { return Number(this.dataset.index) === state.selected; });
  d3.selectAll("#table tbody tr").classed("selected", function () { return Number(this.dataset.index) === state.selected; });
  if (isSweep) showCourse();
  const shown = state.selected === null ? points.find((p) => p.chosen) : points[state.selected];
  showDetail(shown || null);
}

function takeHash() {
  const found = /^#select=(\d+)$/.exec(location.hash);
  const index = found && Number(found[1]) < points.length ? Number(found[1]) : null;
  if (index === state.selected) return;
  state.selected = index;
  showSelection();
}

/** Shows what a mark stands for, beside it. */
function showTip(point, anchor) {
  const tip = d3.select("#tip").html("").attr("hidden", null);
  const list = tip.append("ol");
  for (const step of point.steps) list.append("li").text(step);
  if (point.at !== undefined) tip.append("div").text(`${doc.sweep.option} = ${point.at}`);
  tip.append("div").text(`measured ${numbersText(point.measured)}`);
  tip.append("div").attr("class", "soft").text(`predicted ${numbersText(point.predicted)}`);
  const roles = [point.chosen ? "chosen by the planner" : "", point.front ? "on the front" : ""].filter(Boolean);
  if (roles.length) tip.append("div").attr("class", "soft").text(roles.join(", "));
  const box = anchor.getBoundingClientRect();
  const own = tip.node().getBoundingClientRect();
  const left = Math.min(box.right + 12, document.documentElement.clientWidth - own.width - 8);
  const top = box.bottom + 10 + own.height > innerHeight ? Math.max(4, box.top - own.height - 10) : box.bottom + 10;
  tip.style("left", `${Math.max(4, left) + scrollX}px`).style("top", `${top + scrollY}px`);
}
const hideTip = () => d3.select("#tip").attr("hidden", true);

/** The one `step` further in a list, from its end to its beginning. */
const following = (list, item, step) => list[(list.indexOf(item) + step + list.length) % list.length];

/**
 * Makes marks answer to mouse and keyboard; one of them at a time is a stop of the Tab key.
 * @param order  of points: the first is where Tab leads, Home and End go to either end
 * @param next   the point that an arrow key leads to from another
 */
function makeMarksAnswer(marks, order, next) {
  const nodes = new Map();
  marks.each(function (point) { nodes.set(point, this); });
  const target = (point, key) => {
    if (key === "Home") return order[0];
    if (key === "End") return order[order.length - 1];
    return key.startsWith("Arrow") ? next(point, key) : null;
  };
  marks.attr("tabindex", (point) => (point === order[0] ? 0 : -1))
    .attr("role", "button")
    .attr("aria-label", (point) => `${pathText(point)}: ${numbersText(point.measured)}`)
    .on("mouseenter", function (point) { showTip(point, this); })
    .on("mouseleave", hideTip)
    .on("focus", function (point) {
      marks.attr("tabindex", -1);
      d3.select(this).attr("tabindex", 0);
      showTip(point, this);
    })
    .on("blur", hideTip)
    .on("click", (point) => select(point.index))
    .on("keydown", function (point) {
      const key = d3.event.key;
      if (key === "Enter" || key === " ") select(point.index);
      else {
        const other = target(point, key);
        if (!other) return;
        nodes.get(other).focus();
      }
      d3.event.preventDefault();
    });
}

/** The check boxes by which families are shown and hidden; they are the legend too. */
function makeFamilies(redraw) {
  const labels = d3.select("#families").selectAll("label").data(layout.families).enter().append("label");
  labels.append("input").attr("type", "checkbox").property("checked", true).on("change", function (family) {
    if (this.checked) state.hidden.delete(family.name);
    else state.hidden.add(family.name);
    this.parentNode.classList.toggle("off", !this.checked);
    redraw();
  });
  labels.append("svg").attr("width", 16).attr("height", 16).attr("viewBox", "-8 -8 16 16").attr("aria-hidden", true)
    .append("path").attr("d", (family) => symbol(family.shape, 6)).attr("fill", (family) => family.colour);
  labels.append("span").text((family) => `${family.name} (${points.filter((p) => p.family === family.name).length})`);
}

/** Colours: as the system has them, or one of the two. */
function makeTheme() {
  const names = ["auto", "dark", "light"];
  const words = { auto: "as the system", dark: "dark", light: "light" };
  const button = d3.select("#theme");
  const say = (name) => button.text(`Colours: ${words[name]}`)
    .attr("title", `switch to ${words[names[(names.indexOf(name) + 1) % names.length]]}`);
  let now = "auto";
  say(now);
  button.on("click", () => {
    const next = names[(names.indexOf(now) + 1) % names.length];
    now = next;
    say(next);
    if (next === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = next;
  });
}

/** Escape lets go of what is selected, wherever the focus is. */
function makeEscape() {
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    hideTip();
    if (state.selected !== null) select(null);
  });
}

function makeHeader() {
  const request = doc.request;
  const paths = new Set(points.map(pathText)).size;
  const parts = [
    `${paths} of ${doc.paths} paths`, isSweep ? `at ${doc.sweep.values.length} values of ${doc.sweep.option}` : "", `${request.threads} thread${request.threads === 1 ? "" : "s"}`,
    request.frames > 1 ? `${request.frames} frames` : "", `machine profile ${doc.machine}`, `edgewise ${doc.version}`,
    doc.interrupted ? "interrupted" : "",
  ];
  d3.select("#about").text(parts.filter(Boolean).join(" · "));
  d3.select("#hint").text(isSweep
    ? "Arrow keys move along a line and to the next one, Enter selects, Escape lets go. Numbers at the ends are those of the list below; thin grey lines were never chosen and on the front of fewer than half of the values."
    : "Arrow keys move between marks, Enter selects, Escape lets go. Full marks are measured, hollow ones predicted.");
  d3.select("#warnings").attr("hidden", doc.warnings.length ? null : true).selectAll("li").data(doc.warnings).enter()
    .append("li").text((warning) => warning);
}
