// All paths as a table that sorts, and the page's start.

const columns = [
  { name: "#", value: (p) => p.index, text: (p) => p.index },
  { name: "path", value: pathText, text: pathText, button: true },
  ...(isSweep ? [{ name: "line", value: (p) => courseOf.get(p)?.number || null, text: (p) => courseOf.get(p)?.number || "" }] : []),
  ...(isSweep ? [{ name: doc.sweep.option, value: (p) => p.at, text: (p) => p.at }] : []),
  { name: "predicted time", value: (p) => p.predicted.seconds, text: (p) => secondsText(p.predicted.seconds) },
  { name: "measured time", value: (p) => p.measured.seconds, text: (p) => secondsText(p.measured.seconds) },
  { name: "predicted error", value: (p) => p.predicted.error, text: (p) => plainError(p.predicted.error), more: (p) => decibelText(p.predicted.error) },
  { name: "measured error", value: (p) => p.measured.error, text: (p) => plainError(p.measured.error), more: (p) => decibelText(p.measured.error) },
  { name: "predicted memory", value: (p) => p.predicted.bytes, text: (p) => bytesText(p.predicted.bytes) },
  { name: "measured memory", value: (p) => p.measured.bytes, text: (p) => bytesText(p.measured.bytes) },
  { name: "front", value: (p) => (p.front ? 0 : 1), text: (p) => (p.front ? "●" : "") },
  { name: "chosen", value: (p) => (p.chosen ? 0 : 1), text: (p) => (p.chosen ? "●" : "") },
];
const sorting = { column: columns.findIndex((column) => column.name === "measured time"), down: false };

/** What is not known comes last, either way. */
function compare(a, b) {
  const value = columns[sorting.column].value;
  const [u, v] = [value(a), value(b)];
  if (u === null || v === null) return (u === null) - (v === null) || a.index - b.index;
  return (sorting.down ? d3.descending(u, v) : d3.ascending(u, v)) || a.index - b.index;
}

function drawTable() {
  const table = d3.select("#table").html("");
  const heads = table.append("thead").append("tr").selectAll("th").data(columns).enter().append("th").attr("scope", "col")
    .attr("aria-sort", (_, i) => (i === sorting.column ? (sorting.down ? "descending" : "ascending") : "none"));
  heads.append("button").attr("type", "button").attr("data-column", (column) => column.name)
    .attr("title", (column) => `sort by ${column.name}`)
    .text((column, i) => column.name + (i === sorting.column ? (sorting.down ? " ▾" : " ▴") : ""))
    .on("click", (column, i) => {
      sorting.down = i === sorting.column && !sorting.down;
      sorting.column = i;
      drawTable();
      d3.select(`#table [data-column="${column.name}"]`).node().focus();
    });
  // On paper: a head that is repeated on every page shows no buttons.
  heads.append("span").attr("class", "paper").attr("aria-hidden", true).text((column) => column.name);
  const rows = table.append("tbody").selectAll("tr").data(points.filter(visible).sort(compare)).enter().append("tr")
    .attr("data-index", (p) => p.index).classed("selected", (p) => p.index === state.selected)
    .on("click", function (p) { select(p.index, this.querySelector("button")); });
  for (const column of columns) {
    const cells = rows.append("td");
    (column.button ? cells.append("button").attr("type", "button").attr("title", "show this path") : cells).text(column.text);
    if (column.more) cells.append("span").attr("class", "decibel").text(column.more);
  }
  makeRowsAnswer(rows);
}

/** All rows are one stop of the Tab key; arrows, Home and End lead from row to row. */
function makeRowsAnswer(rows) {
  const buttons = rows.selectAll("button").nodes();
  const stop = (button) => buttons.forEach((other) => { other.tabIndex = other === button ? 0 : -1; });
  stop(buttons[0]);
  buttons.forEach((button) => {
    button.addEventListener("focus", () => stop(button));
    button.addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      const ends = { Home: buttons[0], End: buttons[buttons.length - 1] }[event.key];
      if (!step && !ends) return;
      (ends || following(buttons, button, step)).focus();
      event.preventDefault();
    });
  });
}

function draw() {
  if (isSweep) drawSweep();
  else drawScatter();
  drawTable();
}

makeHeader();
makeTheme();
makeEscape();
makeFamilies(draw);
document.body.classList.toggle("sweep", isSweep);
if (isSweep) makeCourses();
draw();
takeHash();
addEventListener("hashchange", takeHash);
