#!/usr/bin/python3
"""Compares promised with measured errors over random requests of many kinds.

    EDGEWISE=build/release/bin/edgewise benchmarks/promises.py --requests 500 --seed 1 [--kinds binary surface]

Each request is drawn by the seed and its number alone: a bundled volume, a phantom or a random volume; a mode, a view, a small output, a
budget of error; sometimes one path instead of the planner's. All output samples are compared with the reference (`--verify=all`). Prints
what broke, a Markdown table by kind, and the share of promises of which the measured error is within [1/3, 1].
"""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
DATA = ROOT / "data"

# Volumes, and between which parts of their values levels are drawn.
VOLUMES = {
    "head": (DATA / "ct_head/quarter.nhdr", -400, 1600),
    "chest": (DATA / "ct_chest/chest.nrrd", -700, 600),
    "brain": (DATA / "mr_brain/MR.nii.gz", 30, 300),
    "carotid": (DATA / "carotid/carotid.vtk", 60, 420),
    "neuron": (DATA / "neuron/neuron.tif", 20, 230),
    "hydrogen": (DATA / "hydrogen/hydrogen.vti", 8, 140),
    "engine": (DATA / "engine/engine.nii.gz", 30, 230),
    "gaussians": ("phantom:gaussians:48", .1, .8),
    "noise": ("phantom:noise:32", .2, .8),
    "sphere": ("phantom:sphere:40", .2, .8),
    "lobb": ("phantom:marschner-lobb:41", .2, .8),
}
LABELS = DATA / "frog/frogtissue.mhd"
# What a request of each kind says beside its mode, and how often it is drawn.
KINDS = {"binary": 3, "surface": 3, "labels": 1, "mip": 1, "xray": 1, "mean": 1, "composite": 1, "shaded": .7, "minip": .7, "stddev": .7,
         "top2": .7, "drr": .7, "warp": 1.5, "warp-labels": .7, "image": .7, "radon": .3}
PATHS = {
    "picture": ["project.ray_cast/filter=foh", "project.ray_cast/filter=bspline3", "project.ray_cast/filter=zoh", "project.shear_warp",
                "warp.backward/filter=foh", "warp.backward/filter=bspline3", "store.precision/type=u8"],
    "surface": ["project.ray_cast/filter=foh", "project.ray_cast/filter=bspline3", "surface.draw"],
    "labels": ["project.label_cast", "surface.draw"],
    "warp": ["warp.backward/filter=foh", "warp.backward/filter=bspline3", "warp.backward/filter=zoh", "warp.shear", "warp.permutation"],
    "warp-labels": ["warp.backward/filter=zoh", "warp.permutation"],
}


def number(value):
    return f"{float(value):.4g}"


def listed(values):
    return ",".join(map(number, values))


