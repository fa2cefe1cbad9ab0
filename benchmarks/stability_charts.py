#!/usr/bin/python3
"""Draws where methods fail and what edgewise does there, for docs/stability.md.

    EDGEWISE=build/release/bin/edgewise benchmarks/stability_charts.py [--out docs/stability] [NAME ...]

Each naive method is written out here in numpy, beside what the command gives for the same samples. NAMEs choose some of
the charts. Needs numpy and matplotlib; script/setup --bench installs both.
"""
import argparse
import json
import pathlib
import sys

import matplotlib
import numpy as np
from drawing import NAIVE, OTHER, OURS, ROOT, edgewise, folder, panels, rms, save
from driving import grid, turn, via
from stability_shears import bottleneck, decomposition, half_turn, hills


# ---- rays ------------------------------------------------------------------------------------

def transfer(points):
    file = folder / "transfer.json"
    file.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": [c] * 3} for v, a, c in points],
                                "unit": 1}))
    return ["--mode", "composite", "--transfer", file]


def opacity():
    figure, (left, right) = panels(2)
    steps = [2, 1, 0.5, 0.25, 0.125, 0.0625]
    samples = np.ones((8, 3, 3), "f4")
    naive = [1 - (1 - 0.12) ** (8 / step) for step in steps]
    ours = [edgewise("render", samples, *transfer([(0, 0.12, 1)]),
                     *via(f"project.ray_cast/filter=foh/step={step}"))[0].flat[0] for step in steps]
    left.plot(steps, naive, label="opacity a sample, not corrected", **NAIVE)
    left.plot(steps, ours, label="edgewise: 1 - (1 - a)^step", **OURS)
    left.set(xscale="log", xlabel="step [voxel]", ylabel="opacity of 8 voxels of 0.12", ylim=(0, 1.05))
    left.set_xticks(steps, ["2", "1", "1/2", "1/4", "1/8", "1/16"])
    left.set_xticks([], minor=True)
    left.invert_xaxis()
    left.legend(loc="lower right")
    alphas = np.array([0.01, 0.1, 0.25, 0.5, 1, 1.5, 2])
    naive, ours = [], []
    for alpha in alphas:
        naive.append(sum(alpha * np.exp(-alpha * i) for i in range(64)))  # emission alpha, attenuation exp(-alpha)
        medium = transfer([(0, float(-np.expm1(-alpha)), 1)])
        ours.append(edgewise("render", np.ones((64, 3, 3), "f4"), *medium,
                             *via("project.ray_cast/filter=foh/step=1"))[0].flat[0])
    right.plot(alphas, naive, label="emission a, attenuation exp(-a): EQ 60, 61", **NAIVE)
    right.plot(alphas, ours, label="edgewise: emission 1 - exp(-a)", **OURS)
    right.axhline(1, color="black", linewidth=0.8)
    right.set(xlabel="extinction a [1/voxel]", ylabel="light of 64 voxels that shine with 1", ylim=(0, 2.5))
    right.legend(loc="upper left")
    right.set_ylim(0, 3)
    return figure


def thin_transfer():
    figure, (axis,) = panels(1, 5.5)
    z, y, x = np.indices((24, 24, 24))
    samples = ((x + 2 * y + 20 * z) / 520).astype("<f4")
    cases = {"wide peak (7 voxels)": [(0.23, 0, 1), (0.36, 0.3, 1), (0.5, 0, 1)],
             "thin peak (0.4 voxels)": [(0.492, 0, 1), (0.5, 0.9, 1), (0.508, 0, 1)]}
    for (label, points), color in zip(cases.items(), (OURS["color"], NAIVE["color"])):
        steps, predicted, measured = [2, 1, 0.5, 0.25], [], []  # the reference has 1/8
        for step in steps:
            _, report = edgewise("render", samples, *transfer(points), "--reference", "linear", "--range", 1,
                                 "--max-error", 9, "--verify=all", *via(f"project.ray_cast/filter=foh/step={step}"))
            predicted.append(report["plan"]["predicted"]["error"])
            measured.append(report["measured"]["error"]["nrmse"])
        axis.loglog(steps, np.maximum(measured, 1e-6), color=color, marker="o", label=f"{label}: measured")
        axis.loglog(steps, np.maximum(predicted, 1e-6), color=color, linestyle=":", label="predicted")
    axis.axhline(0.03, color="black", linewidth=0.8)
    axis.annotate("an error of 0.03", (2, 0.03), (1.9, 0.034), fontsize=9)
    axis.set(xlabel="step of project.ray_cast [voxel]", ylabel="error of the picture", ylim=(1e-4, 1))
    axis.set_xticks([2, 1, 0.5, 0.25], ["2", "1", "1/2", "1/4"])
    axis.set_xticks([], minor=True)
    axis.invert_xaxis()
    axis.legend(loc="lower left")
    return figure


