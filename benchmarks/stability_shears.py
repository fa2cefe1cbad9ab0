"""Charts of stability_charts.py: decompositions into shears, in numpy and by the command."""
import numpy as np
from drawing import NAIVE, OTHER, OURS, edgewise, panels, rms
from driving import grid, numbered, seen_at, sites, turn, turn3, via


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
