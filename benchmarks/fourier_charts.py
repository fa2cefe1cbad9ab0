#!/usr/bin/python3
"""When the way through the Fourier transform pays: three charts. For docs/spectrum.md and docs/thesis_graphs.md.

    EDGEWISE=build/release/bin/edgewise benchmarks/fourier_charts.py [views] [dilation] [product]

views:     seconds of X-rays through a spectrum and by casting, over the number of views, by size and by the error asked for.
dilation:  seconds of a dilation by a disc, over its diameter, directly and through transforms of levels.
product:   operations of a matrix product, over its size, directly and through a transform; build/release/bin/product_by_transform
           counts them.
Seconds are medians of runs on one thread. Prints a Markdown table for each chart. Needs numpy and matplotlib; script/setup
--bench installs both. Run it on a quiet machine.
"""
import argparse
import math
import pathlib
import re
import statistics
import subprocess
import sys

import numpy as np
from break_even import WAYS, crossing, line_through, number, path_of, request, run
from drawing import EDGEWISE, ROOT, edgewise, panels, save

COLOURS = {1e-2: "#5a7d2a", 1e-3: "#00509e", 1e-4: "#c44e00"}
FEW, MANY = 1, 25


def line_of(options, side, error, way):
    """Start and seconds a view of the path that is planned for many views."""
    options.error = error
    words = request(options, side, MANY, way)
    planned = run("plan", *words)
    seconds = {}
    for views in (FEW, MANY):
        base = request(options, side, views, way)
        base = base[:base.index("--via")]
        base[base.index("--max-error") + 1] = 10  # one view alone may have a little more
        steps = sum((["--via", step] for step in path_of(planned).split(" > ")), [])
        report = run(*base, *steps, "-o", "null:", "--repeat", options.repeat, "--verify")
        seconds[views] = statistics.median(report["measured"]["seconds"])
    return line_through(seconds), report["measured"]["error"]["nrmse"], path_of(planned)


def measured_views(options):
    """Rows of the table: side, error, start and seconds a view of either way, views from which on the spectrum pays."""
    print("| side | error asked for | spectrum: start + each view [ms] | error | casting | error | from views on |\n"
          "|---|---|---|---|---|---|---|")
    for side in options.sides:
        for error in COLOURS:
            lines, errors = {}, {}
            for way in WAYS:
                lines[way], errors[way], path = line_of(options, side, error, way)
                print(f"{side}, {error}, {way}: {path}", file=sys.stderr)
            said = {way: "{:.0f} + {:.1f}".format(*(1e3 * part for part in lines[way])) for way in WAYS}
            print(f"| {side} | {error:.0e} | {said['spectrum']} | {errors['spectrum']:.1e} | {said['cast']} | "
                  f"{errors['cast']:.1e} | {number(crossing(lines['spectrum'], lines['cast']))} |", flush=True)
            yield side, error, lines


def printed_views(file):
    """The same from a table that was printed before."""
    for line in file.read_text().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 7 and cells[0].isdigit():
            lines = {way: [1e-3 * float(part) for part in cells[at].split(" + ")] for way, at in (("spectrum", 2), ("cast", 4))}
            yield int(cells[0]), float(cells[1]), lines


def views_chart(options):
    rows = list(printed_views(options.table) if options.table else measured_views(options))
    sides = sorted({side for side, _, _ in rows})
    figure, axes = panels(len(sides), 4.6, 3.8)
    at = np.unique(np.round(np.logspace(0, 3, 100)))
    for side, error, lines in rows:
        axis = axes[sides.index(side)]
        for way in WAYS:
            start, each = lines[way]
            axis.loglog(at, max(0, start) + each * at, "-" if way == "spectrum" else "--", color=COLOURS[error],
                        label=f"{way}, {error:.0e}")
        pays = crossing(lines["spectrum"], lines["cast"])
        if 1 < pays < at[-1]:
            axis.plot(pays, lines["spectrum"][0] + pays * lines["spectrum"][1], "o", color="black", markersize=4)
        axis.set(title=f"{side}³ samples", xlabel="views")
    axes[0].set(ylabel="seconds, one thread")
    axes[0].legend(fontsize=7)
    save(figure, ROOT / "docs/spectrum/views.svg")


