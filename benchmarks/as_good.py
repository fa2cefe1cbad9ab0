#!/usr/bin/python3
"""How often "as good as linear" holds: the error of the chosen path beside that of the plain one, over random requests.

    EDGEWISE=build/release/bin/edgewise benchmarks/as_good.py --requests 500 --seed 1 [--kinds mip xray]

Requests are those of promises.py without an error budget. Each asks for 1 to 5000 repeated runs, since the planner draws errors only
where that pays. Where another path than the plain one is chosen, both are run, and all samples of both results are compared with the
reference (`--verify=all`). Their ratio should be at most 1.05. Prints what was beyond it, and a Markdown table by kind and by volume.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np

import promises
from gallery_runs import step_words

LIMIT = 1.05
KINDS = ["mip", "xray", "mean", "composite", "shaded", "minip", "stddev", "top2", "drr", "warp", "image"]


def without(words, option):
    """The words less an option and its value."""
    at = words.index(option) if option in words else None
    return words if at is None else words[:at] + words[at + 2:]


def request_of(seed, index, kinds, folder):
    """(kind, volume, words, repeat)"""
    kind, words = promises.request_of(seed, index, kinds, folder)
    for option in ("--max-error", "--via", "--reference"):
        words = without(words, option)
    rng = np.random.default_rng([seed, index, 1])
    longer = 192 if kind != "warp" else 48
    words = without(words, "--size") + ["--size", promises.size_of(rng, 3 if kind == "warp" else 2, longer)]
    return kind, pathlib.Path(words[1]).name, words, int(np.exp(rng.uniform(0, np.log(5000))))


def report_of(words, environment):
    done = subprocess.run([promises.EDGEWISE, *words, "-o", "null:", "--json", "-", "--quiet", "--threads", "1"],
                          capture_output=True, text=True, env=environment)
    if done.returncode:
        raise RuntimeError(done.stderr.strip()[-200:])
    return json.loads(done.stdout)


def error_by(steps, words, environment):
    """The measured error of a path, or None where it cannot be had alone."""
    via = [word for step in steps for word in ("--via", step)]
    for _ in range(4):
        report = report_of([*words, *via, "--verify=all"], environment)
        taken = list(map(step_words, report["plan"]["steps"]))
        more = [step.split("/")[0] for step in taken if step not in steps]
        if taken == steps:
            return report["measured"]["error"]["nrmse"]
        if not more:
            return None
        via += [word for name in dict.fromkeys(more) for word in ("--without", name)]
    return None


Ran = collections.namedtuple("Ran", "index kind volume words chosen ratio message")


def run(seed, index, kinds, folder):
    kind, volume, words, repeat = request_of(seed, index, kinds, folder)
    environment = promises.environment(folder)
    path, ratio, message = "", None, ""
    try:
        plan = report_of(["plan", *words, "--repeat", str(repeat)], environment)["plan"]
        steps, plain = list(map(step_words, plan["steps"])), plan.get("plain")
        path = " > ".join(steps)
        if steps == [plain]:
            ratio = 1.0
        elif plain:
            chosen, usual = error_by(steps, words, environment), error_by([plain], words, environment)
            if chosen is None or usual is None:
                message = "one of the two does not run alone"
            else:  # rounding is no loss
                ratio = 1.0 if chosen <= promises.TINY else chosen / max(usual, 1e-300)
    except RuntimeError as error:
        message = str(error)
    return Ran(index, kind, volume, [*words, "--repeat", str(repeat)], path, ratio, message)


def print_table(name, ran):
    print(f"\n| {name} | compared | another path than the plain one | as good | largest ratio | did not run |\n|---|---|---|---|---|---|")
    groups = collections.defaultdict(list)
    for each in ran:
        groups[getattr(each, name)].append(each)
    for group, some in [*sorted(groups.items()), ("all", ran)]:
        ratios = [each.ratio for each in some if each.ratio is not None]
        good, other = sum(ratio <= LIMIT for ratio in ratios), sum(ratio != 1.0 for ratio in ratios)
        print(f"| {group} | {len(ratios)} | {other} | {good} ({100 * good / max(1, len(ratios)):.1f} %) | {max(ratios, default=0):.3g} | "
              f"{len(some) - len(ratios)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--requests", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp())
    try:
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            ran = list(pool.map(lambda index: run(options.seed, index, options.kinds, folder), range(options.requests)))
    finally:
        shutil.rmtree(folder)
    for each in ran:
        if each.ratio is None or each.ratio > LIMIT:
            print(f"{each.index} {each.message or f'{each.ratio:.3f}'}: {each.chosen}: {' '.join(each.words)}")
    print_table("kind", ran)
    print_table("volume", ran)


if __name__ == "__main__":
    main()
