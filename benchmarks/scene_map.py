#!/usr/bin/python3
"""Which path wins where: a grid of scenes, each with its paths run and the planner's choice among them.

Scenes are dense, almost empty and empty volumes, of 8^3 to 512^3 samples, in six modes, as pictures of 64^2 to 1024^2, once and
as turntables. Of each the fastest path within an error of 0.02 is told by what was measured, with how much longer the best path of
another family takes. Writes a table in Markdown and the measurements as JSON.
Usage: EDGEWISE=build/release/bin/edgewise benchmarks/scene_map.py [OUT.md [OUT.json [VOLUME...]]], VOLUME: dense8, dense32, dense128,
dense512, sparse128, sparse512, empty128
"""
import itertools
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy import ndimage

EDGEWISE = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
WORK = pathlib.Path(tempfile.mkdtemp(prefix="edgewise-map-"))
PREPARATIONS = {"store.crop", "store.precision", "filter.prefilter", "warp.axis_permutation"}
LIMIT, WIDE_LIMIT, BUDGET = 14, 7, 0.02  # paths of a scene; of those that take minutes


def write_nrrd(path, samples):
    header = (f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {' '.join(map(str, samples.shape[::-1]))}\nspacings: 1 1 1\n"
              "endian: little\nencoding: raw\n\n")
    path.write_bytes(header.encode() + samples.tobytes())


def volume(kind, n):
    rng = np.random.default_rng(7)
    if kind == "empty":
        return np.zeros((n, n, n), "u1")
    if kind == "dense":
        smooth = ndimage.gaussian_filter(rng.random((n, n, n)).astype("f4"), n / 40, mode="wrap")
        return np.uint8(255 * (smooth - smooth.min()) / np.ptp(smooth))
    samples = np.zeros((n, n, n), "f4")
    for _ in range(6):  # vessels: balls along a few curves
        at, way = rng.uniform(0.2, 0.8, 3) * n, rng.normal(size=3)
        for _ in range(n):
            way = way + 0.3 * rng.normal(size=3)
            at = np.clip(at + way / np.linalg.norm(way), 2, n - 3)
            samples[tuple(at.astype(int))] = 1
    return np.uint8(255 * np.minimum(1, 4 * ndimage.gaussian_filter(samples, max(0.7, n / 160))))


def transfer(name, opacity):
    file = WORK / f"{name}.json"
    file.write_text(json.dumps({"points": [{"value": 40, "opacity": 0, "color": [1, 0.8, 0.6]},
                                           {"value": 160, "opacity": opacity, "color": [1, 0.9, 0.8]}]}))
    return ["--mode", "composite", "--transfer", file]


def family(steps):
    """Edges of a path, without preparations and parameters."""
    return " > ".join(step.split("/")[0] for step in steps if step.split("/")[0] not in PREPARATIONS)


def measured(source, words, frames, size, limit=LIMIT):
    out = WORK / "chart.json"
    turn = ["--turntable", frames] if frames > 1 else ["--rotate", "20,30,0"]
    done = subprocess.run([EDGEWISE, "chart", "render", source, *map(str, [*words, *turn, "--size", size]), "--limit", str(limit), "-o",
                           str(out), "--quiet"], capture_output=True, text=True)
    if done.returncode:
        print(f"{source} {words}: {done.stderr}", file=sys.stderr)
        return None
    rows = []
    for point in json.loads(out.read_text())["points"]:
        got = point["measured"]
        error = got.get("error")
        error = error["nrmse"] if isinstance(error, dict) else error
        seconds = got["seconds"]
        seconds = float(np.median(seconds)) if isinstance(seconds, list) else seconds
        steps = [f"{step['transition']}" + "".join(f"/{k}={v}" for k, v in step["parameters"].items()) for step in point["plan"]["steps"]]
        if error is not None and error <= BUDGET and seconds:
            rows.append((seconds, error, family(steps), " > ".join(steps)))
    return sorted(rows)


def chosen(source, words, frames, size):
    turn = ["--turntable", frames] if frames > 1 else ["--rotate", "20,30,0"]
    done = subprocess.run([EDGEWISE, "plan", "render", source, *map(str, [*words, *turn, "--size", size]), "--max-error", str(BUDGET),
                           "--json", "-", "--quiet"], capture_output=True, text=True)
    if done.returncode:
        return "none"
    return family([step["transition"] for step in json.loads(done.stdout)["plan"]["steps"]])


def main():
    modes = {"mip": ["--mode", "mip"], "xray": ["--mode", "xray"], "faint": transfer("faint", 0.02), "opaque": transfer("opaque", 0.9),
             "shaded": [*transfer("shaded", 0.9), "--shade", "phong"], "surface": ["--mode", "surface", "--isovalue", 100]}
    lines = ["| volume | mode | picture | views | fastest within 0.02 | ms a view | next family | times as long | the planner's choice |",
             "|---|---|---:|---:|---|---:|---|---:|---|"]
    wins, everything, scenes = {}, [], []
    middle, wide = [(64, 1), (64, 24), (384, 1), (384, 24)], [(64, 1), (64, 360), (1024, 1)]
    volumes = {("dense", 8): wide, ("dense", 32): middle, ("dense", 128): middle, ("dense", 512): wide, ("sparse", 128): middle,
               ("sparse", 512): wide, ("empty", 128): wide}
    for (kind, n), (mode, words) in itertools.product(volumes, modes.items()):
        if sys.argv[3:] and f"{kind}{n}" not in sys.argv[3:]:
            continue
        scenes += [(kind, n, mode, words, size, frames) for size, frames in volumes[kind, n]]
    for kind, n, mode, words, size, frames in scenes:
        source = WORK / f"{kind}{n}.nrrd"
        if not source.exists():
            write_nrrd(source, volume(kind, n))
        rows = measured(source, words, frames, size, WIDE_LIMIT if volumes[kind, n] is wide else LIMIT)
        if not rows:
            continue
        best = rows[0]
        other = next((row for row in rows if row[2] != best[2]), None)
        choice = chosen(source, words, frames, size)
        wins[best[2]] = wins.get(best[2], 0) + 1
        everything.append({"volume": f"{kind} {n}^3", "mode": mode, "size": size, "frames": frames, "chosen": choice,
                           "paths": [{"seconds": s, "error": e, "path": p} for s, e, _, p in rows]})
        following = f"`{other[2]}` | {other[0] / best[0]:.2f}" if other else "- | -"
        lines.append(f"| {kind} {n}³ | {mode} | {size}² | {frames} | `{best[2]}` | {best[0] / frames * 1e3:.2f} | {following} | `{choice}` |")
        print(lines[-1], flush=True)
    table = "\n".join(lines) + "\n\nWins: " + ", ".join(f"`{name}` {count}" for name, count in sorted(wins.items(), key=lambda w: -w[1])) + "\n"
    if len(sys.argv) > 1:
        pathlib.Path(sys.argv[1]).write_text(table)
    if len(sys.argv) > 2:
        pathlib.Path(sys.argv[2]).write_text(json.dumps(everything, indent=1))


if __name__ == "__main__":
    main()