def cancellation():
    figure, (left, right) = panels(2)
    offsets = 4.0 ** np.arange(0, 10)  # f32 holds 2^18 to 1/32
    random = np.random.default_rng(7)
    detail = random.integers(0, 16, (64, 8, 8)) / 16
    truth = detail.std(0)
    naive, welford = [], []
    for offset in offsets:
        values = (detail + offset).astype("f4")
        count = np.float32(len(values))
        mean = values.sum(0, dtype="f4") / count
        square = (values * values).sum(0, dtype="f4") / count
        naive.append(rms(np.sqrt(np.maximum(square - mean * mean, 0)) - truth) / truth.mean())
        m, s = np.zeros((8, 8), "f4"), np.zeros((8, 8), "f4")
        for k, value in enumerate(values, 1):
            delta = value - m
            m = m + delta / np.float32(k)
            s = s + delta * (value - m)
        welford.append(rms(np.sqrt(s / count) - truth) / truth.mean())
    left.loglog(offsets, np.maximum(naive, 1e-8), label="E[x²] - E[x]², f32", **NAIVE)
    left.loglog(offsets, np.maximum(welford, 1e-8), label="Welford, f32", **OTHER)
    left.set(xlabel="offset below a detail of 1", ylabel="error of the standard deviation", ylim=(1e-8, 30))
    left.set_title("(no edge of edgewise has this mode yet)", fontsize=9)
    left.legend(loc="upper left")
    naive, ours = [], []
    exact = detail.sum(0)
    for offset in offsets:
        values = (detail + offset).astype("<f4")
        total = np.zeros((8, 8), "f4")
        for value in values:
            total = total + value
        naive.append(rms(total.astype("f8") - 64 * offset - exact) / np.ptp(exact))
        made, _ = edgewise("render", values, "--mode", "xray", "--zero", repr(float(offset)),
                           *via("project.ray_cast/filter=foh/step=1"))
        ours.append(rms(made - exact) / np.ptp(exact))
    right.loglog(offsets, np.maximum(naive, 1e-8), label="sum in f32, then less the offset", **NAIVE)
    right.loglog(offsets, np.maximum(ours, 1e-8), label="edgewise --zero OFFSET", **OURS)
    right.set(xlabel="offset below a detail of 1", ylabel="error of the integral [NRMSE]", ylim=(1e-8, 30))
    right.legend(loc="upper left")
    return figure


# ---- spectrum --------------------------------------------------------------------------------

def linear_slice_of_point(side, x, padding):
    """What linear interpolation of a spectrum, at the middle between its samples, leaves of a point at x and of its
    repetition one period away: cos^2 of the place, the triangle's transform."""
    place = (x - side / 2) / (side * padding)
    gain = np.sinc(place) ** 2
    ghost = np.sinc(1 - abs(place)) ** 2
    return gain, ghost