def size_of(rng, axes, most):
    return "x".join(str(rng.integers(most // 3, most + 1)) for _ in range(axes))


def random_labels(rng, folder, index):
    """A few balls and boxes, as small as one sample, of u8."""
    extent = rng.integers(16, 40, 3)
    z, y, x = np.indices(extent[::-1])
    labels = np.zeros(extent[::-1], np.uint8)
    for label in range(1, rng.integers(2, 9)):
        middle, half = rng.uniform(0, 1, 3) * extent, rng.uniform(.5, 9, 3)
        away = [np.abs(a - m) / h for a, m, h in zip((x, y, z), middle, half)]
        labels[(np.max(away, 0) if rng.random() < .5 else np.linalg.norm(away, axis=0)) <= 1] = label
    path = folder / f"{index}.nrrd"
    header = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {' '.join(map(str, extent))}\nspacings: 1 1 {number(rng.choice([1, 1, 2.5]))}\nencoding: raw\n\n"
    path.write_bytes(header.encode() + labels.tobytes())
    return path


def view_of(rng):
    words = ["--rotate", listed(np.where(rng.random(3) < .8, rng.uniform(-180, 180, 3), rng.choice([0, 90, 180], 3)))]
    if rng.random() < .25:
        words += ["--scale", number(rng.uniform(.6, 1.6))]
    return words


def request_of(seed, index, kinds, folder):
    """(kind, words)"""
    rng = np.random.default_rng([seed, index])
    weights = np.array([KINDS[kind] for kind in kinds])
    kind = str(rng.choice(kinds, p=weights / weights.sum()))
    budget = ["--max-error", number(np.exp(rng.uniform(np.log(.002), np.log(.1))))]
    forced = rng.random() < .35
    if kind == "image":
        words = ["warp", str(DATA / "coffee/coffee.png"), "--rotate", number(rng.uniform(-180, 180)), "--scale", number(rng.uniform(.1, 1.5)),
                 "--size", size_of(rng, 2, 96)]
        return kind, words + budget
    if kind == "radon":
        return kind, ["radon", f"phantom:{rng.choice(['zone-plate', 'checker'])}:{rng.integers(24, 64)}", "--angles", str(rng.integers(5, 40))] + budget
    if kind in ("labels", "warp-labels"):
        where = str(LABELS) if rng.random() < .4 else str(random_labels(rng, folder, index))
        words = ["render" if kind == "labels" else "warp", where, "--labels"] + view_of(rng)
        if kind == "labels":
            words += ["--mode", "surface", "--size", size_of(rng, 2, 64)]
        else:
            words += ["--size", size_of(rng, 3, 36)]
        paths = PATHS[kind]
    else:
        name = str(rng.choice(list(VOLUMES)))
        where, low, high = VOLUMES[name]
        job = "warp" if kind == "warp" else "render"
        words = [job, str(where)] + view_of(rng)
        words += ["--size", size_of(rng, 2 if job == "render" else 3, 64 if job == "render" else 32)]
        if rng.random() < .2:
            words += ["--reference", "linear"]
        if job == "render":
            words += ["--mode", "composite" if kind == "shaded" else kind]
            if rng.random() < .12:
                words += ["--perspective", number(rng.uniform(10, 70))]
        if kind in ("binary", "surface"):
            words += ["--isovalue", number(rng.uniform(low, high))]
        if kind in ("composite", "shaded") and rng.random() < .6:
            a, b = np.sort(rng.uniform(low, high, 2))
            words += ["--window", listed((a, b + (high - low) / 20))]
        if kind == "shaded":
            words += ["--shade", "phong"]
        paths = PATHS.get(kind, PATHS["picture"])
    if forced and paths:
        words += ["--via", str(rng.choice(paths))]
        budget = ["--max-error", "9"]
    return kind, words + budget


def environment(folder):
    """Neither a profile nor what was learned before changes a plan."""
    return {**os.environ, "XDG_CONFIG_HOME": str(folder / "config"), "XDG_CACHE_HOME": str(folder / "cache")}


Ran = collections.namedtuple("Ran", "index kind words code promised measured budget path draws seconds message")


def run(seed, index, kinds, folder, threads):
    kind, words = request_of(seed, index, kinds, folder)
    done = subprocess.run([EDGEWISE, *words, "-o", "null:", "--verify=all", "--json", "-", "--quiet", "--threads", str(threads)],
                          capture_output=True, text=True, env=environment(folder))
    budget = float(words[words.index("--max-error") + 1])
    try:
        report = json.loads(done.stdout)
    except json.JSONDecodeError:
        report = {}
    if done.returncode or not report.get("measured"):
        message = (report.get("error") or {}).get("message", done.stderr.strip())
        return Ran(index, kind, words, done.returncode, None, None, budget, "", 0, 0, message)
    path = " > ".join(step["transition"] + "".join(f"/{k}={v}" for k, v in sorted(step["parameters"].items()))
                      for step in report["plan"]["steps"])
    draws = (report.get("scene") or report.get("planning", {}).get("scene") or {}).get("draws", 0)
    return Ran(index, kind, words, 0, report["plan"]["predicted"]["error"], (report["measured"]["error"] or {}).get("nrmse"), budget, path,
               draws, report["planning"]["seconds"], "")


TINY = 2.1e-5  # weights of 14 bits, f32: what is promised in any case, and not judged from above


def verdict(ran):
    if ran.promised is None or ran.measured is None:
        return "unknown"
    if ran.measured > ran.promised + 1e-9:
        return "above"
    return "within" if ran.measured >= ran.promised / 3 or ran.promised <= TINY else "below"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--requests", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--all", action="store_true", help="list what is within as well")
    options = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp())
    try:
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            ran = list(pool.map(lambda i: run(options.seed, i, options.kinds, folder, 1),
                                range(options.first, options.first + options.requests)))
    finally:
        shutil.rmtree(folder)
    table = collections.defaultdict(list)
    for each in ran:
        if each.code:
            how = "no plan" if each.code == 3 else f"exit {each.code}"
            if each.code != 3 or options.all:
                print(f"{each.index} {how}: {' '.join(each.words)}: {each.message}")
        else:
            how = verdict(each)
            if how != "within" or each.measured > each.budget or options.all:
                print(f"{each.index} {how} promised {each.promised} measured {each.measured} budget {each.budget} draws {each.draws} "
                      f"planned in {each.seconds:.2f} s: {each.path}: {' '.join(each.words)}")
        table[each.kind].append((how, each))
        table["all"].append((how, each))
    print("\n| kind | ran | within [1/3, 1] | below | above | largest measured/promised | budgets broken | no plan | other |\n|---|---|---|---|---|---|---|---|---|")
    for kind in [*options.kinds, "all"]:
        rows = table.get(kind, [])
        count = collections.Counter(how for how, _ in rows)
        judged = count["within"] + count["below"] + count["above"]
        worst = max((each.measured / each.promised for how, each in rows if how in ("within", "below", "above") and each.promised > 0), default=0)
        broken = sum(each.code == 0 and each.measured is not None and each.measured > each.budget for _, each in rows)
        other = len(rows) - judged - count["no plan"]
        print(f"| {kind} | {judged} | {count['within']} ({100 * count['within'] / max(1, judged):.1f} %) | {count['below']} | {count['above']} | "
              f"{worst:.3g} | {broken} | {count['no plan']} | {other} |")
    sys.exit(0)


if __name__ == "__main__":
    main()
