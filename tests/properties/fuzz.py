"""Random requests to the command, each answer judged by a reference that was written from the contract alone.

    python3 tests/properties/fuzz.py --requests 1000 --seed 1            every kind of request
    python3 tests/properties/fuzz.py --requests 1 --seed 1 --first 731 --keep /tmp/kept     one of them again

For each request the planner runs free, and then a few of the edges that could serve it are forced. Judged are the place of
every sample, the error against the budget, against what was predicted and against what --verify=all says, the bytes for one
and two threads, and the exit code. A failing request is printed as a command line; --keep FOLDER keeps its input.
EDGEWISE names the command (build/release/bin/edgewise).
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import json
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

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
KINDS = ["image", "warp", "mip", "xray", "mean", "composite", "minip", "stddev", "drr"]
MOST_RAY_SAMPLES = 1_200_000
MOST_SAMPLES = 40_000

# The reference's phase along a ray (where the first of its samples lies) is free: its answer moves by less than this part
# of an error that is near a budget. Rounding to f32 comes on top, as a part of the range.
SLACK = 1.02
ROUNDING = 2e-6


@dataclasses.dataclass
class Request:
    number: int
    job: str
    mode: str
    words: list  # what follows the input's name: geometry, mode, look, reference, range
    budget: list
    volume: contract.Volume
    stored: np.ndarray
    writing: dict  # how the input is written: slope, intercept, coded
    ending: str
    steps: list
    view: str
    about: object
    reference: str
    size: object
    spacing: object
    zoom: float
    perspective: object
    outside: float
    look: object
    range: object
    loose: bool  # not finite under a spline: only its place is defined
    clip: contract.Clip


ORDERED = ("--rotate", "--scale", "--shear", "--translate", "--matrix", "--turntable")


def number(x):
    return f"{x:.6g}"


def listed(values):
    return ",".join(number(v) for v in values)


def rounded(x, digits=4):
    """What the command line says is what the reference gets."""
    return float(f"{x:.{digits}g}")


# Inputs


def content(rng, shape):
    """Values in about 0..1 and the name of what they are."""
    name = rng.choice(["blurred", "peaks", "steps", "constant", "noise", "ramp", "body"], p=[.34, .14, .14, .06, .08, .04, .2])
    axes = np.meshgrid(*[np.linspace(-1, 1, n) if n > 1 else np.zeros(1) for n in shape], indexing="ij")
    if name == "constant":
        return name, np.full(shape, rng.choice([0.0, 0.1, 0.7, 1.0]))
    if name == "peaks":
        values = np.zeros(shape)
        for _ in range(rng.integers(1, 5)):
            values[tuple(rng.integers(0, n) for n in shape)] = rng.uniform(.3, 1)
        return name, values
    if name == "steps":
        values = np.zeros(shape)
        for _ in range(rng.integers(1, 4)):
            low = [rng.integers(0, n) for n in shape]
            box = tuple(slice(a, rng.integers(a, n) + 1) for a, n in zip(low, shape))
            values[box] = rng.uniform(.2, 1)
        return name, values
    if name == "noise":
        return name, rng.random(shape)
    if name == "ramp":
        weights = rng.uniform(-1, 1, len(shape))
        values = sum(w * a for w, a in zip(weights, axes))
    elif name == "body":
        radius = np.sqrt(sum((a / rng.uniform(.5, .9)) ** 2 for a in axes))
        texture = ndimage.gaussian_filter(rng.random(shape), rng.uniform(.7, 1.5))
        values = np.clip((1 - radius) * 4, 0, 1) * (.7 + (texture - texture.mean()))
    else:
        values = ndimage.gaussian_filter(rng.standard_normal(shape), rng.uniform(.6, 2.5), mode="mirror")
    width = np.ptp(values)
    return name, (values - values.min()) / width if width > 0 else np.zeros(shape)


def orientation(rng):
    """(columns in LPS, the file says so)."""
    draw = rng.random()
    if draw < .35:
        return np.eye(3), False
    columns = np.eye(3)[:, rng.permutation(3)] * rng.choice([-1, 1], 3)
    if draw < .65:
        # Small enough that which axis is nearest is not in doubt.
        columns = contract.rotation(rng.uniform(-14, 14, 3)) @ columns
    return columns, True


def make_volume(rng, job, mode):
    """(volume, stored samples, how to write them, name)."""
    dims = 2 if mode == "image" else 3
    draw = rng.random()
    if draw < .05:
        extent = rng.integers(1, 4, dims)
    else:
        extent = np.rint(np.exp(rng.uniform(np.log(8), np.log(40), dims))).astype(int)
        if draw < .12:
            extent[rng.integers(dims)] = 1
    name, values = content(rng, tuple(extent[::-1]))
    kind = rng.choice(["u1", "i2", "u2", "f4"], p=[.3, .25, .15, .3])
    spacing = np.ones(dims)
    draw = rng.random()
    if draw > .45:
        spacing[:] = rounded(np.exp(rng.uniform(np.log(.3), np.log(3))), 3)
    if draw > .65:
        spacing = np.array([rounded(s * np.exp(rng.uniform(-1, 1)), 3) for s in spacing])
    direction, anatomical = orientation(rng) if dims == 3 else (np.eye(3), False)
    origin = np.round(rng.uniform(-50, 50, 3), 2) if anatomical else np.zeros(3)
    writing = {"format": "nrrd"}
    if kind == "f4":
        low, high = sorted(np.round(rng.uniform(-2, 2, 2), 2))
        stored = np.float32(low + (high - low + .1) * values)
    else:
        ends = np.iinfo(kind)
        high = rng.choice([20, 255, 1000, ends.max]) if kind != "u1" else rng.choice([20, 255])
        low = rng.choice([0, -1000]) if kind == "i2" else rng.choice([0, 0, 5])
        stored = np.clip(np.rint(low + (min(high, ends.max) - low) * values), ends.min, ends.max).astype(kind)
        if dims == 3 and rng.random() < .25:
            writing = {"format": "nifti", "slope": rounded(rng.uniform(.01, 3), 3),
                       "intercept": rounded(rng.choice([0, rng.uniform(-1000, 100)]), 3), "coded": bool(anatomical)}
    if kind == "f4" and rng.random() < .1:
        flat = stored.reshape(-1)
        flat[rng.integers(0, flat.size, max(1, flat.size // 200))] = rng.choice([np.nan, np.inf])
        name += "+holes"
    values = stored.astype(float)
    if writing["format"] == "nifti":
        writing["slope"], writing["intercept"] = (float(np.float32(writing[k])) for k in ("slope", "intercept"))
        values = values * writing["slope"] + writing["intercept"]
        # The header keeps f32: what the file says, not what was meant.
        spacing = np.float32(spacing).astype(float)
        if anatomical:
            columns = np.float32(direction * spacing).astype(float)
            spacing = np.linalg.norm(columns, axis=0)
            direction, origin = columns / spacing, np.float32(origin).astype(float)
    return contract.Volume(values, spacing, direction, origin, anatomical), stored, writing, name


def write_input(request, folder):
    volume, how = request.volume, request.writing
    if how["format"] == "nifti":
        path = folder / "in.nii"
        files.write_nifti(path, request.stored, volume.spacing, volume.direction, volume.origin, how["slope"],
                          how["intercept"], how["coded"])
    else:
        path = folder / "in.nrrd"
        files.write_nrrd(path, request.stored, volume.spacing, volume.direction if volume.anatomical else None, volume.origin)
    return path


# Requests


def random_steps(rng, dims, job, body):
    """(words, 4x4 matrices and turntables); `body`: the longest side of the volume."""
    words, steps = [], []
    turned = False
    for _ in range(rng.choice([0, 1, 1, 2, 3])):
        step = rng.choice(["rotate", "scale", "shear", "translate", "matrix", "turntable"], p=[.4, .15, .13, .12, .12, .08])
        if step == "rotate":
            angles = np.zeros(3)
            for axis in ([2] if dims == 2 else rng.choice(3, rng.integers(1, 4), replace=False)):
                angles[axis] = rng.choice([90, 180, 270, -90, 45]) if rng.random() < .3 else rounded(rng.uniform(-180, 180))
            words += ["--rotate", listed(angles if dims == 3 else angles[2:])]
            steps.append(contract.affine(contract.rotation(angles)))
        elif step == "scale":
            factors = np.ones(3)
            alone = rng.random() < .5
            factors[:dims] = [rounded(np.exp(rng.uniform(-.6, .6)), 3) for _ in range(dims)]
            if alone:
                factors[:dims] = factors[0]
            words += ["--scale", number(factors[0]) if alone else listed(factors[:dims])]
            steps.append(contract.affine(np.diag(factors)))
        elif step == "shear":
            a, b = rng.choice(dims, 2, replace=False)
            k = rounded(rng.uniform(-.8, .8), 3)
            linear = np.eye(3)
            linear[a, b] = k
            words += ["--shear", f"{'xyz'[a]}{'xyz'[b]}={number(k)}"]
            steps.append(contract.affine(linear))
        elif step == "translate":
            shift = np.zeros(3)
            shift[:dims] = [rounded(x, 3) for x in rng.uniform(-.2, .2, dims) * body]
            words += ["--translate", listed(shift[:dims])]
            steps.append(contract.affine(np.eye(3), shift))
        elif step == "matrix":
            linear = np.eye(3)
            block = rng.normal(0, .25, (dims, dims)) + (contract.rotation(rng.uniform(-60, 60, 3)) if dims == 3 else np.eye(2))
            linear[:dims, :dims] = np.vectorize(lambda x: rounded(x, 5))(block)
            if abs(np.linalg.det(linear)) < .3:
                continue
            shift = np.zeros(3)
            form = rng.integers(3)
            if form:
                shift[:dims] = [rounded(x, 3) for x in rng.uniform(-.15, .15, dims) * body]
            full = np.eye(dims + 1)
            full[:dims, :dims], full[:dims, dims] = linear[:dims, :dims], shift[:dims]
            said = [full[:dims, :dims], full[:dims], full][form]
            # Numbers without a shape: 9 are a 3x3 of the volume's axes, or of an image's plane.
            words += ["--matrix", listed(said.ravel())]
            steps.append(contract.affine(linear, shift))
        elif job == "render" and not turned:
            count = int(rng.integers(2, 5))
            turned = True
            words += ["--turntable", str(count)]
            steps.append(("turntable", count))
    return words, steps


def shuffled(rng, words):
    """Only what moves the content has an order of its own; all else may stand anywhere."""
    pairs = [words[i:i + 2] for i in range(0, len(words), 2)]
    ordered = [pair for pair in pairs if pair[0] in ORDERED]
    for pair in (pair for pair in pairs if pair[0] not in ORDERED):
        ordered.insert(rng.integers(0, len(ordered) + 1), pair)
    return [word for pair in ordered for word in pair]


def random_transfer(rng, low, high):
    count = rng.integers(2, 6)
    at = np.sort(rng.uniform(low - .1 * (high - low), high + .1 * (high - low) + 1e-3, count))
    at = np.unique([rounded(x, 5) for x in at])
    points = []
    for value in at:
        opacity = float(rng.choice([0, rounded(rng.uniform(0, .2), 3), rounded(rng.uniform(0, .9), 3)]))
        points.append((float(value), opacity, tuple(rounded(c, 3) for c in rng.random(3))))
    return points


def random_clip(rng, volume, frames):
    """(words, Clip): a part of the volume with its middle in it."""
    words, planes, slab = [], [], None
    middle = (volume.extent - 1) / 2
    kinds = rng.random(3) < .5
    if kinds[0]:
        low = [int(rng.integers(-1, int(m) + 1)) for m in middle]
        high = [int(rng.integers(int(np.ceil(m)), n + 1)) for m, n in zip(middle, volume.extent)]
        words += ["--clip", listed(low + high)]
        for axis in range(3):
            unit = np.eye(3)[axis]
            planes += [(*unit, .5 - low[axis]), (*-unit, .5 + high[axis])]
    for _ in range(rng.integers(1, 3) if kinds[1] else 0):
        normal = [rounded(x, 3) for x in rng.normal(size=3)]
        if rng.random() < .2:
            normal = [0, 0, 0]
            normal[rng.integers(3)] = int(rng.choice([-1, 1]))
        reach = rng.uniform(.02, .4) * np.abs(np.array(normal) * volume.extent).sum()
        normal.append(rounded(reach - np.array(normal) @ middle, 5))
        words += ["--clip-plane", listed(normal)]
        planes.append(tuple(normal))
    if kinds[2]:
        apart = max(abs(placed[2, 3]) for placed in frames)
        slab = rounded(2 * apart + rng.uniform(.5, 1.2) * float((volume.extent * volume.spacing).min()), 4)
        words += ["--slab", number(slab)]
    balls = []
    for _ in range(rng.integers(1, 3) if rng.random() < .3 else 0):
        size = volume.extent * volume.spacing
        away = rng.uniform(-.3, .3, 3) * size
        balls.append((*(rounded(x, 3) for x in middle + away / volume.spacing),
                      rounded(np.linalg.norm(away) + rng.uniform(.1, .6) * size.max(), 4)))
        words += ["--clip-ball", listed(balls[-1])]
    return words, contract.Clip(tuple(planes), slab, tuple(balls))


def ray_samples(volume, frames, size):
    """An upper estimate of what the reference has to look at."""
    pixels = size[0] * size[1] * len(frames)
    depth = max(np.ptp(contract.corners(volume, f)[:, 2]) / max(1e-9, np.linalg.norm(f[2, :3])) for f in frames)
    return pixels * depth / volume.spacing.min() * 8 * .6


def whole(lengths):
    """Numbers of samples; what f32 leaves of a whole number is none more."""
    return [max(1, int(np.ceil(length * (1 - 1e-6)))) for length in lengths]


def default_size(volume, frames, spacing):
    half = np.max([np.abs(contract.corners(volume, placed)[:, :2]).max(0) for placed in frames], 0)
    return whole(2 * half / spacing)


def make_request(seed, index, kinds):
    rng = np.random.default_rng([seed, index])
    mode = kinds[rng.choice(len(kinds), p=np.array([KIND_WEIGHTS[k] for k in kinds]) / sum(KIND_WEIGHTS[k] for k in kinds))]
    job = "warp" if mode in ("image", "warp") else "render"
    volume, stored, writing, name = make_volume(rng, job, mode)
    dims = volume.values.ndim
    body = float((volume.extent * volume.spacing).max())
    words, steps = random_steps(rng, dims, job, body)
    view = "front" if job == "render" and volume.anatomical else "z"
    if dims == 3 and rng.random() < .35:
        view = str(rng.choice(["x", "y", "z", "front", "back", "left", "right", "top", "bottom"]))
        words[:0] = ["--view", view]
    about = None
    if rng.random() < .12:
        about = [int(rng.integers(0, n)) for n in volume.extent]
        words += ["--about", listed(about)]
    frames = contract.placements(volume, steps, view, about)
    perspective = None
    if job == "render" and rng.random() < .2:
        perspective = int(rng.integers(10, 80))
        words += ["--perspective", str(perspective)]
    zoom = 1.0
    if job == "render" and rng.random() < .08:
        zoom = rounded(rng.uniform(.7, 2), 3)
        words += ["--zoom", number(zoom)]
    size = spacing = None
    draw = rng.random()
    if draw < .3:
        spacing = [rounded(volume.spacing.min() * np.exp(rng.uniform(-.2, 1)), 3)] * dims
        if rng.random() < .4 and perspective is None:
            spacing = [rounded(s * np.exp(rng.uniform(-.3, .3)), 3) for s in spacing]
    if .15 < draw < .5:
        size = [int(n) for n in rng.integers(4, 48, dims if job == "warp" else 2)]
    if job == "render":
        # Keep what the reference has to look at within bounds.
        expected = size or default_size(volume, frames, spacing[:2] if spacing else [volume.spacing.min()] * 2)
        load = ray_samples(volume, frames, expected)
        if load > MOST_RAY_SAMPLES:
            shrink = (MOST_RAY_SAMPLES / load) ** .5
            size = [max(3, int(n * shrink)) for n in expected]
    elif size is None and np.prod(volume.extent) > MOST_SAMPLES:
        size = [max(1, int(n * (MOST_SAMPLES / np.prod(volume.extent)) ** (1 / 3))) for n in volume.extent]
    if spacing is not None:
        said = spacing[:2] if job == "render" else spacing
        words += ["--spacing", number(said[0]) if len(set(said)) == 1 else listed(said)]
    if size is not None:
        words += ["--size", "x".join(map(str, size))]
    elif job == "render" and spacing is None:
        words += ["--size", "native"]
    reference = str(rng.choice(["spline", "linear", "nearest"], p=[.6, .28, .12]))
    holes = not np.isfinite(volume.values).all()
    if holes and rng.random() < .7:
        reference = str(rng.choice(["linear", "nearest"], p=[.8, .2]))
    if reference != "spline" or rng.random() < .2:
        words += ["--reference", reference]
    data = volume.values[np.isfinite(volume.values)]
    low, high = (float(data.min()), float(data.max())) if data.size else (0.0, 0.0)
    outside, look = 0.0, None
    if job == "warp" and rng.random() < .3:
        outside = float(stored.dtype.type(rng.choice([0, 3, 17])) if writing["format"] == "nrrd"
                        else 3 * writing["slope"] + writing["intercept"])
        words += ["--outside", repr(outside)]
    if job == "render":
        if mode != "mip" or rng.random() < .3:
            words += ["--mode", mode]
        zero, points, unit, background = None, None, None, (0.0, 0.0, 0.0)
        if mode == "xray" and rng.random() < .3:
            zero = rounded(rng.uniform(low, high + .1), 4)
            words += ["--zero", number(zero)]
        if mode == "composite":
            if rng.random() < .4:
                background = tuple(rounded(c, 3) for c in rng.random(3))
                words += ["--background", listed(background)]
            if rng.random() < .7 or high == low:  # a ramp over no range is nothing that is defined
                points = random_transfer(rng, low, high)
                unit = rounded(volume.spacing.min() * rng.choice([1, .5, 2, 3]), 4) if rng.random() < .5 else None
                words += ["--transfer", "TRANSFER"]
        look = contract.default_look(volume, mode, zero, points, unit, background)
    wanted_range = None
    if rng.random() < .08:
        wanted_range = rounded((high - low or 1) * rng.uniform(.5, 2), 3)
        words += ["--range", number(wanted_range)]
    error = float(np.exp(rng.uniform(np.log(.001), np.log(.1))))
    draw = rng.random()
    budget = ["--max-error", number(rounded(error, 3)) if draw < .7 else f"{-20 * np.log10(error):.1f}dB" if draw < .85
              else f"{100 * error:.2f}%"]
    words = shuffled(rng, words)
    clip = contract.Clip()
    if job == "render" and rng.random() < .25:
        clip_words, clip = random_clip(rng, volume, frames)
        words += clip_words
    ending = "nii" if job == "warp" and writing["format"] == "nifti" else "nrrd"
    return Request(index, job, mode, words, budget, volume, stored, writing, ending, steps, view, about, reference, size,
                   spacing, zoom, perspective, outside, look, wanted_range, holes and reference == "spline", clip), name


KIND_WEIGHTS = {"image": 1, "warp": 3, "mip": 2, "xray": 2, "mean": 1.2, "composite": 2.4, "minip": .5, "stddev": .6, "drr": .6}


def transfer_json(request):
    points = [{"value": v, "opacity": a, "color": list(c)} for v, a, c in request.look.points]
    return json.dumps({"points": points, "unit": request.look.unit})


# Running and judging


@dataclasses.dataclass
class Fault:
    kind: str
    number: int
    line: str
    detail: str
    plan: str


class Subject:
    """The command, in a home of its own: a profile of whoever runs this must not change the plans."""

    def __init__(self, folder):
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(folder / "config"), "XDG_CACHE_HOME": str(folder / "cache")}
        self.edges = self.listed("edges")
        self.modes = [entry["name"] for entry in self.listed("modes")]

    def run(self, words, timeout=60):
        try:
            return subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=timeout, env=self.env)
        except subprocess.TimeoutExpired as late:
            return subprocess.CompletedProcess(late.cmd, -1, b"", b"no end after %d s" % timeout)

    def listed(self, what):
        return json.loads(self.run(["list", what, "--json", "-"]).stdout)[what]

    def random_paths(self, rng, job, count):
        """Edges that lead to the screen, with values of the parameters that they try."""
        ends = ("screen/scalar",) if job == "warp" else ("screen/picture", "picture")
        able = [edge for edge in self.edges if any(join["to"].endswith(ends) for join in edge["joins"])]
        if job == "render":
            able += [edge for edge in self.edges if edge["name"].startswith("warp.")]
        paths = []
        for edge in (able[i] for i in rng.permutation(len(able))[:count]):
            via = edge["name"]
            for key, domain in edge["parameters"].items():
                if rng.random() < .8 and domain["tried"]:
                    via += f"/{key}={domain['tried'][rng.integers(len(domain['tried']))]}"
            paths.append(via)
        return paths


def expected_grid(request):
    """(frames, size, spacing, eye): the output samples that the contract asks for."""
    volume, frames = request.volume, contract.placements(request.volume, request.steps, request.view, request.about)
    if request.job == "warp":
        dims = volume.values.ndim
        turn = np.abs(contract.view_matrix(request.view, volume))[:dims, :dims] if dims == 3 else np.eye(2)
        extent, spacing = np.rint(turn @ volume.extent).astype(int), turn @ volume.spacing
        size = request.size or list(extent)
        if request.spacing:
            if not request.size:  # the same field of view
                size = whole(extent * spacing / request.spacing)
            return frames, size, np.array(request.spacing), None
        if request.size:
            kept = 2 if size[-1] == 1 else dims  # one plane is chosen, not made as thin
            spacing = spacing * np.max((extent / np.array(size))[:kept])
        return frames, size, spacing, None
    spacing = np.array((request.spacing or [volume.spacing.min()] * 2)[:2], float)
    natural = default_size(volume, frames, spacing)
    size = request.size or natural
    if request.size and not request.spacing:
        spacing = spacing * np.max(np.array(natural) / np.array(size))
    # The eye sees the whole scene, of which a zoom shows the middle.
    eye = contract.eye_of(volume, frames, request.perspective, size, spacing) if request.perspective else None
    return frames, size, spacing / request.zoom, eye


class Judge:
    """Judges the runs of one request."""

    def __init__(self, subject, request, name, folder, rng):
        self.subject, self.request, self.name, self.folder, self.rng = subject, request, name, folder, rng
        self.faults, self.figures = [], collections.Counter()
        self.ratios = []
        self.input = write_input(request, folder)
        self.words = list(request.words)
        if "TRANSFER" in self.words:
            (folder / "transfer.json").write_text(transfer_json(request))
            self.words[self.words.index("TRANSFER")] = str(folder / "transfer.json")
        self.answer = self.doubtful = None

    def fault(self, kind, words, detail, plan=""):
        line = "edgewise " + " ".join(shlex.quote(str(w)) for w in words)
        self.faults.append(Fault(kind, self.request.number, line, detail, plan))

    def command(self, out, extra):
        return [self.request.job, self.input, "-o", out, *self.words, *extra]

    def run(self, tag, extra):
        """(report or None, words, output files)."""
        several = any(isinstance(step, tuple) for step in self.request.steps)
        out = self.folder / (f"{tag}_%d.{self.request.ending}" if several else f"{tag}.{self.request.ending}")
        report = self.folder / f"{tag}.json"
        words = self.command(out, extra)
        done = self.subject.run([*words, "--json", report, "--quiet"])
        self.figures["runs"] += 1
        if done.returncode not in (0, 3):
            self.fault("exit", words, f"exit {done.returncode}: {done.stderr.decode(errors='replace').strip()[-300:]}")
            return None, words, []
        if done.returncode == 3:
            self.figures["refused"] += 1
            return None, words, []
        answer = json.loads(report.read_text())
        count = next((step[1] for step in self.request.steps if isinstance(step, tuple)), 1)
        return answer, words, [pathlib.Path(str(out).replace("%d", str(k))) for k in range(count)]

    def load(self, paths):
        read = files.read_nifti if self.request.ending == "nii" else files.read_nrrd
        pictures = [read(path) for path in paths]
        samples = np.stack([p[0].astype(float) for p in pictures]) if self.request.job == "render" else pictures[0][0].astype(float)
        return samples, pictures[0][1:]

    def reference(self, output, header, words):
        """The right answer on the grid that the request asks for; a fault where the output has another."""
        request = self.request
        frames, size, spacing, eye = expected_grid(request)
        shape = tuple(int(n) for n in size[::-1])
        got = output.shape if request.job == "warp" else output.shape[1:3]
        if request.job == "warp" and len(got) > len(shape):
            got = got[-len(shape):]
        if tuple(got) != shape:
            self.fault("size", words, f"{got[::-1]} instead of {shape[::-1]}")
            return None
        if header[0] is not None and len(header[0]) >= len(size):
            said = np.array(header[0][:len(size)])
            if np.abs(said / spacing[:len(size)] - 1).max() > 1e-5:
                self.fault("spacing", words, f"{said} instead of {spacing[:len(size)]}")
        if request.job == "warp":
            if header[1] is not None and request.volume.anatomical:
                self.check_header(words, frames, size, spacing, header)
            answer = contract.warp(request.volume, frames[0], size, spacing, request.reference, request.outside)
        else:
            answer = contract.render(request.volume, frames, size, spacing, request.look, request.reference, eye,
                                     clip=request.clip)
        return answer

    def check_header(self, words, frames, size, spacing, header):
        """The grid lies where the view put it; all other geometry moved the content."""
        volume = self.request.volume
        view = contract.view_matrix(self.request.view, volume)
        said_spacing, direction, origin = header
        ends = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]) * (np.array(size) - 1)
        screen = spacing * (ends - (np.array(size) - 1) / 2)
        right = volume.world(screen @ view)  # the inverse of a turn is its transpose
        given = origin + (ends * said_spacing) @ direction.T
        apart = np.abs(right - given).max() / spacing.min()
        if apart > 1e-3:
            self.fault("header", words, f"origin {origin} direction {direction.round(4).tolist()}: {apart:.3g} samples off")

    def judge(self, tag, extra, budget=None):
        report, words, paths = self.run(tag, extra)
        if report is None:
            return None
        output, header = self.load(paths)
        if self.answer is None:
            self.answer = self.reference(output, header, words)
            if self.answer is None:
                return report
        answer, request = self.answer, self.request
        output = output.reshape(answer.values.shape)
        plan = "; ".join(step["transition"] + "".join(f"/{k}={v}" for k, v in step["parameters"].items())
                         for step in report["plan"]["steps"])
        seen = answer.seen
        if request.loose:
            return report
        if not np.isfinite(output[seen]).all():
            self.fault("not finite", words, f"{(~np.isfinite(output[seen])).sum()} of {seen.sum()} samples", plan)
            return report
        true, width = contract.nrmse(output, answer, request.range, self.scale())
        predicted = report["plan"]["predicted"]["error"]
        self.figures["judged"] += 1
        fine = 0.0 if predicted is None else predicted
        # f32 keeps 6e-8 of the values, and sums along rays some times that.
        rounding = ROUNDING * (1 + np.abs(answer.values[seen]).max(initial=0) / width)
        miss = self.beyond(output, width)
        doubt = 0.0
        if true > min(5 * fine, 1.5 * fine, budget or np.inf) + rounding or "--verify=all" in extra:
            doubt = self.doubt()
        slack = doubt + rounding
        # Nothing but the values that the reference has, moved or missing, makes an error far above the prediction.
        if true > max(.03, 5 * fine + slack):
            self.fault("place", words, f"true {true:.4g} predicted {predicted}, range {width:.4g}", plan)
        elif miss > 1e-3:
            self.fault("beyond", words, f"{miss:.3g} of the range where nothing is seen", plan)
        if budget is not None and true > SLACK * budget + slack:
            full = self.preview_drew_all(report)
            self.fault("budget, all drawn" if full else "budget", words, f"true {true:.4g} budget {budget:.4g} predicted {predicted}", plan)
        if predicted is not None:
            self.ratios.append((true, predicted))
            if true > 1.5 * predicted + slack:
                self.fault("prediction", words, f"true {true:.4g} predicted {predicted:.4g} ({true / max(predicted, 1e-30):.3g})", plan)
        measured = (report["measured"] or {}).get("error")
        if measured and "--verify=all" in extra:
            self.figures["verified"] += 1
            said = measured["nrmse"]
            # Rays in a face may be counted or not, and what only touches the border.
            border = (~answer.seen & ~answer.missed).mean()
            counted = contract.nrmse(output, answer, request.range, self.scale(), edges=True)[0]
            if said is None or min(abs(said - x) - .05 * x for x in (true, counted)) > slack + 1e-4 + border:
                self.fault("verify", words, f"says {said}, true {true:.4g}, {measured['samples']} of {seen.sum()} samples", plan)
        return report

    def beyond(self, output, width):
        """The largest departure from what is written where nothing is seen, as a part of the range."""
        missed, miss, how = self.answer.missed, self.answer.miss, self.request.writing
        if not missed.any() or self.request.mode in ("mean", "stddev"):  # the contract names no value
            return 0.0
        if self.request.job == "warp" and self.request.stored.dtype.kind != "f":
            slope, intercept = how.get("slope", 1.0), how.get("intercept", 0.0)
            ends = np.iinfo(self.request.stored.dtype)
            miss = np.clip(np.rint((miss - intercept) / slope), ends.min, ends.max) * slope + intercept
        apart = np.abs(output[missed] - miss)
        return float(np.nanmax(apart) / width) if np.isfinite(apart).any() else 0.0

    def scale(self):
        data = np.abs(self.request.volume.values[np.isfinite(self.request.volume.values)])
        return float(data.max(initial=0))

    def doubt(self):
        """How far the answer moves with the phase of the reference's samples along a ray, which is free."""
        if self.request.job == "warp":
            return 0.0
        if self.doubtful is None:
            frames, size, spacing, eye = expected_grid(self.request)
            others = [contract.render(self.request.volume, frames, size, spacing, self.request.look, self.request.reference, eye,
                                      clip=self.request.clip, **how).values for how in ({"finer": 2.7}, {"phase": .25}, {"phase": .5}, {"phase": .75})]
            apart = [contract.nrmse(values, self.answer, self.request.range, self.scale())[0] for values in others]
            self.doubtful = max(2 * apart[0], *apart[1:])
        return self.doubtful

    def preview_drew_all(self, report):
        # Of a warp "exhausted" only means that no more is drawn.
        return self.request.job == "render" and report["scene"].get("exhausted", False)

    def all(self):
        budget = parse_error(self.request.budget[1])
        free = self.request.budget + (["--verify=all"] if self.rng.random() < .4 else [])
        report = self.judge("free", free, budget)
        if report is None and budget > .05 and not self.faults:
            self.figures["refused though easy"] += 1
        if self.rng.random() < .25 and not self.faults:
            self.threads(free)
        for index, via in enumerate(self.subject.random_paths(self.rng, self.request.job, 3)):
            extra = ["--via", via, "--max-error", "1e6"] + (["--verify=all"] if self.rng.random() < .25 else [])
            self.judge(f"via{index}", extra)
        return self.faults

    def threads(self, extra):
        outputs = []
        for threads in (1, 2):
            report, words, paths = self.run(f"threads{threads}", [*extra, "--threads", str(threads)])
            if report is None:
                return
            outputs.append([path.read_bytes() for path in paths])
        if outputs[0] != outputs[1]:
            self.fault("threads", words, "other bytes with 1 and 2 threads")