def ghosts():
    figure, (axis,) = panels(1, 7.5)
    side = 32
    places = np.array([16, 19, 22, 25, 27])
    far = (places - side / 2) / (side / 2)
    for padding, marker in ((1, "x"), (2, "+"), (4, "1")):
        found = [linear_slice_of_point(side, x, padding)[1] for x in places]
        axis.semilogy(far, np.maximum(found, 1e-9), color=NAIVE["color"], linestyle="--", marker=marker,
                      label=f"linear, padding {padding}" if padding > 1 else "linear, no padding")
    def picture(x, width, padding):
        samples = np.zeros((side,) * 3, "f4")
        samples[16, 16, x] = 1
        made, _ = edgewise("render", samples, "--mode", "xray", "--spacing", 1, "--size", "32x32", "--rotate", "0,0,0",
                           "--via", f"spectrum.forward/width={width}/padding={padding}", "--via",
                           "spectrum.slice/band=volume", "--without", "store")
        return made
    clean = {x: picture(x, 6, 2) for x in places}
    for (width, padding), marker in zip(((4, 1.25), (4, 1.5), (6, 1.25), (6, 1.5)), "os^v"):
        found = [np.abs(picture(x, width, padding) - clean[x]).max() for x in places]
        axis.semilogy(far, np.maximum(found, 1e-9), color=OURS["color"], marker=marker, markersize=4,
                      label=f"edgewise, {width} taps, padding {padding}")
    axis.set(xlabel="place of a point [half the field]", ylabel="largest ghost over the point", ylim=(3e-6, 1))
    axis.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    return figure


# ---- places ----------------------------------------------------------------------------------

def drift():
    figure, (axis,) = panels(1, 5.5)
    width, scale = 65536, 1.0003
    at = np.arange(width)
    exact = (at - (width - 1) / 2) / scale + (width - 1) / 2
    step = np.float32(1 / scale)
    added = np.cumsum(np.concatenate([[np.float32(exact[0])], np.full(width - 1, step)]).astype("f4"), dtype="f4")
    product = np.float32(exact[0]) + at.astype("f4") * step
    saw = np.tile(at % 64, (3, 1)).astype("<f4")
    made, _ = edgewise("warp", saw, "--scale", f"{scale},1", *via("warp.backward/filter=foh"))
    inside = (np.mod(exact, 64) > 1) & (np.mod(exact, 64) < 62) & (exact > 1) & (exact < width - 2)
    errors = {"x += dx in f32": np.abs(added - exact), "x0 + i dx in f32": np.abs(product - exact),
              "edgewise (rows from f64)": np.abs(made[1] - np.mod(exact, 64))}
    for (label, error), style in zip(errors.items(), (NAIVE, OTHER, OURS)):
        blocks = np.where(inside, error, 0).reshape(32, -1).max(1)
        axis.semilogy(at.reshape(32, -1)[:, -1], np.maximum(blocks, 1e-7), label=label, **style)
    axis.axhline(1 / 512, color="black", linewidth=0.8)
    axis.annotate("1/512 sample", (0, 1 / 512), (0, 1 / 420), fontsize=9)
    axis.set(xlabel="column", ylabel="largest error of a place [sample]")
    axis.legend(loc="center right", bbox_to_anchor=(1, 0.25))
    return figure


def recursive_prefilter(row):
    """Causal and anticausal recursions of the cubic B-spline, along one row."""
    pole = np.sqrt(3) - 2
    now = row.astype("f8") * 6
    for i in range(1, len(now)):
        now[i] += pole * now[i - 1]
    now[-1] *= pole / (pole - 1)
    for i in range(len(now) - 2, -1, -1):
        now[i] = pole * (now[i + 1] - now[i])
    return now


def not_a_number():
    figure, axes = panels(3, 2.9, 3.6)
    size = 24
    samples = hills(grid((size, size)), size).astype("<f4")
    samples[9, 14] = np.nan
    rows = np.array([recursive_prefilter(row) for row in samples])
    both = np.array([recursive_prefilter(column) for column in rows.T]).T
    made, report = edgewise("warp", samples, "--rotate", 20, "--minimize", "error")
    steps = ", ".join(step["transition"] for step in report["plan"]["steps"])
    pictures = {"one NaN among the samples": samples, "cubic spline, prefiltered": both,
                f"edgewise takes {steps}": made}
    for axis, (title, picture) in zip(axes, pictures.items()):
        bad = ~np.isfinite(picture)
        grey = 1 - np.repeat(np.where(bad, 0, np.clip(picture, 0, 1.1))[..., None] / 1.2, 3, 2)
        axis.imshow(np.where(bad[..., None], matplotlib.colors.to_rgb(NAIVE["color"]), grey))
        axis.set_title(title, fontsize=9)
        axis.set_xlabel(f"{bad.sum()} of {bad.size} are NaN")
        axis.set(xticks=[], yticks=[])
        axis.grid(False)
    return figure


