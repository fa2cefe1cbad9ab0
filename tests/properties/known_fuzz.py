"""Random requests whose results are known without the command: filters and radon beside scipy and sums written out, labels and
thresholds beside volumes that numpy has turned.

    python3 tests/properties/known_fuzz.py --requests 2000 --seed 1            every kind of request
    python3 tests/properties/known_fuzz.py --requests 1 --seed 1 --first 731 --keep /tmp/kept     one of them again

Judged are the place of every sample, the error against the budget, against what was predicted and against what --verify=all
says, and the exit code. A failing request is printed as a command line; --keep FOLDER keeps its input. EDGEWISE names the
command (build/release/bin/edgewise). What is not known in closed form (warps by splines, other modes) is in fuzz.py.
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import json
import math
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import traceback

import numpy as np
from scipy import ndimage

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import contract  # noqa: E402
import files  # noqa: E402
import fuzz  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
KINDS = {"filter": 10, "radon": 3, "labels": 3, "label picture": 1.5, "binary": 2, "surface": 1.5}
BORDERS = {"zero": dict(mode="constant", cval=0), "clamp": dict(mode="nearest"), "mirror": dict(mode="mirror"), "wrap": dict(mode="wrap")}
PADDING = {"zero": "constant", "clamp": "edge", "mirror": "reflect", "wrap": "wrap"}
MOST_READS = 6e7


@dataclasses.dataclass
class Fault:
    kind: str
    number: int
    line: str
    detail: str
    plan: str


def number(x):
    return f"{x:.6g}"


# Samples


def samples(rng, shape, dtype):
    """(samples, what they are): of all the kinds that rounding treats differently."""
    dtype = np.dtype(dtype)
    name = str(rng.choice(["noise", "offset", "peaks", "ramp", "blobs", "wide", "constant", "steps"],
                          p=[.22, .15, .12, .1, .16, .1, .05, .1]))
    axes = np.meshgrid(*[np.linspace(-1, 1, n) if n > 1 else np.zeros(1) for n in shape], indexing="ij")
    if name in ("noise", "offset"):
        a = rng.random(shape)
    elif name == "peaks":
        a = np.where(rng.random(shape) < .01, rng.random(shape), 0)
        a[tuple(rng.integers(0, n) for n in shape)] = 1
    elif name == "ramp":
        a = sum(rng.uniform(-1, 1) * x for x in axes)
    elif name == "blobs":
        a = ndimage.gaussian_filter(rng.standard_normal(shape), rng.uniform(.7, 3), mode="mirror")
    elif name == "wide":
        a = np.exp(rng.uniform(-12, 0, shape)) * rng.choice([-1, 1], shape)
    elif name == "constant":
        a = np.full(shape, .6)
    else:
        a = (axes[-1] > rng.uniform(-.5, .5)) + .5 * (axes[-2] > 0)
    width = np.ptp(a)
    a = (a - a.min()) / width if width > 0 else np.clip(a, 0, 1)
    if dtype.kind == "f":
        low, high = (1e4, 1e4 + 1) if name == "offset" else sorted(rng.uniform(-1, 1, 2) * 10 ** rng.uniform(-3, 4))
        return (low + (high - low) * a).astype(dtype), name
    ends = np.iinfo(dtype)
    low, high = (ends.max - 40, ends.max) if name == "offset" else (max(ends.min, -1000), min(ends.max, int(rng.choice([20, 255, 4000, 60000]))))
    if dtype.kind == "u":
        low = max(low, 0)
    return np.clip(np.rint(low + (high - low) * a), ends.min, ends.max).astype(dtype), name


def small_shape(rng, dims, least, most):
    return tuple(int(n) for n in np.rint(np.exp(rng.uniform(math.log(least), math.log(most), dims))))


class Trial:
    """One request: its input, its words, what must come of it."""

    def __init__(self, number, seed, folder, env):
        self.rng = np.random.default_rng([seed, number, 0x6b6e])
        self.number, self.folder, self.env = number, folder, env
        self.faults, self.figures, self.ratios = [], collections.Counter(), []
        self.source, self.out = folder / "in.nrrd", folder / "out.nrrd"

    def fault(self, kind, words, detail, plan=""):
        line = "edgewise " + " ".join(shlex.quote(str(w)) for w in words)
        self.faults.append(Fault(kind, self.number, line, detail, plan))

    def run(self, *words, may_fail=True):
        """(report, words) or (None, words)."""
        words = [*words, "--json", "-", "--quiet"]
        try:
            done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=200, env=self.env)
        except subprocess.TimeoutExpired:
            self.fault("exit", words, "no end after 200 s")
            return None, words
        self.figures["runs"] += 1
        if done.returncode == 3 and may_fail:
            self.figures["refused"] += 1
            return None, words
        if done.returncode != 0:
            self.fault("exit", words, f"exit {done.returncode}: {done.stderr.decode(errors='replace').strip()[-300:]}")
            return None, words
        return json.loads(done.stdout), words

    def write(self, a, path=None, spacing=None):
        """[z, y, x] or [y, x]."""
        files.write_nrrd(path or self.source, a, np.ones(a.ndim) if spacing is None else spacing, None, np.zeros(3))

    def read(self):
        stored = files.read_nrrd(self.out)[0]
        return stored

    def budget(self, low=1e-8, high=1e-2):
        draw = self.rng.random()
        if draw < .5:
            return [], None
        error = float(f"{math.exp(self.rng.uniform(math.log(low), math.log(high))):.3g}")
        return ["--max-error", number(error)], error

    def promise(self, report, words, budget, floor, true=None):
        """@param floor  NRMSE of what an error is too small to be told by"""
        plan = "; ".join(step["transition"] for step in report["plan"]["steps"])
        predicted = report["plan"]["predicted"]["error"]
        measured = report["measured"]["error"]["nrmse"]
        if measured is None:
            return
        if true is not None and abs(true - measured) > .01 * true + floor:
            self.fault("verify", words, f"says {measured:.4g}, true {true:.4g}", plan)
        if budget is not None and measured > budget * (1 + 1e-9) + floor:
            self.fault("budget", words, f"measured {measured:.4g} budget {budget:.4g} predicted {predicted}", plan)
        if predicted is None:
            self.figures["unknown"] += 1
            return
        self.ratios.append((measured, predicted, floor, plan))
        if measured > 1.1 * predicted + floor:
            self.fault("promise", words, f"measured {measured:.4g} predicted {predicted:.4g}", plan)

    # Filters

    def weights(self, shape):
        """(weights in f32, name)."""
        rng, kind = self.rng, str(self.rng.choice(["signed", "positive", "whole", "difference", "mean"]))
        if kind == "whole":
            w = rng.integers(-6, 7, shape).astype(float)
        elif kind == "positive":
            w = rng.random(shape)
        elif kind == "mean":
            w = rng.random(shape)
            w /= w.sum()
        else:
            w = rng.standard_normal(shape)
            if kind == "difference":
                w -= w.mean()
        return np.float32(w), kind

    def kernel(self, op, dims, n):
        """(words, weights or None where it is flat, places that count)."""
        rng = self.rng
        # At most so many places, and no farther than samples mirror once.
        most = max(1, min(MOST_READS / n, 4000 if dims == 2 else 4100))
        widest = int(min(63, most ** (1 / dims)))
        of_sum = op in ("convolve", "correlate")
        draw = rng.random()
        grid = lambda r: np.stack(np.meshgrid(*[np.arange(-r, r + 1)] * dims, indexing="ij"))  # noqa: E731
        if draw < (.45 if of_sum else .35):
            shape = tuple(int(k) for k in rng.integers(1, widest + 1, dims))
            if op == "median":
                shape = tuple(k - 1 + k % 2 for k in shape)
            if of_sum:
                w, _ = self.weights(shape)
                if not np.any(w):
                    w.flat[0] = 1
                places = np.ones(shape, bool)
            elif op != "median" and rng.random() < .4:
                w, places = np.float32(rng.integers(2, 12, shape)), np.ones(shape, bool)
            else:
                places = rng.random(shape) < .8
                if op == "median":
                    places[:] = True
                places[tuple(k // 2 for k in shape)] = True
                w = None
            self.write(places.astype("u1") if w is None else w, self.folder / "k.nrrd")
            return self.folder / "k.nrrd", w, places
        radius = int(rng.integers(0 if op != "median" else 1, max(2, (widest + 1) // 2)))
        if of_sum and draw < .65:
            sigma = float(number(rng.uniform(.4, max(.5, radius / 4))))
            reach = int(4 * sigma + .5)
            line = np.exp(-.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
            w = line / line.sum()
            for _ in range(dims - 1):
                w = np.multiply.outer(w, line / line.sum())
            return f"gauss:{number(sigma)}", w, np.ones(w.shape, bool)
        if of_sum and draw < .75:
            if rng.random() < .5:
                axis = int(rng.integers(dims))
                w = np.ones([1] * dims)
                for k in range(dims):
                    line = np.array([-1., 0, 1] if k == axis else [1., 2, 1])
                    w = w * line.reshape([3 if j == dims - 1 - k else 1 for j in range(dims)])
                return f"sobel:{'xyz'[axis]}", w, np.ones(w.shape, bool)
            w = np.zeros([3] * dims)
            w[(1,) * dims] = -2 * dims
            for k in range(dims):
                for end in (0, 2):
                    w[tuple(end if j == k else 1 for j in range(dims))] = 1
            return "laplace", w, np.ones(w.shape, bool)
        shape = str(rng.choice(["box", "sphere", "cross"]))
        at = grid(radius)
        places = {"box": np.ones(at.shape[1:], bool), "sphere": (at ** 2).sum(0) <= radius ** 2, "cross": (at != 0).sum(0) <= 1}[shape]
        return f"{shape}:{radius}", (places / places.sum() if of_sum else None), places

    def filter(self):
        rng = self.rng
        dims = 2 if rng.random() < .6 else 3
        a, what = samples(rng, small_shape(rng, dims, 6, 90 if dims == 2 else 22), rng.choice(["u1", "u2", "i2", "f4", "i4", "f8"], p=[.25, .15, .15, .33, .06, .06]))
        op = str(rng.choice(["convolve", "correlate", "dilate", "erode", "open", "close", "tophat", "median"], p=[.36, .2, .1, .1, .06, .06, .05, .07]))
        border = str(rng.choice(list(BORDERS)))
        name, w, places = self.kernel(op, dims, a.size)
        words = ["--op", op, "--kernel", name, "--border", border]
        budget, limit = self.budget()
        if rng.random() < .35:
            words += ["--bits", "32"]
        edges = ["backward", "forward", "separable", "running", "recursive", "fourier", "runs", "van_herk", "ball_sequence", "fourier_levels",
                 "median", "median_histogram"]
        if rng.random() < .5:
            words += ["--via", "filter." + str(rng.choice(edges))]
            if rng.random() < .5:
                budget, limit = ["--max-error", "1e6"], None
        self.write(a)
        report, words = self.run("filter", self.source, "-o", self.out, *words, *budget, "--verify=all")
        if report is None:
            return
        got = self.read()
        if got.shape != a.shape:
            return self.fault("size", words, f"{got.shape} instead of {a.shape}")
        plan = report["plan"]["steps"][-1]["transition"]
        self.figures[plan] += 1
        want, inside = filtered(a.astype(float), op, w, places, border)
        magnitude = np.abs(a.astype(float)).max() * (np.abs(w).sum() if w is not None and op in ("convolve", "correlate") else 1)
        if w is not None and op not in ("convolve", "correlate"):
            magnitude += np.abs(w).max()
        rounded = want
        if got.dtype.kind in "iu":
            ends = np.iinfo(got.dtype)
            rounded = np.clip(np.rint(want), ends.min, ends.max)
        width = range_of(want)
        predicted = report["plan"]["predicted"]["error"]
        off = np.abs(got.astype(float) - rounded)[inside]
        # Samples that were rounded to fewer bits are off by what the promise counts.
        steps = [step["transition"] for step in report["plan"]["steps"]]
        approximate = plan in ("filter.recursive", "filter.ball_sequence") or "store.precision" in steps
        # f32 keeps 6e-8 of what is added up; what lies next to a half may round the other way.
        bound = 3e-5 * magnitude + (1 if got.dtype.kind in "iu" and w is not None else 0)
        if not approximate and off.size and off.max() > bound + 1e-12:
            self.fault("place", words, f"{off.max():.4g} off at most, range {width:.4g}, {a.dtype} {a.shape} {what}", plan)
        # The mean of all samples is told by a few that are known where borders are not compared.
        true = None
        if inside.all():
            true = math.sqrt(np.mean((got.astype(float) - want) ** 2)) / width
        # Sums of the reference are in f64, and so are scipy's, in another order: roundings of n terms walk at random.
        floor = 2.0 ** -53 * (8 + 2 * math.sqrt(places.size)) * magnitude / width + 1e-12
        self.promise(report, words, limit, floor, true)

    # Lines

    def radon(self):
        rng = self.rng
        a, what = samples(rng, small_shape(rng, 2, 2, 48), rng.choice(["u1", "i2", "f4"]))
        spacing = (1.0, 1.0) if rng.random() < .5 else tuple(float(number(x)) for x in rng.uniform(.5, 2, 2))
        angles = int(rng.integers(1, 24))
        votes = rng.random() < .25
        words = ["--angles", angles]
        threshold = float(number(np.quantile(a, rng.uniform(.2, .9))))
        words += ["--to", "hough", "--threshold", repr(threshold)] if votes else []
        budget, limit = self.budget(1e-7, 1e-3)
        if rng.random() < .6:
            edge = rng.choice(["hough.forward", "hough.backward"] if votes else ["radon.backward", "radon.forward", "radon.fourier"])
            words += ["--via", str(edge)]
            if rng.random() < .5:
                budget, limit = ["--max-error", "1e6"], None
        self.write(a, spacing=spacing)
        report, words = self.run("radon", self.source, "-o", self.out, *words, *budget, "--verify=all")
        if report is None:
            return
        got = self.read()
        plan = report["plan"]["steps"][-1]["transition"]
        self.figures[plan] += 1
        step, diagonal = min(spacing), math.hypot((a.shape[1] + 1) * spacing[0], (a.shape[0] + 1) * spacing[1])
        count = 2 * math.ceil(diagonal / (2 * step)) + 1
        got = got.reshape(got.shape[-2:])
        if got.shape != (angles, count):
            return self.fault("size", words, f"{got.shape} instead of {(angles, count)}")
        if votes:
            want, halfway = hough(a, angles, threshold, spacing, count)
            # A sample halfway between two lines may vote for either by the last bit of a sine.
            if np.any(np.abs(got - want).sum(axis=1) > 2 * halfway) or got.sum() != want.sum():
                self.fault("place", words, f"{np.abs(got - want).sum():g} of {want.sum():g} votes elsewhere", plan)
        else:
            steps = 24
            want = sinogram(a, angles, spacing, count, steps)
            wide = (np.ptp(a.astype(float)) or np.abs(a).max() or 1) * diagonal
            off = math.sqrt(np.mean((got - want) ** 2)) / wide
            predicted = report["plan"]["predicted"]["error"]
            # Midpoints of a step h are off by h^2 / 8 of each jump of the slope, some twice a sample.
            slack = 2 * np.abs(a.astype(float)).max() * 4 * max(a.shape) / min(spacing) * (step / steps) ** 2 / 8 / wide + 1e-6
            if off > (predicted or 1e-6) + slack:
                self.fault("place", words, f"{off:.4g} off, predicted {predicted}, slack {slack:.3g} {what}", plan)
        self.promise(report, words, limit, 1e-12)

    # Labels and thresholds

    def label_volume(self, shape):
        """Balls and boxes of several ids on 0."""
        rng = self.rng
        ids = rng.choice([1, 2, 3, 7, 40, 255], 4, replace=False)
        a = np.zeros(shape, "u1")
        at = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij")).astype(float)
        for label in ids[:int(rng.integers(1, 5))]:
            middle = [rng.uniform(0, n - 1) for n in shape]
            reach = rng.uniform(1, max(1.5, max(shape) / 2.5))
            away = np.stack([x - m for x, m in zip(at, middle)])
            a[(np.abs(away).max(0) if rng.random() < .5 else np.sqrt((away ** 2).sum(0))) <= reach] = label
        return a

    def labels(self):
        """Warps of labels: copies, by quarter turns and whole shifts exactly."""
        rng = self.rng
        dims = 2 if rng.random() < .3 else 3
        exact = rng.random() < .5
        shape = small_shape(rng, dims, 4, 26)
        a = self.label_volume(shape)
        volume = contract.Volume(a.astype(float), np.ones(dims), np.eye(3), np.zeros(3), False)
        if exact:
            words, steps = [], []
            turn = np.zeros(3)
            for axis in ([2] if dims == 2 else rng.choice(3, int(rng.integers(1, 3)), replace=False)):
                turn[axis] = 180 if len(set(shape)) > 1 else rng.choice([90, 180, 270, -90])
            words += ["--rotate", ",".join(number(x) for x in (turn if dims == 3 else turn[2:]))]
            steps.append(contract.affine(contract.rotation(turn)))
            shift = np.zeros(3)
            shift[:dims] = rng.integers(-3, 4, dims)
            words += ["--translate", ",".join(number(x) for x in shift[:dims])]
            steps.append(contract.affine(np.eye(3), shift))
        else:
            words, steps = fuzz.random_steps(rng, dims, "warp", float(max(shape)))
            if any(isinstance(step, tuple) for step in steps):
                return
        self.write(a)
        budget, limit = self.budget(1e-3, .2)
        report, words = self.run("warp", self.source, "-o", self.out, "--labels", *words, *budget, "--verify=all")
        if report is None:
            return
        got = self.read()
        if got.shape != a.shape:
            return self.fault("size", words, f"{got.shape} instead of {a.shape}")
        plan = report["plan"]["steps"][-1]["transition"]
        answer = contract.warp(volume, contract.placements(volume, steps, "z", None)[0], a.shape[::-1], np.ones(dims), "nearest", 0)
        want, seen = answer.values.reshape(a.shape), answer.seen.reshape(a.shape)
        other = (got != want)[seen]
        if set(np.unique(got)) - set(np.unique(a)) - {0}:
            self.fault("place", words, f"labels appear: {sorted(set(np.unique(got)) - set(np.unique(a)))}", plan)
        predicted = report["plan"]["predicted"]["error"] or 0
        # Places halfway between two samples may go either way; a hundredth of them lie there at random shears.
        allowed = 0 if exact else max(1.3 * predicted, .1) ** 2
        if other.size and other.mean() > allowed:
            self.fault("place", words, f"{other.mean():.4g} of {other.size} samples differ, predicted {predicted}", plan)
        self.promise(report, words, limit, 1e-9)

    def cube(self, labels):
        n = int(self.rng.integers(8, 27))
        if labels:
            return self.label_volume((n, n, n))
        a, _ = samples(self.rng, (n, n, n), self.rng.choice(["u1", "i2", "f4"]))
        return a

    def turned_picture(self, mode_words, budget, limit, a, tolerance):
        """The picture of a turned volume is that of the volume turned by numpy. @return it"""
        turn = int(self.rng.integers(0, 4))
        axes = {"z": (1, 2), "x": (0, 1)}[str(self.rng.choice(["z", "x"]))]
        angle = [0, 0, 90 * turn] if axes == (1, 2) else [90 * turn, 0, 0]
        size = ["--size", f"{a.shape[0]}x{a.shape[0]}"]
        self.write(a)
        report, words = self.run("render", self.source, "-o", self.out, *mode_words, *size, "--rotate", ",".join(map(str, angle)), *budget, "--verify=all")
        if report is None:
            return None
        got = self.read().astype(float)
        self.promise(report, words, limit, 1e-7)
        # Right goes to down about z, down to away about x.
        self.write(np.rot90(a, -turn, axes=axes).copy())
        other, _ = self.run("render", self.source, "-o", self.out, *mode_words, *size, *budget)
        self.write(a)
        if other is None:
            return None
        still = self.read().astype(float)
        plan = "; ".join(step["transition"] for step in report["plan"]["steps"])
        width = np.ptp(still) or 1
        off = math.sqrt(np.nanmean((got - still) ** 2)) / width
        both = (report["plan"]["predicted"]["error"] or 0) * 2 + tolerance
        if got.shape != still.shape or off > both:
            self.fault("place", words, f"{off:.4g} from the picture of the turned volume, predicted {report['plan']['predicted']['error']}", plan)
        return got, words, plan, turn, axes

    def binary(self):
        a = self.cube(False)
        level = float(number(np.quantile(a.astype(float), self.rng.uniform(.3, .98))))
        budget, limit = self.budget(1e-3, .2)
        made = self.turned_picture(["--mode", "binary", "--isovalue", repr(level)], budget, limit, a, .12)
        if made is None:
            return
        got, words, plan, turn, axes = made
        if turn:
            return
        # A sample above the level is met by the ray through it.
        most = a.astype(float).max(0)
        surely = most > level + .05 * np.ptp(a.astype(float))
        missed = (got.reshape(*most.shape, -1).max(-1)[surely] < .5)
        if missed.size and missed.mean() > max(.02, (2 * limit) ** 2 if limit else .02):
            self.fault("place", words, f"{missed.sum()} of {missed.size} pixels miss samples above the level", plan)

    def surface(self):
        a = self.cube(False)
        if np.ptp(a.astype(float)) == 0:
            return
        level = float(number(np.quantile(a.astype(float), self.rng.uniform(.4, .95))))
        budget, limit = self.budget(1e-2, .3)
        self.turned_picture(["--mode", "surface", "--isovalue", repr(level)], budget, limit, a, .2)

    def label_picture(self):
        a = self.cube(True)
        budget, limit = self.budget(1e-2, .3)
        self.turned_picture(["--labels", "--mode", "surface"], budget, limit, a, .2)


def range_of(values):
    """What counts as an error of 1: of values that f32 cannot tell from a constant its magnitude."""
    largest = np.abs(values).max()
    return np.ptp(values) if np.ptp(values) > 64 * 2**-24 * largest else largest or 1


def filtered(a, op, weights, places, border):
    """(result in f64, where it is known)."""
    everywhere = np.ones(a.shape, bool)
    keys = BORDERS[border]
    shape = places.shape
    if op in ("convolve", "correlate"):
        w = np.asarray(weights, float)
        flipped = w[tuple(slice(None, None, -1) for _ in shape)]
        centre = [n // 2 if op == "correlate" else n - 1 - n // 2 for n in shape]
        padded = np.pad(a, [(c, n - 1 - c) for c, n in zip(centre, shape)], mode=PADDING[border])
        return correlated(padded, w if op == "correlate" else flipped, a.shape), everywhere
    if op == "median":
        return ndimage.median_filter(a, footprint=places, **keys), everywhere
    grey = None if weights is None else np.where(places, weights, 0).astype(float)
    foot = dict(footprint=places) if grey is None else dict(footprint=places, structure=grey)
    dilate, erode = (lambda x: ndimage.grey_dilation(x, **foot, **keys)), (lambda x: ndimage.grey_erosion(x, **foot, **keys))
    if op == "dilate":
        return dilate(a), everywhere
    if op == "erode":
        return erode(a), everywhere
    # What two passes make near a border is another question: none of their reach is compared.
    inside = np.zeros(a.shape, bool)
    inside[tuple(slice(2 * n, max(2 * n, m - 2 * n)) for n, m in zip(shape, a.shape))] = True
    opened = dilate(erode(a)) if op != "close" else erode(dilate(a))
    return (a - opened if op == "tophat" else opened), inside


def correlated(padded, weights, shape):
    """Sums of products, place by place, or by rows where there are many."""
    out = np.zeros(shape)
    for at in np.argwhere(weights != 0):
        out += weights[tuple(at)] * padded[tuple(slice(k, k + n) for k, n in zip(at, shape))]
    return out


def direction(k, angles):
    c, s = math.cos(math.pi * k / angles), math.sin(math.pi * k / angles)
    return (0.0, 1.0) if 2 * k == angles else (c, s)


def sinogram(a, angles, spacing, count, steps):
    """Integrals of the bilinear field, which ends one sample beyond the outermost, by midpoints."""
    ny, nx = a.shape
    padded = np.pad(a.astype(float), 2)
    step, half = min(spacing), (count - 1) // 2
    length = math.hypot((nx + 1) * spacing[0], (ny + 1) * spacing[1])
    pieces = math.ceil(length / step * steps)
    t = ((np.arange(pieces) + .5) / pieces - .5) * length
    rows = []
    for k in range(angles):
        c, s = direction(k, angles)
        r = (np.arange(count) - half)[:, None] * step
        x, y = (r * c + t * s) / spacing[0] + (nx - 1) / 2, (-r * s + t * c) / spacing[1] + (ny - 1) / 2
        x, y = np.clip(x, -1.5, nx + .5), np.clip(y, -1.5, ny + .5)
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        u, v = x - i, y - j
        i, j = i + 2, j + 2
        f = (1 - v) * ((1 - u) * padded[j, i] + u * padded[j, i + 1]) + v * ((1 - u) * padded[j + 1, i] + u * padded[j + 1, i + 1])
        rows.append(f.sum(1) * length / pieces)
    return np.array(rows)


def hough(a, angles, threshold, spacing, count):
    """(votes by angle, samples of each angle that lie halfway between lines)."""
    ny, nx = a.shape
    y, x = np.nonzero(a.astype("f4") >= np.float32(threshold))
    rows, halfway = [], []
    for k in range(angles):
        c, s = direction(k, angles)
        place = ((x - .5 * (nx - 1)) * spacing[0] * c - (y - .5 * (ny - 1)) * spacing[1] * s) / min(spacing) + (count - 1) // 2 + .5
        rows.append(np.bincount(np.floor(place).astype(int), minlength=count))
        halfway.append(np.count_nonzero(np.abs(place - np.rint(place)) < 1e-9))
    return np.array(rows), np.array(halfway)


def judged(seed, index, kinds, folder, keep):
    place = folder / f"{seed}-{index}"
    place.mkdir(parents=True, exist_ok=True)
    env = {**os.environ, "XDG_CONFIG_HOME": str(folder / "config"), "XDG_CACHE_HOME": str(folder / "cache")}
    trial = Trial(index, seed, place, env)
    try:
        weights = np.array([KINDS[kind] for kind in kinds])
        kind = kinds[trial.rng.choice(len(kinds), p=weights / weights.sum())]
        trial.figures[kind] += 1
        getattr(trial, kind.replace(" ", "_"))()
        result = trial.faults, trial.figures, trial.ratios
    except Exception:  # a fault of the fuzzer itself must not pass as one without any
        result = [Fault("fuzzer", index, "", traceback.format_exc(), "")], trial.figures, trial.ratios
    if not (keep and result[0]):
        shutil.rmtree(place)
    return result


def fuzz_known(seed, first, requests, seconds, kinds, keep=None, jobs=2, show=None):
    """(faults, figures, ratios, requests that were judged)."""
    folder = pathlib.Path(keep or tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
    faults, figures, ratios, done = [], collections.Counter(), [], 0
    begin = time.monotonic()
    try:
        with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
            waiting, index = collections.deque(), first
            while waiting or index < first + requests:
                late = time.monotonic() - begin > seconds
                while index < first + requests and len(waiting) < 2 * jobs and not late:
                    waiting.append(pool.submit(judged, seed, index, kinds, folder, keep))
                    index += 1
                if not waiting:
                    break
                new, more, pairs = waiting.popleft().result()
                done += 1
                figures.update(more)
                ratios += pairs
                for fault in new:
                    faults.append(fault)
                    if show:
                        show(fault)
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
    return faults, figures, ratios, done


def kept_promises(ratios):
    """(errors that can be told, share of them within a third of what was promised, above it, the worst)."""
    told = [(m, p) for m, p, floor, _ in ratios if m > 10 * floor]
    if not told:
        return 0, 1.0, 0.0, 0.0
    close = sum(p / 3 <= m <= p for m, p in told) / len(told)
    above = [m / p if p else math.inf for m, p in told if m > p]
    return len(told), close, len(above) / len(told), max(above, default=0.0)


def summary(faults, figures, ratios, done):
    kinds = collections.Counter(fault.kind for fault in faults)
    told, close, above, worst = kept_promises(ratios)
    lines = [f"{done} requests, " + ", ".join(f"{count} {name}" for name, count in sorted(figures.items())),
             f"{told} errors to tell: {100 * close:.1f} % within 1/3 and 1 of the promise, {100 * above:.2f} % above, at most {worst:.3g} times"]
    return "\n".join(lines + [f"{count:5} {kind}" for kind, count in sorted(kinds.items())])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--requests", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first request")
    parser.add_argument("--seconds", type=float, default=1e9, help="begin no request after so long")
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--keep", help="folder that keeps inputs and outputs of the requests that fail")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()

    def show(fault):
        print(f"[{fault.number}] {fault.kind}: {fault.detail}\n    {fault.line}\n    {fault.plan}", flush=True)

    found = fuzz_known(options.seed, options.first, options.requests, options.seconds, options.kinds, options.keep, options.jobs, show)
    print(summary(*found))
    outside = collections.Counter(p for m, _, floor, p in found[2] if m > 10 * floor)
    far = collections.Counter(plan for m, p, floor, plan in found[2] if m > 10 * floor and not p / 3 <= m <= p)
    print("outside by plan:", {plan: f"{count} of {outside[plan]}" for plan, count in far.most_common()})
    return 1 if found[0] else 0


if __name__ == "__main__":
    sys.exit(main())