def parse_error(text):
    if text.endswith("dB"):
        return 10 ** (-float(text[:-2]) / 20)
    return float(text[:-1]) / 100 if text.endswith("%") else float(text)


def judged(subject, seed, index, kinds, folder, keep):
    """(faults, figures, ratios) of one request; its folder stays where it failed and one is to be kept."""
    place = folder / f"{seed}-{index}"
    place.mkdir(parents=True, exist_ok=True)
    try:
        request, name = make_request(seed, index, kinds)
        judge = Judge(subject, request, name, place, np.random.default_rng([seed, index, 1]))
        judge.all()
        result = judge.faults, judge.figures, judge.ratios
    except Exception:  # a fault of the fuzzer itself must not pass as one without any
        result = [Fault("fuzzer", index, "", traceback.format_exc(), "")], collections.Counter(), []
    if not (keep and result[0]):
        shutil.rmtree(place)
    return result


def fuzz(seed, first, requests, seconds, kinds, keep=None, jobs=2, show=None):
    """(faults, figures, ratios, requests that were judged)."""
    folder = pathlib.Path(keep or tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
    faults, figures, ratios, done = [], collections.Counter(), [], 0
    begin = time.monotonic()
    try:
        subject = Subject(folder)
        kinds = [kind for kind in kinds if kind in ("image", "warp") or kind in subject.modes]
        with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
            waiting, index = collections.deque(), first
            while waiting or index < first + requests:
                late = time.monotonic() - begin > seconds
                while index < first + requests and len(waiting) < 2 * jobs and not late:
                    waiting.append(pool.submit(judged, subject, seed, index, kinds, folder, keep))
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
            shutil.rmtree(folder)
    return faults, figures, ratios, done


def summary(faults, figures, ratios, done):
    kinds = collections.Counter(fault.kind for fault in faults)
    high = kinds["prediction"]
    lines = [f"{done} requests, " + ", ".join(f"{count} {name}" for name, count in sorted(figures.items())),
             f"{high} of {len(ratios)} true errors above 1.5 times the prediction"]
    return "\n".join(lines + [f"{count:5} {kind}" for kind, count in sorted(kinds.items())])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--requests", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first request")
    parser.add_argument("--seconds", type=float, default=1e9, help="begin no request after so long")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--keep", help="folder that keeps inputs and outputs of the requests that fail")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()

    def show(fault):
        print(f"[{fault.number}] {fault.kind}: {fault.detail}\n    {fault.line}\n    {fault.plan}", flush=True)

    found = fuzz(options.seed, options.first, options.requests, options.seconds, options.kinds, options.keep, options.jobs, show)
    print(summary(*found))
    return 1 if found[0] else 0


if __name__ == "__main__":
    sys.exit(main())