def steps_image(side, levels):
    """Soft noise in a number of equal steps, u8."""
    random = np.random.default_rng(5)
    f = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side))
    soft = np.fft.irfft2(np.fft.rfft2(random.standard_normal((side, side))) * np.exp(-(f / 0.03) ** 2), (side, side))
    ranks = soft.ravel().argsort().argsort().reshape(side, side)
    return np.ascontiguousarray((ranks * levels // side ** 2).astype("u1").T)


def dilation_chart(options):
    figure, axes = panels(1, 5.6, 4)
    ways = {"filter.backward": ("direct, backward", {"color": "#c44e00", "marker": "x"}),
            "filter.runs": ("direct, by runs", {"color": "#5a7d2a", "marker": "^"}),
            "filter.fourier_levels": ("through the transform", {"color": "#00509e", "marker": "o"})}
    seen = {}  # pictures by levels and diameter
    diameters = [3, 7, 11, 17, 25, 37, 51, 75, 101]
    print("| levels | edge | " + " | ".join(map(str, diameters)) + " |\n|---|---|" + "---|" * len(diameters))
    for levels, line in ((2, "-"), (16, ":")):
        image = steps_image(512, levels)
        for edge, (label, style) in ways.items():
            if edge != "filter.fourier_levels" and levels != 2:
                continue  # what they take does not depend on levels
            seconds, answers = [], []
            for diameter in diameters:
                made, report = edgewise("filter", image, "--op", "dilate", "--kernel", f"sphere:{diameter // 2}", "--via",
                                        edge, "--threads", 1, "--repeat", options.repeat, "--max-error", 10)
                if made is None:
                    sys.exit(f"{edge}, {diameter}: {report.get('error')}")
                seconds.append(statistics.median(report["measured"]["seconds"]))
                answers.append(made)
            for diameter, made in zip(diameters, answers):
                if not np.array_equal(seen.setdefault((levels, diameter), made), made):
                    sys.exit(f"{edge}, {diameter}: another picture")
            what = f"{label}, {levels} levels" if edge == "filter.fourier_levels" else label
            axes[0].loglog(diameters, seconds, line, label=what, markersize=4, **style)
            print(f"| {levels if 'levels' in edge else 'any'} | `{edge}` | " +
                  " | ".join(f"{1e3 * s:.1f}" for s in seconds) + " |", flush=True)
    axes[0].set(xlabel="diameter of the disc [pixel]", ylabel="seconds, one thread", title="dilation of 512² pixels")
    axes[0].legend(fontsize=8)
    save(figure, ROOT / "docs/graphs/dilation.svg")


def product_chart(_options):
    program = pathlib.Path(EDGEWISE).parent / "product_by_transform"
    said = subprocess.run([program], capture_output=True, text=True).stdout
    counted = {int(n): int(times) for n, times in re.findall(r"(\d+) x \d+ *, rows to 1/1e\+00: *(\d+) times", said)}
    sizes = np.arange(2, 257)
    direct = 2.0 * sizes ** 3
    figure, axes = panels(1, 5.6, 4)
    axes[0].loglog(sizes, sizes ** 3.0 * (22.5 * np.log2(sizes) + 3), color="#00509e", label="through the transform")
    axes[0].loglog(sizes, direct, color="#c44e00", label="row by column")
    shown = sorted(n for n in counted if n > 1)
    axes[0].loglog(shown, [2.0 * n ** 3 * counted[n] for n in shown], "o", color="#00509e", markersize=4,
                   label="counted by the example")
    axes[0].set(xlabel="rows of square matrices", ylabel="operations", title="matrix product")
    axes[0].legend(fontsize=8)
    save(figure, ROOT / "docs/graphs/product.svg")
    print("| n | operations, over 2 n^3 |\n|---|---|")
    for n in shown:
        print(f"| {n} | {counted[n]} |")
        if abs(counted[n] - (22.5 * math.log2(n) + 3) / 2) > 1:
            sys.exit(f"{n}: another count")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("charts", nargs="*", default=["views", "dilation", "product"])
    parser.add_argument("--sides", default="128,256")
    parser.add_argument("--phantom", default="gaussians")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--machine")
    parser.add_argument("--table", type=pathlib.Path, help="a table of views that was printed before: only drawn")
    options = parser.parse_args()
    options.sides = [int(side) for side in options.sides.split(",")]
    for chart in options.charts:
        {"views": views_chart, "dilation": dilation_chart, "product": product_chart}[chart](options)


if __name__ == "__main__":
    main()
