#!/usr/bin/python3
"""Draws where methods fail and what edgewise does there, for docs/stability.md.

    EDGEWISE=build/release/bin/edgewise benchmarks/stability_charts.py [--out docs/stability] [NAME ...]

Each naive method is written out here in numpy, beside what the command gives for the same samples. NAMEs choose some of
the charts. Needs numpy and matplotlib; script/setup --bench installs both.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

try:
    import matplotlib
except ImportError:
    sys.exit("needs matplotlib; script/setup --bench installs it")
matplotlib.use("svg")
matplotlib.rcParams.update({"svg.hashsalt": "edgewise", "svg.fonttype": "none", "font.family": "sans-serif",
                            "font.size": 10, "axes.grid": True, "grid.alpha": 0.3, "legend.fontsize": 9,
                            "axes.spines.top": False, "axes.spines.right": False})
from matplotlib import pyplot as plt  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/stability"))
from driving import grid, numbered, read_nrrd, seen_at, sites, turn, turn3, via, write_nrrd  # noqa: E402

EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
NAIVE = {"color": "#c44e00", "marker": "x", "linestyle": "--", "markersize": 4}
OURS = {"color": "#00509e", "marker": "o", "linestyle": "-", "markersize": 3.5}
OTHER = {"color": "#5a7d2a", "marker": "^", "linestyle": ":", "markersize": 4}
folder = pathlib.Path(tempfile.mkdtemp())


def edgewise(verb, samples, *words):
    """The result, and the report."""
    write_nrrd(folder / "in.nrrd", samples)
    done = subprocess.run([EDGEWISE, verb, folder / "in.nrrd", "-o", folder / "out.nrrd", *map(str, words), "--json",
                           "-", "--quiet"], capture_output=True, text=True)
    report = json.loads(done.stdout) if done.stdout else {}
    if done.returncode:
        return None, report
    return read_nrrd(folder / "out.nrrd"), report


def rms(values):
    return float(np.sqrt(np.mean(np.square(values, dtype="f8"))))


def panels(count, width=4.2, height=3.3):
    figure, axes = plt.subplots(1, count, figsize=(width * count, height), layout="constrained")
    return figure, np.atleast_1d(axes)


# ---- decompositions into shears --------------------------------------------------------------

def rounded(value):
    return np.floor(value + 0.5)


def three_rounded_shears(points, degrees):
    """EQ 10 with a rounding after each shear, for any angle."""
    a, b = -np.tan(np.deg2rad(degrees) / 2), np.sin(np.deg2rad(degrees))
    x, y = points
    x = x + rounded(a * y)
    y = y + rounded(b * x)
    return np.stack([x + rounded(a * y), y])


def moved(samples, linear, words):
    """Largest displacement of sites that the rule of warp.permutation sends to the inside."""
    made, _ = edgewise("warp", samples, *words, *via("warp.permutation/filter=me"))
    asked = seen_at(samples.shape, linear)
    inner = np.all([np.abs(at) < (n - 1) / 2 - 3 for at, n in zip(asked, samples.shape[::-1])], 0)
    return np.abs(sites(made[inner], samples.shape) - asked[:, inner]).max()


def four_shears_bound(m):
    """Displacement of x += py + qz, y += rx + sz, z += tx + uy, x += vy + wz, in that order, without a turn."""
    with np.errstate(all="ignore"):
        r = m[1, 0]
        p = (m[1, 1] - 1) / r
        u = m[2, 1] - p * m[2, 0]
        t = m[2, 0] - u * r
        q = (m[2, 2] - 1 - u * m[1, 2]) / t
        s = m[1, 2] - r * q
        last = s * t - r
        return 0.5 * max(1 + abs(p) + abs(p * s - q) + abs(1 - p * last + q * t), 1 + abs(s) + abs(last), 1 + abs(t))


def decomposition():
    figure, (left, right) = panels(2)
    points = np.stack(np.meshgrid(np.arange(-60.0, 61), np.arange(-60.0, 61)))
    angles = np.concatenate([np.arange(3, 180, 6), [175, 178, 179, 179.5]])
    angles.sort()
    naive = []
    for degrees in angles:
        back = np.einsum("ij,jyx->iyx", turn(-degrees), three_rounded_shears(points, degrees))
        naive.append(np.abs(back - points).max())
    ours = [moved(numbered((101, 101)), turn(d), ["--rotate", repr(float(d))]) for d in angles]
    left.semilogy(angles, naive, label="three rounded shears, EQ 10", **NAIVE)
    left.semilogy(angles, ours, label="edgewise: quarter turn first", **OURS)
    left.axhline(1.0674, color="black", linewidth=0.8)
    left.annotate("bound 1.067", (0, 1.0674), (0, 1.3), fontsize=9)
    left.set(xlabel="turn of an image [degree]", ylabel="largest displacement [sample]", ylim=(0.6, 300))
    left.legend(loc="upper left")
    random = np.random.default_rng(3)
    turns = random.uniform(-180, 180, (40, 3))
    naive = [four_shears_bound(turn3(*t)) for t in turns]
    ours = [moved(numbered((30, 31, 32)), turn3(*t), ["--rotate", ",".join(map(repr, map(float, t)))]) for t in turns]
    order = np.argsort(naive)
    right.semilogy(np.array(naive)[order], label="four shears in a fixed order", **NAIVE)
    right.semilogy(np.array(ours)[order], label="edgewise: best of 24 turns, 6 orders", **OURS)
    right.axhline((3 + np.sqrt(2)) / 4, color="black", linewidth=0.8)
    right.annotate("bound 1.104", (0, 1.104), (0, 0.72), fontsize=9)
    right.set(xlabel="40 random turns of a volume, sorted", ylabel="largest displacement [voxel]", ylim=(0.6, None))
    right.legend(loc="upper left")
    return figure


def shift_row(row, by):
    """Linear interpolation, 0 outside."""
    at = np.arange(len(row)) - by
    return np.interp(at, np.arange(len(row)), row, left=0, right=0)


def naive_shears(image, degrees, pad):
    """Three linear passes of EQ 10 on a canvas that holds what leaves the image."""
    a, b = -np.tan(np.deg2rad(degrees) / 2), np.sin(np.deg2rad(degrees))
    now = np.pad(image, pad)
    centre = (now.shape[0] - 1) / 2
    for by, transpose in ((a, False), (b, True), (a, False)):
        now = now.T if transpose else now
        now = np.stack([shift_row(row, by * (i - centre)) for i, row in enumerate(now)])
        now = now.T if transpose else now
    return now[pad:-pad, pad:-pad]


def hills(at, size):
    x, y = at[0] / size, at[1] / size
    return (np.exp(-40 * ((x - 0.11) ** 2 + 2 * (y + 0.07) ** 2))
            + 0.6 * np.exp(-60 * ((x + 0.15) ** 2 + (y - 0.12) ** 2)))


def half_turn():
    figure, (left, right) = panels(2)
    t = np.linspace(0.5, 179.5, 400)
    residual = t - 90 * np.round(t / 90)
    left.semilogy(t, np.tan(np.deg2rad(t) / 2), color=NAIVE["color"], linestyle="--", label="tan(t/2)")
    left.semilogy(t, np.abs(np.tan(np.deg2rad(residual) / 2)) + 1e-9, color=OURS["color"],
                  label="after the nearest quarter turn")
    left.axhline(np.tan(np.pi / 8), color="black", linewidth=0.8)
    left.annotate("0.414", (1, np.tan(np.pi / 8)), (1, 0.5), fontsize=9)
    left.set(xlabel="turn t [degree]", ylabel="shear [sample a line]", ylim=(1e-2, 300))
    left.legend(loc="upper left")
    size, shape = 64, (64, 64)
    samples = hills(grid(shape), size)
    angles = [10, 45, 60, 120, 150, 165, 175, 178, 179, 179.9]
    naive, ours = [], []
    for degrees in angles:
        truth = hills(seen_at(shape, turn(degrees)), size)
        naive.append(rms(naive_shears(samples, degrees, 400) - truth) / np.ptp(samples))
        made, _ = edgewise("warp", samples.astype("<f4"), "--rotate", degrees, *via("warp.shear/filter=foh"))
        ours.append(rms(made - truth) / np.ptp(samples))
    right.semilogy(180 - np.array(angles), naive, label="three linear passes, EQ 10", **NAIVE)
    right.semilogy(180 - np.array(angles), np.maximum(ours, 1e-8), label="warp.shear/filter=foh", **OURS)
    right.set(xscale="log", xlabel="180 - turn [degree]", ylabel="error [NRMSE]", ylim=(1e-6, 1))
    right.invert_xaxis()
    right.legend(loc="lower left")
    return figure


def two_passes(image, degrees):
    """Catmull and Smith: first along rows, where lines shrink by cos t, then along columns."""
    size = image.shape[0]
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    u = np.arange(size) - (size - 1) / 2
    middle = np.empty_like(image)
    for i, row in enumerate(image):  # x' = c x - s y: where was x, given x' and y
        middle[i] = np.interp((u + s * u[i]) / c, u, row, left=0, right=0)
    made = np.empty_like(image)
    for j in range(size):  # y' = s x + c y with x = (x' + s y) / c, so y = y' c - x' s
        made[:, j] = np.interp(c * u - s * u[j], u, middle[:, j], left=0, right=0)
    return made


def bottleneck():
    figure, (axis,) = panels(1, 5.5)
    size, shape = 64, (64, 64)
    samples = hills(grid(shape), size)
    angles = [5, 15, 30, 45, 60, 70, 80, 85, 88, 89, 89.5]
    curves = {"two passes, rows first": [], "the same behind a transposition": [], "warp.shear/filter=foh": []}
    for degrees in angles:
        truth = hills(seen_at(shape, turn(degrees)), size)
        values = list(curves.values())
        values[0].append(rms(two_passes(samples, degrees) - truth) / np.ptp(samples))
        values[1].append(rms(two_passes(np.rot90(samples, -1), degrees - 90) - truth) / np.ptp(samples))
        made, _ = edgewise("warp", samples.astype("<f4"), "--rotate", degrees, *via("warp.shear/filter=foh"))
        values[2].append(rms(made - truth) / np.ptp(samples))
    for (label, values), style in zip(curves.items(), (NAIVE, OTHER, OURS)):
        axis.semilogy(angles, values, label=label, **style)
    axis.set(xlabel="turn [degree]", ylabel="error [NRMSE]", ylim=(1e-4, 1))
    axis.legend(loc="upper left")
    return figure


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
    axis.annotate("default budget", (2, 0.03), (1.9, 0.034), fontsize=9)
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
        figure = CHARTS[name]()
        figure.savefig(options.out / f"{name}.svg", metadata={"Date": None})
        plt.close(figure)


if __name__ == "__main__":
    main()