def condition():
    figure, (axis,) = panels(1, 5.5)
    samples = hills(grid((32, 32)), 32).astype("<f4")
    powers, errors, ends = np.arange(0, 17, 0.5), [], []
    for power in powers:
        linear = turn(30) @ np.diag([1, 10.0 ** -power]) @ turn(-30)
        point = np.array([11.0, -7.0])
        back = np.linalg.solve(linear.astype("f8"), linear @ point)
        errors.append(max(np.abs(back - point).max(), 1e-16))
        made, report = edgewise("warp", samples, "--matrix", ",".join(map(repr, map(float, linear.ravel()))))
        told = any("singular" in warning for warning in report.get("warnings", []))
        ends.append("refused (exit 2)" if made is None else "a warning" if told else "done")
    axis.loglog(10.0 ** powers, errors, color="black", linewidth=0.8, label="f64: a point there and back")
    for what, style in (("done", OURS), ("a warning", OTHER), ("refused (exit 2)", NAIVE)):
        chosen = [i for i, end in enumerate(ends) if end == what]
        axis.loglog(10.0 ** powers[chosen], np.array(errors)[chosen], label=f"edgewise: {what}",
                    **{**style, "linestyle": "none", "markersize": 6})
    axis.set(xlabel="condition of the matrix", ylabel="error of a place [sample]")
    axis.legend(loc="upper left")
    return figure


def horizon():
    figure, axes = panels(3, 2.9, 3.1)
    size = 96
    y, x = np.indices((size, size))
    samples = (((x // 8 + y // 8) % 2) * 0.6 + 0.2 + 0.2 * (x > size / 2)).astype("<f4")
    matrix = np.array([[1, 0, 0], [0, 1, 0], [0.0, 0.08, 1]])
    at = grid((size, size))
    u, v, w = np.einsum("ij,jyx->iyx", np.linalg.inv(matrix), np.stack([at[0], at[1], np.ones((size, size))]))
    with np.errstate(all="ignore"):
        i, j = [np.nan_to_num(np.rint(p / w + (size - 1) / 2), nan=-1, posinf=-1, neginf=-1) for p in (u, v)]
    inside = (i >= 0) & (j >= 0) & (i < size) & (j < size)
    # A reading that does not look at the sign of w.
    folded = np.where(inside, samples[np.clip(j, 0, size - 1).astype(int), np.clip(i, 0, size - 1).astype(int)], 0)
    made, _ = edgewise("warp", samples, "--matrix", ",".join(map(repr, map(float, matrix.ravel()))),
                       *via("warp.backward/filter=zoh"))
    where = np.argmin(np.abs(w[:, 0]))
    for axis, (title, picture) in zip(axes, (("samples", samples), ("divided by any w", folded),
                                             ("edgewise: w ≤ 0 is outside", made))):
        axis.imshow(picture, cmap="Greys_r", vmin=0, vmax=1, interpolation="nearest")
        axis.set_title(title, fontsize=9)
        axis.set(xticks=[], yticks=[])
        axis.grid(False)
        if picture is not samples and 0 < where < size - 1:
            axis.axhline(where, color=NAIVE["color"], linewidth=1)
            axis.annotate("w = 0", (2, where - 2), color=NAIVE["color"], fontsize=9)
    return figure


CHARTS = {function.__name__: function for function in (
    decomposition, half_turn, bottleneck, opacity, thin_transfer, cancellation, ghosts, drift, not_a_number, condition,
    horizon)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/stability")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(CHARTS))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.names or CHARTS:
        if name not in CHARTS:
            sys.exit(f"{name}: none of {', '.join(CHARTS)}")
        save(CHARTS[name](), options.out / f"{name}.svg")


if __name__ == "__main__":
    main()
