"""FIGURES 75 to 77 and TABLES 21 and 22 of [W93] 4.6, made by the command and judged by the bodies' formulas in numpy.

A body of 128^3 samples of 16 bits is turned by one angle about x, y and z; the error of a ray is the sum along z of the
absolute differences to the body itself, turned exactly. The thesis's multipass are nine linear shears of one axis by another,
cut to whole numbers after each; `warp.shear/filter=foh` takes four, behind quarter turns, and rounds once.
"""
import numpy as np
from drawing import edgewise, matplotlib, plt, save
from driving import grid, turn3, via
from gallery_runs import DOCS

SIDE, WHITE = 128, 65535
ANGLES = np.arange(5, 90, 5)
# name in figures -> path, style of the line
FILTERS = {
    "zero-order hold": ("warp.backward/filter=zoh", {"color": "#c44e00", "marker": "x", "linestyle": "--"}),
    "multipass (linear shears)": ("warp.shear/filter=foh", {"color": "#5a7d2a", "marker": "^", "linestyle": ":"}),
    "trilinear": ("warp.backward/filter=foh", {"color": "#00509e", "marker": "o", "linestyle": "-"}),
    "cubic B-spline": ("filter.prefilter", {"color": "#7f3fbf", "marker": "s", "linestyle": "-."}),
}
PRINTED = {  # TABLE 22: mean and largest error of rays at 45 degrees
    ("zero-order hold", "cube"): (48372, 131070), ("zero-order hold", "sphere"): (3977, 41886),
    ("multipass (linear shears)", "cube"): (65028, 217719), ("multipass (linear shears)", "sphere"): (802, 10648),
    ("trilinear", "cube"): (48309, 172078), ("trilinear", "sphere"): (259, 3501),
}


def sphere(at):
    """Full in the centre, nothing at a radius of 32."""
    return WHITE * np.maximum(0, 1 - np.sqrt(np.sum(np.square(at), 0)) / 32)


def cube(at):
    """64 samples wide; the outermost belong to it."""
    return np.where(np.abs(at).max(0) <= 31.5, float(WHITE), 0.0)


BODIES = {"cube": cube, "sphere": sphere}


def turned_exactly(body, degrees):
    """The body at the place where each sample of the turned volume comes from."""
    back = np.linalg.inv(turn3(degrees, degrees, degrees))
    return body(np.einsum("ij,j...->i...", back, grid((SIDE,) * 3)))


def error_of(samples, truth, path, degrees):
    """What the command's turned volume differs by, sample by sample [16-bit intensity]."""
    angle = f"{degrees:g}"
    made, _ = edgewise("warp", samples, "--rotate", ",".join([angle] * 3), *via(path))
    return made.astype("f8") - truth


def along_rays(error):
    """Absolute and signed sums along z [y, x]."""
    return np.abs(error).sum(0), error.sum(0)


def sweep():
    """{(filter, body): [(mean, largest, absolute rays, signed rays) of each angle]}"""
    found = {}
    for name, body in BODIES.items():
        samples = np.rint(body(grid((SIDE,) * 3))).astype("<u2")
        for degrees in ANGLES:
            truth = turned_exactly(body, degrees)
            for filter_name, (path, _) in FILTERS.items():
                absolute, signed = along_rays(error_of(samples, truth, path, degrees))
                keep = (absolute, signed) if degrees == 45 else (None, None)
                found.setdefault((filter_name, name), []).append((absolute.mean(), absolute.max(), *keep))
    return found


def against_angle(found, body, number):
    figure, axes = plt.subplots(1, 2, figsize=(10.6, 3.6), layout="constrained")
    for axis, column, what in zip(axes, (1, 0), ("largest", "mean")):
        for name, (_, style) in FILTERS.items():
            values = [row[column] for row in found[name, body]]
            axis.semilogy(ANGLES, values, label=name, markersize=4, **style)
            if (name, body) in PRINTED:
                axis.plot(45, PRINTED[name, body][column], marker=style["marker"], markersize=10,
                          markerfacecolor="none", markeredgecolor="black", linestyle="none")
        axis.plot([], [], marker="o", markersize=10, markerfacecolor="none", markeredgecolor="black", linestyle="none",
                  label="printed in TABLE 22")
        axis.set(xlabel="turn about x, y and z [degree]", ylabel=f"{what} error of a ray",
                 xticks=np.arange(0, 91, 15), title=f"{body}: {what} of all rays")
    axes[1].legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    save(figure, DOCS / f"thesis_{number}_{body}.svg")


def root(values):
    """Of the size, with the sign; by values themselves only the worst filter would be seen."""
    return np.sign(values) * np.sqrt(np.abs(values))


def squared(values):
    return np.sign(values) * np.square(values)


