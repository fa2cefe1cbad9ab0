#!/usr/bin/python3
"""From how many views on a spectrum costs less than casting: predicted and measured. For docs/spectrum.md.

    EDGEWISE=build/release/bin/edgewise benchmarks/break_even.py [--sides 128,256,384] [--error E] [--repeat N]

For each side it makes X-rays of a generated phantom from a turntable, once by the fastest path through a spectrum and once
by the fastest rays (project.ray_cast, with whatever it needs) that keep the same error. Seconds of either are a start plus
a number for each view: both come from one view and from many, predicted by `edgewise plan` and measured as medians on one
thread. The lines cross at the number of views that is printed. Errors of the many views are verified. Run it on a quiet
machine.
"""
import argparse
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
WAYS = {"spectrum": ["--via", "spectrum.slice/band=volume"], "cast": ["--via", "project.ray_cast"]}


def run(*words):
    done = subprocess.run([EDGEWISE, *map(str, words), "--json", "-", "--quiet"], capture_output=True, text=True)
    if done.returncode:
        said = done.stderr.strip().splitlines()
        sys.exit(f"{' '.join(map(str, words))}: exit {done.returncode}: " +
                 next((line for line in said if line.startswith("edgewise:")), "\n".join(said[-3:])))
    return json.loads(done.stdout)


def request(options, side, views, way):
    machine = ["--machine", options.machine] if options.machine else []
    return ["render", f"phantom:{options.phantom}:{side}", "--mode", "xray", "--reference", "spline", "--rotate",
            "15,0,5", "--turntable", views, "--max-error", options.error, "--threads", 1, *machine, *WAYS[way]]


def path_of(report):
    return " > ".join(step["transition"] + "".join(f"/{key}={value}" for key, value in sorted(step["parameters"].items()))
                      for step in report["plan"]["steps"])


def line_through(seconds):
    """Start and seconds a view of what takes these seconds, by the number of views."""
    (few, low), (many, high) = sorted(seconds.items())
    each = (high - low) / (many - few)
    return low - few * each, each


def crossing(spectrum, cast):
    """Views from which on the first costs less; infinite where it never does."""
    gain = cast[1] - spectrum[1]
    return max(1.0, (spectrum[0] - cast[0]) / gain) if gain > 0 else math.inf


def look_at(options, side):
    lines = {"predicted": {}, "measured": {}}
    paths, errors = {}, {}
    for way in WAYS:
        predicted, measured = {}, {}
        for views in (1, options.views):
            # The same path at both numbers of views: the one of many.
            if way not in paths:
                paths[way] = path_of(run("plan", *request(options, side, options.views, way)))
            words = request(options, side, views, way)
            base = words[:words.index("--via")]
            base[base.index("--max-error") + 1] = 10  # one view alone may have a little more
            for step in paths[way].split(" > "):
                base += ["--via", step]
            predicted[views] = run("plan", *base)["plan"]["predicted"]["seconds"]
            report = run(*base, "-o", "null:", "--repeat", options.repeat, "--verify")
            measured[views] = statistics.median(report["measured"]["seconds"])
            if views > 1:
                errors[way] = report["measured"]["error"]["nrmse"]
        lines["predicted"][way], lines["measured"][way] = line_through(predicted), line_through(measured)
    views = {kind: crossing(by_way["spectrum"], by_way["cast"]) for kind, by_way in lines.items()}
    return views, lines, paths, errors


def number(views):
    return "never" if math.isinf(views) else f"{views:.1f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sides", default="128,256,384")
    parser.add_argument("--phantom", default="gaussians")
    parser.add_argument("--error", type=float, default=0.0003)
    parser.add_argument("--views", type=int, default=24, help="how many are many")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--machine")
    options = parser.parse_args()
    print("| side | views, predicted | measured | ratio | spectrum: start + each view [ms] | casting | largest error |")
    print("|---|---|---|---|---|---|---|")
    for side in map(int, options.sides.split(",")):
        views, lines, paths, errors = look_at(options, side)
        known = not any(map(math.isinf, views.values()))
        ratio = f"{views['predicted'] / views['measured']:.2f}" if known else "-"
        by_way = {way: "{:.0f} + {:.1f}".format(*(1e3 * part for part in lines["measured"][way])) for way in WAYS}
        print(f"| {side} | {number(views['predicted'])} | {number(views['measured'])} | {ratio} | {by_way['spectrum']} "
              f"| {by_way['cast']} | {max(errors.values()):.1e} |", flush=True)
        for way, path in paths.items():
            print(f"{side}, {way}: {path}", file=sys.stderr)
        if max(errors.values()) > options.error:
            sys.exit(f"{side}: an error of {max(errors.values()):.2g} where {options.error:.2g} was asked for")


if __name__ == "__main__":
    main()
