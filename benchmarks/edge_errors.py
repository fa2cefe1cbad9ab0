#!/usr/bin/python3
"""Measured error of each edge on the bundled MR brain turned by 30, 20 and 10 degrees, as a table in
Markdown. EDGEWISE: the command, default build/release/bin/edgewise."""
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
HEAD = ROOT / "data/mr_brain/MR.nii.gz"
TURN = ["--rotate", "30,20,10"]

# What is shown, the verb and its mode, and the path that is forced.
ROWS = [
    ("warp.backward, zoh", ["warp"], ["warp.backward/filter=zoh"]),
    ("warp.backward, foh", ["warp"], ["warp.backward/filter=foh"]),
    ("warp.backward, keys", ["warp"], ["warp.backward/filter=keys"]),
    ("warp.backward, lanczos3", ["warp"], ["warp.backward/filter=lanczos3"]),
    ("filter.prefilter, warp.backward, bspline3", ["warp"], ["warp.backward/filter=bspline3"]),
    ("warp.permutation, me", ["warp"], ["warp.permutation/filter=me"]),
    ("warp.permutation, zoh", ["warp"], ["warp.permutation/filter=zoh"]),
    ("warp.permutation, foh", ["warp"], ["warp.permutation/filter=foh"]),
    ("warp.shear, foh", ["warp"], ["warp.shear/filter=foh"]),
    ("warp.shear, bspline3", ["warp"], ["warp.shear/filter=bspline3"]),
] + [
    (f"{edges[-1]}, {mode}", ["render", "--mode", mode], edges)
    for mode, paths in (
        ("mip", (["project.shear_warp/filter=foh"], ["project.ray_cast/filter=zoh/step=1"],
                 ["project.ray_cast/filter=foh/step=1"],
                 ["project.ray_cast/filter=bspline3/step=0.5"],
                 ["warp.backward/filter=bspline3", "project.combine"],
                 ["warp.scale/filter=bspline3", "project.parallel_product/filter=foh"],
                 ["store.reduce/level=1", "project.level_cast/step=2"])),
        ("xray", (["project.splat"], ["store.reduce/level=1", "project.level_cast/step=2"],
                  ["project.shear_warp/filter=foh"], ["project.ray_cast/filter=foh/step=1"],
                  ["warp.scale/filter=bspline3", "project.parallel_product/filter=foh"],
                  ["spectrum.forward/width=4", "spectrum.inverse"],
                  ["spectrum.forward/width=6", "spectrum.inverse"])),
        ("composite", (["project.shear_warp/filter=foh"], ["project.ray_cast/filter=foh/step=1"],
                       ["warp.scale/filter=bspline3", "project.parallel_product/filter=foh"],
                       ["project.splat_sheets"], ["store.reduce/level=1", "project.level_cast/step=2"],
                       ["project.ray_cast/filter=bspline3/step=0.5"])))
    for edges in paths
]


def measured(verb, path):
    forced = [word for edge in path for word in ("--via", edge)]
    done = subprocess.run([EDGEWISE, *verb[:1], str(HEAD), "-o", "null:", *verb[1:], *TURN, *forced,
                           "--max-error", "10", "--verify", "--json", "-", "--quiet"],
                          capture_output=True, text=True)
    if done.returncode:
        return None, done.stderr.strip()
    report = json.loads(done.stdout)
    return report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]


def main():
    print("| path | error predicted | error measured |\n|---|---|---|")
    for name, verb, path in ROWS:
        predicted, error = measured(verb, path)
        if predicted is None:
            print(f"| {name} | refused | {error} |")
        else:
            print(f"| {name} | {predicted:.2g} | {error:.2g} |")


if __name__ == "__main__":
    main()
