// Time and error against the value of an option: a line a path.

/** Paths of one family share colour and shape; dashes tell them apart. */
const dashes = new Map();
for (const family of layout.families) {
  const paths = [...new Set(points.filter((p) => p.family === family.name).map(pathText))];
  paths.forEach((path, i) => dashes.set(path, ["", "7 4", "2 3", "9 3 2 3", "9 3 2 3 2 3"][i % 5]));
}

function drawPanel(svg, x, box, kind, text) {
  const y = logScale(layout.axes[kind], [box.bottom, box.top]);
  svg.append("g").attr("class", "grid").attr("transform", `translate(${box.left},0)`)
    .call(ticksOf(d3.axisLeft, y).tickFormat("").tickSize(box.left - box.right)).select(".domain").remove();
  svg.append("g").attr("class", "axis x").attr("transform", `translate(0,${box.bottom})`).call(d3.axisBottom(x));
  svg.append("g").attr("class", `axis y ${kind}`).attr("transform", `translate(${box.left},0)`).call(ticksOf(d3.axisLeft, y));
  svg.append("text").attr("transform", `translate(16,${(box.top + box.bottom) / 2}) rotate(-90)`).attr("text-anchor", "middle")
    .text(`${text}, logarithmic`);
  const budget = layout.budgets[kind];
  if (budget !== null) budgetLine(svg, "", box.left, y.place(budget), box.right, y.place(budget), "budget");
  const shown = points.filter((p) => visible(p) && p.measured[kind] !== null);
  const line = d3.line().x((p) => x(p.at)).y((p) => y.place(p.measured[kind]));
  svg.append("g").selectAll("path").data(d3.nest().key(pathText).entries(shown)).enter().append("path").attr("class", "course")
    .attr("d", (path) => line(path.values)).attr("stroke-dasharray", (path) => dashes.get(path.key))
    .attr("stroke", (path) => families.get(path.values[0].family).colour)
    .append("title").text((path) => path.key);
  const marks = svg.append("g").selectAll("g").data(shown).enter().append("g").attr("class", `mark ${kind}`)
    .attr("data-index", (p) => p.index).attr("transform", (p) => `translate(${x(p.at)},${y.place(p.measured[kind])})`);
  marks.filter((p) => p.chosen).append("circle").attr("class", "ring").attr("r", 8);
  marks.append("path").attr("class", "full").attr("d", (p) => symbol(families.get(p.family).shape, 4.4))
    .attr("fill", (p) => families.get(p.family).colour);
  makeMarksAnswer(marks, shown);
}

function drawSweep() {
  const width = kFrame.width, panel = 300, gap = 44;
  const height = kFrame.top + 2 * panel + gap + kFrame.bottom;
  const svg = d3.select("#plot").html("").append("svg").attr("viewBox", `0 0 ${width} ${height}`)
    .attr("role", "group").attr("aria-label", `time and error against ${doc.sweep.option}`);
  const x = d3.scaleLinear().domain(d3.extent(doc.sweep.values)).range([kFrame.left + 8, width - kFrame.right - 8]);
  const box = { left: kFrame.left, right: width - kFrame.right, top: kFrame.top, bottom: kFrame.top + panel };
  drawPanel(svg, x, box, "seconds", "time");
  drawPanel(svg, x, { ...box, top: box.bottom + gap, bottom: box.bottom + gap + panel }, "error", "error (NRMSE)");
  svg.append("text").attr("x", width / 2).attr("y", height - 8).attr("text-anchor", "middle").text(doc.sweep.option);
  showSelection();
}
