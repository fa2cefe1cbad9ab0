// Time against error: one mark a path.

const kFrame = { width: 900, height: 560, right: 18, top: 14, bottom: 46 };

/** Room for the texts of the ticks of these axes, 7 a character at most, and for the title beside them. */
const leftOf = (...axes) => 38 + 7 * d3.max(axes.flatMap((axis) => axis.ticks.map((tick) => tick.text.length)).concat(2));

function budgetLine(svg, kind, x1, y1, x2, y2, text) {
  svg.append("line").attr("class", `budget ${kind}`).attr("x1", x1).attr("y1", y1).attr("x2", x2).attr("y2", y2);
  const label = svg.append("text").attr("class", "budget-text").text(text);
  if (kind === "time") label.attr("transform", `translate(${x1 - 5},${y2 + 4}) rotate(-90)`).attr("text-anchor", "end");
  else label.attr("x", x2 - 4).attr("y", y1 - 5).attr("text-anchor", "end");
}

function drawBudgets(svg, x, y, box) {
  const { seconds, error } = layout.budgets;
  if (seconds !== null)
    budgetLine(svg, "time", x.place(seconds), box.bottom, x.place(seconds), box.top, `time ${secondsText(seconds)}`);
  if (error !== null)
    budgetLine(svg, "error", box.left, y.place(error), box.right, y.place(error), `error ${Number(error.toPrecision(3))}`);
}

function drawAxes(svg, x, y, box) {
  const grid = (name, make, at) => svg.append("g").attr("class", `grid ${name}`).attr("transform", at)
    .call(make.tickFormat("").tickSizeOuter(0)).select(".domain").remove();
  grid("x", ticksOf(d3.axisBottom, x).tickSize(box.top - box.bottom), `translate(0,${box.bottom})`);
  grid("y", ticksOf(d3.axisLeft, y).tickSize(box.left - box.right), `translate(${box.left},0)`);
  svg.append("g").attr("class", "axis x").attr("transform", `translate(0,${box.bottom})`).call(ticksOf(d3.axisBottom, x));
  svg.append("g").attr("class", "axis y").attr("transform", `translate(${box.left},0)`).call(ticksOf(d3.axisLeft, y));
  svg.append("text").attr("x", (box.left + box.right) / 2).attr("y", box.bottom + 38).attr("text-anchor", "middle")
    .text("time, logarithmic");
  svg.append("text").attr("transform", `translate(16,${(box.top + box.bottom) / 2}) rotate(-90)`).attr("text-anchor", "middle")
    .text("error (NRMSE), logarithmic");
  if (y.axis.zero === null) return;
  const cut = y.scale(y.axis.zero * 1.6);
  svg.append("line").attr("class", "below-zero").attr("x1", box.left).attr("x2", box.right).attr("y1", cut).attr("y2", cut);
}

function drawFront(svg, x, y, box) {
  const front = points.filter((p) => p.front).sort((a, b) => a.measured.seconds - b.measured.seconds);
  if (!front.length) return;
  const corners = front.map((p) => [x.place(p.measured.seconds), y.place(p.measured.error)]);
  corners.unshift([corners[0][0], box.top]);
  corners.push([box.right, corners[corners.length - 1][1]]);
  svg.append("path").attr("class", "steps").attr("d", d3.line().curve(d3.curveStepAfter)(corners));
}

function drawPeers(svg, x, y) {
  const peers = svg.selectAll(".peer").data(doc.peers).enter().append("g").attr("class", "peer")
    .attr("transform", (peer) => `translate(${x.place(peer.seconds)},${y.place(peer.error)})`);
  peers.append("path").attr("d", "M-6,-6L6,6M-6,6L6,-6M0,-8V8");
  // Beside the mark, on the side where there is more room.
  const isRight = (peer) => x.place(peer.seconds) > kFrame.width / 2;
  peers.append("text").attr("x", (peer) => (isRight(peer) ? -10 : 10)).attr("y", -8)
    .attr("text-anchor", (peer) => (isRight(peer) ? "end" : "start")).text((peer) => peer.name);
  peers.append("title").text((peer) => `${peer.name}: ${secondsText(peer.seconds)}, error ${errorText(peer.error)}`);
}

function drawMarks(svg, x, y) {
  const known = (values) => values.seconds !== null && values.error !== null;
  const spot = (values) => [x.place(values.seconds), y.place(values.error)];
  const shown = points.filter(visible);
  svg.selectAll(".joined").data(shown.filter((p) => known(p.measured) && known(p.predicted))).enter().append("line")
    .attr("class", "joined").each(function (p) {
      const [a, b] = [spot(p.predicted), spot(p.measured)];
      d3.select(this).attr("x1", a[0]).attr("y1", a[1]).attr("x2", b[0]).attr("y2", b[1]);
    });
  svg.selectAll(".guess").data(shown.filter((p) => known(p.predicted))).enter().append("path").attr("class", "guess")
    .attr("data-index", (p) => p.index).attr("transform", (p) => `translate(${spot(p.predicted)})`)
    .attr("d", (p) => symbol(families.get(p.family).shape, 3.6)).attr("stroke", (p) => families.get(p.family).colour);
  const measured = shown.filter((p) => known(p.measured));
  const marks = svg.selectAll(".mark").data(measured).enter().append("g").attr("class", "mark")
    .attr("data-index", (p) => p.index).attr("transform", (p) => `translate(${spot(p.measured)})`);
  marks.filter((p) => p.chosen).append("circle").attr("class", "ring").attr("r", 11);
  marks.append("path").attr("class", "full").attr("d", (p) => symbol(families.get(p.family).shape, 6.2))
    .attr("fill", (p) => families.get(p.family).colour);
  const order = measured.slice().sort((a, b) => a.measured.seconds - b.measured.seconds);
  makeMarksAnswer(marks, order, (point, key) => following(order, point, key === "ArrowRight" || key === "ArrowDown" ? 1 : -1));
}

function drawScatter() {
  const { width, height } = kFrame;
  const box = { left: leftOf(layout.axes.error), right: width - kFrame.right, top: kFrame.top, bottom: height - kFrame.bottom };
  const x = logScale(layout.axes.seconds, [box.left, box.right]);
  const y = logScale(layout.axes.error, [box.bottom, box.top]);
  const svg = d3.select("#plot").html("").append("svg").attr("viewBox", `0 0 ${width} ${height}`)
    .attr("role", "group").attr("aria-label", "time against error, both logarithmic");
  drawAxes(svg, x, y, box);
  drawBudgets(svg, x, y, box);
  drawFront(svg, x, y, box);
  drawMarks(svg, x, y);
  drawPeers(svg, x, y);
  showSelection();
}
