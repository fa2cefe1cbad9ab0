// Time and error against the value of an option: a line a path.

const kDashes = ["", "7 4", "2 3", "9 3 2 3", "9 3 2 3 2 3"];
const kEqual = 1.5;  // ends that are no farther apart share a text
/** Numbered ones come first; the others lie behind them, thin and grey. */
const courses = layout.courses.map((course) => ({ ...course, points: course.points.map((i) => points[i]) }));
const courseOf = new Map(courses.flatMap((course) => course.points.map((point) => [point, course])));

/** The same places moved as little as it takes for neighbours to be `apart`. */
function spread(places, apart, low, high) {
  const order = d3.range(places.length).sort((a, b) => places[a] - places[b]);
  const blocks = [];  // of places that are too close: about their common middle
  for (const i of order) {
    blocks.push({ sum: places[i], count: 1 });
    while (blocks.length > 1) {
      const [before, last] = blocks.slice(-2);
      if (before.sum / before.count + apart * before.count <= last.sum / last.count) break;
      before.sum += last.sum - apart * before.count * last.count;
      before.count += last.count;
      blocks.pop();
    }
  }
  const moved = blocks.flatMap(({ sum, count }) => d3.range(count).map((k) => sum / count + apart * k));
  for (let i = moved.length - 1, most = high; i >= 0; --i, most -= apart) moved[i] = Math.min(moved[i], most);
  for (let i = 0, least = low; i < moved.length; ++i, least += apart) moved[i] = Math.max(moved[i], least);
  const found = [];
  order.forEach((i, rank) => { found[i] = moved[rank]; });
  return found;
}

/** Runs of a course without a gap: where a path could not serve a value its line breaks. */
function runsOf(course, kind) {
  const values = doc.sweep.values.slice().sort(d3.ascending);
  const there = new Map(course.points.filter((p) => p.measured[kind] !== null).map((p) => [p.at, p]));
  const runs = [[]];
  for (const value of values) {
    if (there.has(value)) runs[runs.length - 1].push(there.get(value));
    else if (runs[runs.length - 1].length) runs.push([]);
  }
  return runs.filter((run) => run.length);
}

/** A line over all values; what lies beyond the axis is said at its edge. */
function drawAcross(svg, y, box, value, name, text) {
  const { low, high } = y.axis;
  const beyond = value > high ? "↑ " : value > 0 && value < low ? "↓ " : "";
  if (!beyond)
    svg.append("line").attr("class", name).attr("x1", box.left).attr("x2", box.right).attr("y1", y.place(value)).attr("y2", y.place(value));
  svg.append("text").attr("class", `${name}-text`).attr("x", box.left + 6)
    .attr("y", value > high ? box.top + 8 : y.place(value) - 5).text(beyond + text);
}

/** The numbers of lines where they end: beside the panel, or on it for those that end earlier. */
function drawNumbers(svg, x, y, box, kind) {
  const ends = [];
  for (const course of courses.filter((c) => c.number && visible(c))) {
    const known = course.points.filter((p) => p.measured[kind] !== null);
    if (!known.length) continue;
    const point = known[known.length - 1];
    const [left, top] = [x(point.at), y.place(point.measured[kind])];
    const same = ends.find((end) => end.left === left && Math.abs(end.top - top) <= kEqual);
    if (same) same.text += `, ${course.number}`;
    else ends.push({ left, top, text: `${course.number}` });
  }
  const last = x.range()[1];
  const beside = ends.filter((end) => end.left === last);
  const places = spread(beside.map((end) => end.top), 13, box.top + 2, box.bottom);
  beside.forEach((end, i) => {
    svg.append("line").attr("class", "to-number").attr("x1", last).attr("y1", end.top).attr("x2", box.right + 10).attr("y2", places[i]);
    svg.append("text").attr("class", "number").attr("x", box.right + 12).attr("y", places[i] + 4).text(end.text);
  });
  for (const end of ends.filter((other) => other.left !== last))
    svg.append("text").attr("class", "number").attr("x", end.left + 8).attr("y", end.top + 4).text(end.text);
}

/** Left and right lead along a line, up and down to the line above or below at the same value. */
function neighbour(shown, kind, point, key) {
  const along = key === "ArrowRight" || key === "ArrowLeft";
  const list = along
    ? courseOf.get(point).points.filter((p) => shown.includes(p))
    : shown.filter((p) => p.at === point.at).sort((a, b) => b.measured[kind] - a.measured[kind] || a.index - b.index);
  return following(list, point, key === "ArrowRight" || key === "ArrowDown" ? 1 : -1);
}

