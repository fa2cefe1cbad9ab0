// What a selected path took, and its picture beside the reference.

const pictures = layout.pictures;
let basePlane = null;

/** Red, green, blue and alpha of every pixel of an embedded PNG. */
function pixelsOf(uri) {
  return new Promise((resolve, reject) => {
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      canvas.width = image.width;
      canvas.height = image.height;
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.drawImage(image, 0, 0);
      resolve(context.getImageData(0, 0, image.width, image.height).data);
    };
    image.onerror = reject;
    image.src = uri;
  });
}

/** The values that all differences are against; planes of channels below each other. */
async function base() {
  if (basePlane) return basePlane;
  const pixels = await pixelsOf(pictures.base);
  const { low, high } = pictures;
  basePlane = Float64Array.from({ length: pixels.length / 4 },
    (_, i) => low + ((high - low) * (256 * pixels[4 * i] + pixels[4 * i + 1])) / 65535);
  return basePlane;
}

/** Differences of a path to the base [value]; NaN where its result is not finite. */
async function differenceOf(index) {
  const { png, scale } = pictures.differences[index];
  const pixels = await pixelsOf(png);
  return Float64Array.from({ length: pixels.length / 4 }, (_, i) => {
    const code = pixels[4 * i] - 128;
    return code === -128 ? NaN : Math.sign(code) * scale * (code / pictures.levels) ** 2;
  });
}

/** Blue below, nothing at none, red above: on dark, on light and on paper. */
function signedColour(share) {
  return [...(share < 0 ? [32, 110, 210] : [220, 62, 28]), 255 * Math.min(1, Math.abs(share))];
}

function paint(canvas, colourOf) {
  canvas.width = pictures.width;
  canvas.height = pictures.height;
  const context = canvas.getContext("2d");
  const image = context.createImageData(canvas.width, canvas.height);
  for (let i = 0; i < canvas.width * canvas.height; ++i) {
    const colour = colourOf(i);
    for (let c = 0; c < 4; ++c) image.data[4 * i + c] = colour[c];
  }
  context.putImageData(image, 0, 0);
}

const channel = (plane, i, c) => plane[i + c * pictures.width * pictures.height];

function paintValues(canvas, plane) {
  const grey = (v) => (Number.isFinite(v) ? (255 * (v - pictures.black)) / (pictures.white - pictures.black) : 0);
  const last = pictures.channels - 1;
  paint(canvas, (i) => [...[0, 1, 2].map((c) => grey(channel(plane, i, Math.min(c, last)))), 255]);
}

/** Of several channels the one that differs most. */
function paintDifference(canvas, plane, scale) {
  paint(canvas, (i) => {
    let most = 0;
    for (let c = 0; c < pictures.channels; ++c) {
      const d = channel(plane, i, c);
      if (!Number.isFinite(d)) return [255, 0, 255, 255];
      if (Math.abs(d) > Math.abs(most)) most = d;
    }
    return signedColour(most / scale);
  });
}

function largest(plane) {
  let most = 0;
  for (const d of plane) if (Number.isFinite(d)) most = Math.max(most, Math.abs(d));
  return most || 1;
}

function addFigure(where, name, text) {
  const figure = where.append("figure").attr("data-picture", name);
  const canvas = figure.append("canvas").attr("role", "img").attr("aria-label", text).node();
  figure.append("figcaption").text(text);
  return { figure, canvas };
}

function addDifference(where, name, text, plane) {
  const scale = largest(plane);
  const { figure, canvas } = addFigure(where, name, text);
  paintDifference(canvas, plane, scale);
  const legend = figure.append("div").attr("class", "scale");
  legend.append("span").text(`−${Number(scale.toPrecision(3))}`);
  const bar = legend.append("canvas").attr("aria-hidden", true).node();
  bar.width = 101;
  bar.height = 1;
  const context = bar.getContext("2d");
  for (let i = 0; i <= 100; ++i) {
    const [red, green, blue, alpha] = signedColour((i - 50) / 50);
    context.fillStyle = `rgb(${red} ${green} ${blue} / ${alpha / 255})`;
    context.fillRect(i, 0, 1, 1);
  }
  legend.append("span").text(`+${Number(scale.toPrecision(3))}`);
}

async function addPictures(where, point) {
  const chosen = points.find((p) => p.chosen && pictures.differences[p.index]);
  const [plane, own, of_chosen] = await Promise.all([
    base(), differenceOf(point.index), chosen ? differenceOf(chosen.index) : null]);
  if (shownIndex !== point.index) return;  // another one was selected meanwhile
  const grid = where.append("div").attr("class", "pictures");
  paintValues(addFigure(grid, "picture", "this path").canvas, own.map((d, i) => plane[i] + d));
  paintValues(addFigure(grid, "reference", pictures.base_is).canvas, plane);
  addDifference(grid, "difference", `this path − ${pictures.base_is} [value]`, own);
  if (of_chosen && chosen.index !== point.index)
    addDifference(grid, "chosen", "this path − the chosen one [value]", own.map((d, i) => d - of_chosen[i]));
  where.append("p").attr("class", "soft").text(pictures.note);
}

let shownIndex = null;

/** Of the selected path; where none is, of the chosen one, so that the place is not empty. */
function showDetail(point) {
  const selected = point !== null && state.selected === point.index;
  const where = d3.select("#detail").html("").classed("open", selected);
  shownIndex = point && point.index;
  const hint = "Select a mark or a row of the table: its steps, numbers and pictures appear here.";
  if (!selected) where.append("p").attr("class", "soft").text(hint);
  if (!point) return;
  const roles = [point.chosen ? "chosen by the planner" : "", point.front ? "on the front" : ""].filter(Boolean);
  where.append("h2").text(`Path ${point.index}${roles.length ? `: ${roles.join(", ")}` : ""}`);
  if (point.at !== undefined) where.append("p").text(`${doc.sweep.option} = ${point.at}`);
  const list = where.append("ol");
  for (const step of point.steps) list.append("li").text(step);
  if (point.failure) where.append("p").text(`no result: ${point.failure}`);
  const rows = [["time", secondsText, "seconds"], ["error", errorText, "error"], ["memory", bytesText, "bytes"]];
  const table = where.append("table");
  table.append("tr").selectAll("th").data(["", "predicted", "measured"]).enter().append("th").text((d) => d);
  for (const [name, text, key] of rows) {
    const row = table.append("tr");
    row.append("th").text(name);
    row.append("td").text(text(point.predicted[key]));
    row.append("td").text(text(point.measured[key]));
  }
  if (pictures && pictures.differences[point.index]) addPictures(where, point);
}
