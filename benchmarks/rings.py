#!/usr/bin/python3
"""Rings of the default pictures of bundled data, and what being free of them costs.

    EDGEWISE=build/release/bin/edgewise benchmarks/rings.py [--repeat 7] [--before OTHER]

A picture is held against one with steps of 1/16. Differences are averaged over 3 x 3 pixels, so that noise cancels and rings stay. Prints
a Markdown table: their 99.9 % quantile, in levels of 255, with steps of 1 and by default, the step that the plan takes, and seconds by
default over seconds with a step of 1 (medians of runs that take turns). With --before, the command of another version, also seconds of whole
commands over those of that one.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile
import time

import cv2
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
DATA = ["mr_brain/MR.nii.gz", "ct_chest/chest.nrrd", "ct_head/quarter.nhdr", "engine/engine.nii.gz", "neuron/neuron.tif",
        "carotid/carotid.vtk", "hydrogen/hydrogen.vti", "frog/frogtissue.mhd"]
CAST = "project.ray_cast/filter=foh/step="


def picture(file, out, options):
    """Colours as they are shown, in levels, and the report."""
    words = [EDGEWISE, "render", file, "--size", "384", "--bits", "32", "-o", out, *options, "--json", "-"]
    done = subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True)
    return 255 * np.clip(cv2.imread(str(out), cv2.IMREAD_UNCHANGED)[..., :3], 0, 1), json.loads(done.stdout)


def against(before, file, mode, repeat):
    """Seconds of whole commands over those of another version (medians of pairs)."""
    def seconds(command):
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            subprocess.run([command, "render", str(file), "-o", f"{folder}/picture.png", "--size", "384", "--quiet", *mode], check=True)
            return time.perf_counter() - begin
    seconds(before), seconds(EDGEWISE)
    return statistics.median(1 / (seconds(before) / seconds(EDGEWISE)) for _ in range(repeat))


def ring(shown, fine):
    return np.quantile(np.abs(cv2.blur(shown - fine, (3, 3))), 0.999)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--before", help="the command of another version")
    asked = parser.parse_args()
    repeat, before = asked.repeat, asked.before
    more = (" whole command, now / before |", "---:|") if before else ("", "")
    print(f"| data | mode | rings, step 1 | rings, default | step | seconds, default / step 1 |{more[0]}\n|---|---|---:|---:|---:|---:|{more[1]}")
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "picture.tif"
        for name in DATA:
            file = ROOT / "data" / name
            for mode in (["--mode", "shaded"], ["--mode", "composite"]):
                by_one = [*mode, "--via", CAST + "1"]
                fine, _ = picture(file, out, [*mode, "--max-error", "10", "--via", CAST + "0.0625"])
                rough, _ = picture(file, out, by_one)
                shown, report = picture(file, out, mode)
                ratios = []
                for _ in range(repeat):
                    runs = [picture(file, out, options)[1]["measured"]["seconds"][0] for options in (mode, by_one)]
                    ratios.append(runs[0] / runs[1])
                step = report["plan"]["steps"][-1]["parameters"].get("step")
                print(f"| {name.split('/')[0]} | {mode[1]} | {ring(rough, fine):.1f} | {ring(shown, fine):.1f} | {step or '-'} | "
                      f"{statistics.median(ratios):.2f} |", f"{against(before, file, mode, repeat):.2f} |" if before else "", flush=True)


if __name__ == "__main__":
    main()