function drawPanel(svg, x, box, kind, text) {
  const y = logScale(layout.axes[kind], [box.bottom, box.top]);
  svg.append("g").attr("class", "grid").attr("transform", `translate(${box.left},0)`)
    .call(ticksOf(d3.axisLeft, y).tickFormat("").tickSize(box.left - box.right)).select(".domain").remove();
  const values = doc.sweep.values;
  const axis = values.length <= 13 ? d3.axisBottom(x).tickValues(values).tickFormat(String) : d3.axisBottom(x);
  svg.append("g").attr("class", "axis x").attr("transform", `translate(0,${box.bottom})`).call(axis);
  svg.append("g").attr("class", `axis y ${kind}`).attr("transform", `translate(${box.left},0)`).call(ticksOf(d3.axisLeft, y));
  svg.append("text").attr("transform", `translate(16,${(box.top + box.bottom) / 2}) rotate(-90)`).attr("text-anchor", "middle")
    .text(`${text}, logarithmic`);
  const shownCourses = courses.filter(visible).reverse();  // the numbered ones on top
  const line = d3.line().x((p) => x(p.at)).y((p) => y.place(p.measured[kind]));
  svg.append("g").selectAll("path").data(shownCourses).enter().append("path")
    .attr("class", (course) => `course${course.number ? "" : " behind"}`)
    .attr("d", (course) => runsOf(course, kind).map(line).join(""))
    .attr("stroke-dasharray", (course) => (course.number ? kDashes[course.dash % kDashes.length] : ""))
    .attr("stroke", (course) => families.get(course.family).colour)
    .append("title").text((course) => course.path);
  const budget = layout.budgets[kind];
  if (budget !== null) drawAcross(svg, y, box, budget, "budget", kind === "seconds" ? `time budget ${secondsText(budget)}` : `error budget ${Number(budget.toPrecision(3))}`);
  for (const peer of doc.peers) drawAcross(svg, y, box, peer[kind], "peer-line", peer.name);
  svg.append("g").attr("class", `guesses ${kind}`).datum({ x, y, kind });
  const shown = shownCourses.flatMap((course) => course.points).filter((p) => p.measured[kind] !== null);
  const marks = svg.append("g").selectAll("g").data(shown).enter().append("g")
    .attr("class", (p) => `mark ${kind}${courseOf.get(p).number ? "" : " behind"}`)
    .attr("data-index", (p) => p.index).attr("transform", (p) => `translate(${x(p.at)},${y.place(p.measured[kind])})`);
  marks.filter((p) => p.chosen).append("circle").attr("class", "ring").attr("r", 8);
  marks.append("path").attr("class", "full").attr("fill", (p) => families.get(p.family).colour)
    .attr("d", (p) => symbol(families.get(p.family).shape, courseOf.get(p).number ? 4.4 : 2.4));
  drawNumbers(svg, x, y, box, kind);
  const order = shown.slice().sort((a, b) => (courseOf.get(a).number || Infinity) - (courseOf.get(b).number || Infinity) || a.at - b.at);
  makeMarksAnswer(marks, order, (point, key) => neighbour(shown, kind, point, key));
}

/** The line of the selected path, and what was predicted for it: hollow marks. */
function showCourse() {
  const course = state.selected === null ? undefined : courseOf.get(points[state.selected]);
  d3.selectAll(".course").classed("selected", (other) => other === course);
  d3.selectAll("#courses li").classed("selected", (other) => other === course);
  d3.selectAll(".guesses").each(function ({ x, y, kind }) {
    const within = (p) => p.predicted[kind] !== null && (p.predicted[kind] === 0 || y.place(p.predicted[kind]) === y.scale(p.predicted[kind]));
    d3.select(this).html("").selectAll("path").data(course && visible(course) ? course.points.filter(within) : []).enter().append("path")
      .attr("class", "guess").attr("transform", (p) => `translate(${x(p.at)},${y.place(p.predicted[kind])})`)
      .attr("d", (p) => symbol(families.get(p.family).shape, 4.4)).attr("stroke", (p) => families.get(p.family).colour);
  });
}

/** What the numbers stand for. */
function makeCourses() {
  const items = d3.select("#courses").attr("hidden", null).selectAll("li").data(courses.filter((c) => c.number)).enter()
    .append("li").attr("value", (course) => course.number);
  const buttons = items.append("button").attr("type", "button").attr("title", "show this path")
    .on("click", (course) => select((course.points.find((p) => p.chosen) || course.points[0]).index));
  const sample = buttons.append("svg").attr("width", 44).attr("height", 12).attr("viewBox", "-22 -6 44 12").attr("aria-hidden", true);
  const colour = (course) => families.get(course.family).colour;
  sample.append("path").attr("d", "M-22,0H22").attr("stroke", colour).attr("stroke-width", 1.6)
    .attr("stroke-dasharray", (course) => kDashes[course.dash % kDashes.length]);
  sample.append("path").attr("d", (course) => symbol(families.get(course.family).shape, 4.4)).attr("fill", colour);
  buttons.append("span").text((course) => course.path || "(the input itself)");
}

function drawSweep() {
  const width = kFrame.width, panel = 300, gap = 44;
  const height = kFrame.top + 2 * panel + gap + kFrame.bottom;
  const svg = d3.select("#plot").html("").append("svg").attr("viewBox", `0 0 ${width} ${height}`)
    .attr("role", "group").attr("aria-label", `time and error against ${doc.sweep.option}`);
  const box = { left: leftOf(layout.axes.seconds, layout.axes.error), right: width - 70, top: kFrame.top, bottom: kFrame.top + panel };  // numbers are beside
  const x = d3.scaleLinear().domain(d3.extent(doc.sweep.values)).range([box.left + 12, box.right - 12]);
  drawPanel(svg, x, box, "seconds", "time");
  drawPanel(svg, x, { ...box, top: box.bottom + gap, bottom: box.bottom + gap + panel }, "error", "error (NRMSE)");
  svg.append("text").attr("x", (box.left + box.right) / 2).attr("y", height - 8).attr("text-anchor", "middle").text(doc.sweep.option);
  showSelection();
}
