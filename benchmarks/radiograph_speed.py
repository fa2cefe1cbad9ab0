#!/usr/bin/python3
"""One X-ray of 256 x 256 pixels through a spectrum that is in memory, by casting rays, and by plastimatch. For docs/spectrum.md.

    EDGEWISE=build/release/bin/edgewise benchmarks/radiograph_speed.py [--error 0.01] [--rounds 3]

One thread. In each round all three run one after the other; ratios are taken round by round, and their medians are
printed. Ours are differences of turntables of 40 and of 8 views, so that what is made once is in none of them; plastimatch
says its own seconds. The volume is a ball in 256^3 samples; all three are compared with the lengths of its chords. Needs
plastimatch, numpy and scipy; script/setup --bench installs them. Run it on a quiet machine.
"""
import argparse
import subprocess

import numpy as np
from side_by_side import WORK, ball_error, edgewise, read_nrrd, seconds_of

FEW, MANY = 8, 40
BALL = WORK / "ball.mha"
WAYS = {"spectrum": ["--via", "spectrum.forward", "--via", "spectrum.slice"], "cast": ["--via", "project.ray_cast"]}


def make_ball():
    subprocess.run(["plastimatch", "synth", "--pattern", "sphere", "--output", BALL, "--dim", "256 256 256", "--spacing", "1 1 1",
                    "--origin", "-127.5 -127.5 -127.5", "--radius", "100 100 100", "--foreground", "1000", "--background", "0"],
                   check=True, capture_output=True)


def plastimatch():
    done = subprocess.run(["plastimatch", "drr", "-t", "raw", "-N", "10", "-a", "8", "-i", "uniform", "--sad", "10000", "--sid",
                           "10100", "-r", "256 256", "-z", "256 256", "-O", str(WORK / "drr_"), BALL],
                          check=True, capture_output=True, text=True).stdout
    return float(next(line for line in done.splitlines() if line.startswith("Total time")).split()[2]) / 8


def request(options, way, views):
    return ["render", BALL, "-o", WORK / f"{way}_%03d.nrrd", "--mode", "xray", "--turntable", views, "--size", "256x256",
            "--spacing", 1, "--max-error", options.error, *WAYS[way]]


def ours(options, way):
    return (seconds_of(*request(options, way, MANY), repeat=3) - seconds_of(*request(options, way, FEW), repeat=3)) / (MANY - FEW)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--error", type=float, default=0.01)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    make_ball()
    rows = []
    for _ in range(options.rounds):
        rows.append((plastimatch(), ours(options, "spectrum"), ours(options, "cast")))
    rows = np.array(rows)
    theirs = ball_error(np.fromfile(WORK / "drr_0000.raw", "f4"), 10000, 10100)
    errors = {way: ball_error(read_nrrd(WORK / f"{way}_000.nrrd")) for way in WAYS}
    print("| way | each view [ms] | times as fast as it is the spectrum | of the rounds | error |\n|---|---|---|---|---|")
    for name, column, error in (("plastimatch drr, uniform", 0, theirs), ("cast", 2, errors["cast"])):
        ratios = rows[:, column] / rows[:, 1]
        print(f"| {name} | {1e3 * np.median(rows[:, column]):.1f} | {np.median(ratios):.1f} | {ratios.min():.1f} to "
              f"{ratios.max():.1f} | {error:.2g} |")
    print(f"| spectrum | {1e3 * np.median(rows[:, 1]):.1f} | | | {errors['spectrum']:.2g} |")
    for way in WAYS:
        report = edgewise(*request(options, way, FEW), "--verify")
        path = " > ".join(step["transition"] + "".join(f"/{k}={v}" for k, v in sorted(step["parameters"].items()))
                          for step in report["plan"]["steps"])
        print(f"{way}: {path}; NRMSE {report['measured']['error']['nrmse']:.2g}")


if __name__ == "__main__":
    main()