def error_pictures(found):
    """FIGURE 77: absolute sums as in the thesis, below them signed ones."""
    place = list(ANGLES).index(45)
    names = list(FILTERS)
    figure, axes = plt.subplots(4, len(names), figsize=(2.0 * len(names) + 1.6, 8.6), layout="constrained")
    rows = [(body, kind) for body in BODIES for kind in ("absolute", "signed")]
    for line, (body, kind) in zip(axes, rows):
        pictures = [found[name, body][place][2 if kind == "absolute" else 3] for name in names]
        most = max(np.abs(picture).max() for picture in pictures)
        norm = matplotlib.colors.FuncNorm((root, squared), -most if kind == "signed" else 0, most)
        colours = "RdBu_r" if kind == "signed" else "inferno"
        for axis, picture in zip(line, pictures):
            shown = axis.imshow(picture, norm=norm, cmap=colours, interpolation="nearest")
            axis.set(xticks=[], yticks=[])
            axis.grid(False)
        line[0].set_ylabel(f"{body}, {kind} sum", fontsize=9)
        bar = figure.colorbar(shown, ax=list(line), shrink=0.9, pad=0.01)
        bar.set_ticks([-most, -most / 10, 0, most / 10, most] if kind == "signed" else [0, most / 10, most / 2, most])
        bar.formatter = matplotlib.ticker.FuncFormatter(lambda value, _: f"{value:,.0f}")
        bar.update_ticks()
    for axis, name in zip(axes[0], names):
        axis.set_title(name, fontsize=9)
    figure.savefig(DOCS / "thesis_77_errors.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


def largest_difference_to_scipy():
    """The command's trilinear turn by 45 degrees against scipy's, where scipy's does not use samples outside."""
    try:
        from scipy import ndimage
    except ImportError:
        return None
    samples = sphere(grid((SIDE,) * 3)).astype("<f4")
    back = np.linalg.inv(turn3(45, 45, 45))[::-1, ::-1]  # axes z, y, x
    centre = np.full(3, (SIDE - 1) / 2)
    theirs = ndimage.affine_transform(samples.astype("f8"), back, centre - back @ centre, order=1)
    ours, _ = edgewise("warp", samples, "--rotate", "45,45,45", *via("warp.backward/filter=foh"))
    return float(np.abs(ours - theirs).max())


def multipass_of_the_thesis(samples, degrees):
    """Nine shears (EQ 10 about x, then y, then z), each a warp of its own."""
    angle = np.radians(degrees)
    for first, second in ("yz", "zx", "xy"):
        for pair, by in ((first + second, -np.tan(angle / 2)), (second + first, np.sin(angle)), (first + second, -np.tan(angle / 2))):
            made, _ = edgewise("warp", samples.astype("<f4"), "--shear", f"{pair}={by:.17g}", *via("warp.backward/filter=foh"))
            samples = np.floor(made + 1e-3)  # f32 rounds sums of whole numbers to a little less
    return samples.astype("f8")


def errors_of_thesis_multipass():
    """[(mean, largest)] of cube and sphere at 45 degrees."""
    errors = []
    for body in BODIES.values():
        made = multipass_of_the_thesis(np.rint(body(grid((SIDE,) * 3))), 45)
        rays, _ = along_rays(made - turned_exactly(body, 45))
        errors.append((rays.mean(), rays.max()))
    return errors


def row_of(name, errors, printed):
    cells = []
    for (mean, largest), values in zip(errors, printed):
        cells += [f"{mean:.0f}", str(values[0]), f"{largest:.0f}", str(values[1])]
    return f"| {name} | " + " | ".join(cells) + " |"


def table(found):
    place = list(ANGLES).index(45)
    lines = ["| error of rays at 45 degrees | cube: mean | printed | largest | printed | sphere: mean | printed | largest | "
             "printed |", "|---|" + "---:|" * 8]
    nothing = [("–", "–")] * 2
    for name in FILTERS:
        errors = [found[name, body][place][:2] for body in BODIES]
        printed = [PRINTED.get((name, body), nothing[0]) for body in BODIES]
        if name.startswith("multipass"):
            lines.append(row_of("the thesis's multipass: nine shears, cut to whole numbers", errors_of_thesis_multipass(), printed))
            name, printed = "`warp.shear`: four linear shears", nothing
        lines.append(row_of(name, errors, printed))
    difference = largest_difference_to_scipy()
    if difference is not None:
        lines += ["", f"Largest difference of the trilinear turn of the sphere to `scipy.ndimage.affine_transform`: "
                  f"{difference:.2g} of {WHITE}."]
    return "\n".join(lines)


def thesis_figures():
    """Draws the three figures, and returns the table of TABLE 22 beside them."""
    found = sweep()
    against_angle(found, "cube", 75)
    against_angle(found, "sphere", 76)
    error_pictures(found)
    return table(found)
