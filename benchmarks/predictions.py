#!/usr/bin/python3
"""Compares predicted with measured seconds over requests of many kinds: the chosen plan and forced ones.

    EDGEWISE=build/release/bin/edgewise benchmarks/predictions.py [--machine default] [--threads N]

Prints a Markdown table with the ratio predicted / measured for each request, and quartiles of its distribution. The
least of many repeats is compared: what else runs on the machine only makes them longer.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
HEAD, BRAIN = str(ROOT / "data/ct_head/quarter.nhdr"), str(ROOT / "data/mr_brain/MR.nii.gz")

REQUESTS = [
    ("render", HEAD),
    ("render", HEAD, "--rotate", "15,40,5"),
    ("render", HEAD, "--mode", "xray", "--rotate", "15,40,5"),
    ("render", HEAD, "--mode", "composite", "--rotate", "-30,10,0"),
    ("render", HEAD, "--mode", "mean", "--turntable", "12"),
    ("render", BRAIN, "--mode", "xray", "--turntable", "24"),
    ("render", BRAIN, "--rotate", "20,30,0", "--via", "project.ray_cast/filter=foh/step=1"),
    ("render", BRAIN, "--rotate", "20,30,0", "--via", "project.shear_warp"),
    ("render", BRAIN, "--rotate", "20,30,0", "--via", "warp.backward/filter=foh", "--via", "project.combine"),
    ("render", BRAIN, "--rotate", "20,30,0", "--mode", "xray", "--via", "spectrum.slice"),
    ("render", "phantom:gaussians:160", "--rotate", "33,20,7", "--mode", "composite", "--max-error", "0.001"),
    ("render", "phantom:noise:96", "--rotate", "33,20,7", "--max-error", "0.02"),
    ("render", "phantom:marschner-lobb:200", "--rotate", "10,80,0", "--via", "project.ray_cast/filter=bspline3/step=0.5"),
    ("warp", HEAD, "--rotate", "5,10,15"),
    ("warp", BRAIN, "--rotate", "5,10,15", "--via", "warp.backward/filter=bspline3"),
    ("warp", BRAIN, "--rotate", "5,10,15", "--via", "warp.permutation/filter=foh"),
    ("warp", BRAIN, "--rotate", "90,0,0"),
    ("warp", BRAIN, "--scale", "1.5"),
    ("warp", "phantom:gaussians:200", "--rotate", "20,30,40", "--via", "warp.shear/filter=foh"),
    ("warp", "phantom:gaussians:200", "--rotate", "20,30,40", "--via", "warp.backward/filter=zoh"),
    ("warp", "phantom:zone-plate:2048", "--rotate", "30", "--via", "warp.backward/filter=foh"),
    ("warp", "phantom:zone-plate:1500", "--rotate", "30", "--max-error", "0.05"),
    ("warp", "phantom:checker:1024", "--rotate", "77", "--via", "warp.shear/filter=bspline3"),
]


def measure(request, options):
    arguments = [EDGEWISE, *request, "-o", "null:", "--json", "-", "--quiet", "--repeat", "9", "--threads",
                 str(options.threads)]
    if options.machine:
        arguments += ["--machine", options.machine]
    if "--via" in request:
        arguments += ["--max-error", "1"]
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(arguments)}: exit {done.returncode}: {done.stderr}")
    report = json.loads(done.stdout)
    steps = " ".join(step["transition"] + "".join(f"/{k}={v}" for k, v in sorted(step["parameters"].items()))
                     for step in report["plan"]["steps"])
    return report["plan"]["predicted"]["seconds"], min(report["measured"]["seconds"]), steps


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--machine")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    ratios = []
    print("| request | plan | predicted [ms] | measured [ms] | ratio |")
    print("|---|---|---|---|---|")
    for request in REQUESTS:
        predicted, measured, steps = measure(request, options)
        ratios.append(predicted / measured)
        name = " ".join(a.replace(str(ROOT) + "/", "") for a in request)
        print(f"| {name} | {steps} | {predicted * 1e3:.1f} | {measured * 1e3:.1f} | {ratios[-1]:.2f} |", flush=True)
    off = np.exp(np.abs(np.log(ratios))) - 1
    low, middle, high = np.percentile(ratios, [25, 50, 75])
    print(f"\nratio: median {middle:.2f}, quartiles {low:.2f} and {high:.2f}, extremes {min(ratios):.2f} and "
          f"{max(ratios):.2f}; off by (factor - 1): median {np.median(off):.0%}, 90 % below {np.percentile(off, 90):.0%}")


if __name__ == "__main__":
    main()
