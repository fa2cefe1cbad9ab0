#!/usr/bin/python3
"""What choosing a path costs, and what it saves: the plain path beside planning and the path that was chosen, and the best one.

For a request of F frames, in seconds:
  planning  between samples in memory and the start of the path, less the preset, which the plain path needs as well: that
            is a column of its own, as reading is. Results go to null:, so no window of values is looked for.
  chosen    the path that the planner takes, all frames.
  plain     the path that `linear` compares with, all frames: `plan.plain` of the report, through --via. With an error budget,
            what the same request without one names. Filters have none: separable sums where they are offered, direct ones
            else, as the list below says.
  best      the fastest path that does as well, known beforehand, without planning: what --planner exhaustive finds, or the
            chosen one where that runs faster, or the plain one where there is no error budget that it might break.

The figures are plain / (planning + chosen), above 1 where choosing pays, and (planning + chosen) / best. Each run is a process
of its own with an empty folder of caches, so nothing is known of the file and caches are cold, on all sides alike. All
sides run in turns, the order turned round every time; a time is the median over the processes, of all sides that took the
same path. Then the chosen command runs once more with the cache that it left: the second request of a kind. Reports
are asked for (--json); what they show in addition is worked out after the choice, and is not counted.

    EDGEWISE=build/release/bin/edgewise benchmarks/value.py [--quick] [--runs 3] [--json FILE] [--chart STEM]
        [--data FOLDER] [--machine FILE|NAME] [--only WORD,...] [--from FILE]
    ... --json benchmarks/results/value.json --chart docs/planner/value     what is kept, of a machine that does nothing else

--quick takes a dozen requests and about a minute of an idle machine, all of them half an hour. --data FOLDER takes the
volumes in it (files, or a folder each) in place of the bundled ones. --only takes requests whose line has one of these words.
--chart draws STEM.svg and STEM.png; with --from FILE of what --json wrote it is drawn again, and nothing runs. The
machine's profile is that of the user (edgewise calibrate), else the built-in one. Needs numpy; --chart needs matplotlib.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import numpy as np

from gallery_runs import EDGEWISE, ROOT, step_words

VOLUMES = {"mr": "data/mr_brain/MR.nii.gz", "chest": "data/ct_chest/chest.nrrd", "engine": "data/engine/engine.nii.gz",
           "carotid": "data/carotid/carotid.vtk"}
IMAGE = "data/coffee/coffee.png"
MODES = ("mip", "xray", "composite", "shaded")
BUDGET = ("--max-error", "0.01")
VIEW = ("--rotate", "20,30,10")


class Failed(Exception):
    pass


class Request:
    """@param own  the plain path of a request that no edge has one for"""

    def __init__(self, data, verb, file, words, frames=1, budget=(), own=None):
        self.data, self.verb, self.file, self.frames, self.own = data, verb, file, frames, own
        self.words, self.budget = list(map(str, words)), list(budget)
        turns = ["--turntable", str(frames)] if frames > 1 else []
        self.words += turns

    def line(self):
        return " ".join([self.verb, self.data, *self.words, *self.budget])

    def kind(self):
        at = self.words.index("--mode") + 1 if "--mode" in self.words else None
        return self.words[at] if at else self.verb


def pictures(name, file, modes, size, frames=1, budget=()):
    return [Request(name, "render", file, ["--mode", mode, "--size", f"{size}x{size}", *VIEW], frames, budget) for mode in modes]


def volume_requests(volumes):
    some = []
    for name, file in volumes.items():
        for size in (128, 384, 1024):
            some += pictures(name, file, MODES, size)
        some += pictures(name, file, MODES, 256, 24)
        some += pictures(name, file, ("mip", "xray", "composite"), 192, 120)
        some += pictures(name, file, ("mip", "xray"), 128, 360)
        some += pictures(name, file, MODES, 384, 1, BUDGET) + pictures(name, file, ("mip", "xray"), 256, 24, BUDGET)
        some += [Request(name, "warp", file, ["--rotate", "10,20,30"]), Request(name, "warp", file, ["--rotate", "10,20,30"], 1, BUDGET),
                 Request(name, "warp", file, ["--scale", "1.4"])]
        some += [Request(name, "filter", file, ["--op", "convolve", "--kernel", "gauss:1.5"], own="filter.separable"),
                 Request(name, "filter", file, ["--op", "convolve", "--kernel", "sphere:2"], own="filter.backward"),
                 Request(name, "filter", file, ["--op", "dilate", "--kernel", "box:2"], own="filter.separable"),
                 Request(name, "filter", file, ["--op", "median", "--kernel", "box:1"], own="filter.median")]
    return some


def image_requests():
    some = []
    for size in (128, 512, 1024):
        grid = ["--size", f"{size}x{size}"]
        some += [Request("coffee", "warp", IMAGE, ["--rotate", "20", *grid]), Request("coffee", "warp", IMAGE, ["--rotate", "20", *grid], 1, BUDGET)]
    return some + [Request("coffee", "warp", IMAGE, ["--scale", "2.5"])]


def quick_requests(volumes):
    """One of each kind, in little time."""
    (name, file), *_ = [each for each in volumes.items() if each[0] == "chest"] or volumes.items()
    return [*pictures(name, file, MODES, 256), *pictures(name, file, ("mip", "xray"), 128, 24), *pictures(name, file, ("mip", "composite"), 96, 120),
            *pictures(name, file, ("mip",), 64, 360), *pictures(name, file, ("mip", "xray"), 256, 1, BUDGET),
            Request(name, "warp", file, ["--rotate", "10,20,30"]), Request("coffee", "warp", IMAGE, ["--rotate", "20", "--size", "512x512"]),
            Request(name, "filter", file, ["--op", "convolve", "--kernel", "gauss:1.5"], own="filter.separable")]


def volumes_in(folder):
    """What the command can read as a volume: each file, or each folder as a series, else the first such file in it."""
    def is_volume(path):
        done = subprocess.run([EDGEWISE, "info", str(path), "--json", "-"], cwd=ROOT, capture_output=True, text=True)
        return done.returncode == 0 and json.loads(done.stdout)["kind"] == "volume"

    found = {}
    for path in sorted(folder.resolve().iterdir()):
        tried = [path] + (sorted(path.iterdir()) if path.is_dir() else [])
        file = next((each for each in tried if is_volume(each)), None)
        if file:
            found[path.name] = str(file)
    return found or sys.exit(f"{folder}: no volume")


# --- runs


class Runner:
    def __init__(self, machine):
        self.machine = ["--machine", machine] if machine else []

    def run(self, request, words, cache, may_fail=False):
        command = [EDGEWISE, request.verb, request.file, "-o", "null:", *request.words, *words, *self.machine, "--json", "-", "--quiet"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, "XDG_CACHE_HOME": str(cache)})
        if done.returncode and not may_fail:
            raise Failed(done.stderr.strip()[-300:])
        return json.loads(done.stdout) if done.returncode == 0 else None

    def fresh(self, request, words, may_fail=False):
        with tempfile.TemporaryDirectory() as cache:
            return self.run(request, words, cache, may_fail)

    def words_for(self, request, steps):
        """What makes the planner take exactly these steps, or nothing."""
        words = [word for step in steps for word in ("--via", step)]
        for _ in range(4):
            report = self.fresh(request, words, may_fail=True)
            if not report:
                return None
            taken = list(map(step_words, report["plan"]["steps"]))
            more = [step.split("/")[0] for step in taken if step not in steps]
            if not more:
                return words if taken == steps else None
            words += [word for name in dict.fromkeys(more) for word in ("--without", name)]
        return None

    def plain_of(self, request):
        return request.own or self.fresh(request, [])["plan"].get("plain")

    def best_of(self, request, seconds):
        report = self.fresh(request, [*request.budget, "--planner", "exhaustive", "--planning-time", f"{seconds}s"], may_fail=True)
        return list(map(step_words, report["plan"]["steps"])) if report else None


def measured(request, runner, runs, search):
    """All figures of one request. @param search  seconds that the best path is looked for"""
    plain = runner.plain_of(request)
    if not plain:
        raise Failed("there is no plain path")
    sides = {"chosen": request.budget, "plain": runner.words_for(request, [plain])}
    if sides["plain"] is None:
        raise Failed(f"{plain} alone is no path")
    found = runner.best_of(request, search)
    if found and found != [plain]:
        words = runner.words_for(request, found)
        sides.update({"best": words} if words else {})
    reports = {side: [] for side in sides}
    second = []
    for number in range(runs):
        for side in list(sides)[::-1 if number % 2 else 1]:
            with tempfile.TemporaryDirectory() as cache:
                reports[side].append(runner.run(request, sides[side], cache))
                if side == "chosen":
                    second.append(runner.run(request, sides[side], cache))
    return row_of(request, reports, second, plain)


def middle(reports, value):
    return float(np.median([value(report) for report in reports]))


def choosing(report):
    return report["planning"]["seconds"] - report["planning"]["parts"].get("preset", 0)


def row_of(request, reports, second, plain):
    took = lambda report: report["measured"]["seconds"][0]
    path = lambda report: tuple(map(step_words, report["plan"]["steps"]))
    # Sides that ran one path count together, or one would be faster than the other by what they scatter.
    everything = [report for each in reports.values() for report in each]
    by_path = {steps: middle([report for report in everything if path(report) == steps], took) for steps in map(path, everything)}
    seconds = {side: by_path[path(each[-1])] for side, each in reports.items()}
    # With an error budget the plain path may break it. Where it does not, it is found.
    keep = {path(each[-1]) for side, each in reports.items() if side != "plain" or not request.budget}
    best = min(keep, key=by_path.get)
    last = reports["chosen"][-1]
    planning = middle(reports["chosen"], choosing)
    paid = planning + seconds["chosen"]
    return {"request": request.line(), "data": request.data, "kind": request.kind(), "frames": request.frames, "numbered": bool(request.budget),
            "machine": last["planning"]["machine"], "threads": last["request"]["threads"], "planning": planning,
            "parts": {name: middle(reports["chosen"], lambda report: report["planning"]["parts"].get(name, 0)) for name in last["planning"]["parts"]},
            "preset": middle(reports["chosen"], lambda report: report["planning"]["parts"].get("preset", 0)),
            "reading": middle(reports["chosen"], lambda report: report["measured"]["read_seconds"]),
            "second_planning": middle(second, choosing), "chosen": seconds["chosen"], "plain": seconds["plain"], "best": by_path[best],
            "expected_saving": last["planning"].get("saved_seconds"),
            "paths": {"chosen": path(last), "plain": [plain], "best": best},
            "value": seconds["plain"] / paid, "over_best": paid / by_path[best], "potential": seconds["plain"] / by_path[best],
            "second_value": seconds["plain"] / (middle(second, choosing) + seconds["chosen"]),
            "raw": {side: list(map(took, each)) for side, each in reports.items()},
            "raw_planning": list(map(choosing, reports["chosen"]))}


# --- tables


def geometric(values):
    return float(np.exp(np.mean(np.log(values)))) if values else None


def groups_of(rows):
    """[(name, rows)]: by the number of frames, then what has an error budget of its own."""
    frames = sorted({row["frames"] for row in rows if not row["numbered"]})
    groups = [(f"{count} frame{'s' if count > 1 else ''}", [row for row in rows if row["frames"] == count and not row["numbered"]]) for count in frames]
    numbered = [row for row in rows if row["numbered"]]
    return groups + ([(" ".join(BUDGET), numbered)] if numbered else [])


def summary_of(rows):
    return {name: {"requests": len(some), "value": geometric([row["value"] for row in some]), "worst": min(row["value"] for row in some),
                   "second_value": geometric([row["second_value"] for row in some]), "over_best": geometric([row["over_best"] for row in some]),
                   "worst_over_best": max(row["over_best"] for row in some), "potential": geometric([row["potential"] for row in some]),
                   "planning": float(np.median([row["planning"] for row in some])), "planning_most": max(row["planning"] for row in some),
                   "second_planning": float(np.median([row["second_planning"] for row in some]))} for name, some in groups_of(rows)}


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)] + ["| " + " | ".join(row) + " |" for row in rows])


def ms(seconds):
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def print_tables(rows):
    print(table(["request", "plain [ms]", "planning [ms]", "chosen [ms]", "best [ms]", "preset [ms]", "reading [ms]", "second planning [ms]",
                 "plain / (planning + chosen)", "(planning + chosen) / best", "chosen path"],
                [[f"`{row['request']}`", *(ms(row[key]) for key in ("plain", "planning", "chosen", "best", "preset", "reading", "second_planning")),
                  f"{row['value']:.2f}", f"{row['over_best']:.2f}", f"`{' > '.join(row['paths']['chosen'])}`"] for row in rows]))
    print()
    print(table(["", "requests", "plain / (planning + chosen)", "worst", "second request", "(planning + chosen) / best", "worst", "plain / best",
                 "planning [ms], median", "most", "second"],
                [[name, str(each["requests"]), *(f"{each[key]:.2f}" for key in ("value", "worst", "second_value", "over_best", "worst_over_best", "potential")),
                  *(ms(each[key]) for key in ("planning", "planning_most", "second_planning"))] for name, each in summary_of(rows).items()]))


# --- the chart


def draw(rows, stem):
    """Left: what a request takes, of what the plain path takes. Right: each request."""
    from audit_report import COLOURS
    from drawing import panels, plt
    from matplotlib.ticker import LogLocator, NullFormatter
    groups = groups_of(rows)
    figure, (costs, each) = panels(2, 5.2, 4.2)
    places = np.arange(len(groups))
    share = lambda some, key: geometric([max(row[key], 1e-6) / row["plain"] for row in some])
    run = np.array([share(some, "chosen") for _, some in groups])
    # Shares of a geometric mean do not add up: planning takes what is left of that of both.
    whole = np.array([geometric([1 / row["value"] for row in some]) for _, some in groups])
    best = [share(some, "best") for _, some in groups]
    top = min(2.0, 1.1 * max(1, *whole))  # what is beyond it is cut off, and told
    shown = np.minimum(run, top)
    costs.bar(places, shown, 0.6, color=COLOURS[0], label="the chosen path")
    costs.bar(places, np.minimum(whole, top) - shown, 0.6, bottom=shown, color=COLOURS[4], label="choosing it")
    costs.hlines(best, places - 0.38, places + 0.38, color="black", linewidth=2, label="the best path, known beforehand")
    costs.axhline(1, color=COLOURS[6], linestyle="--", linewidth=1, label="the plain path")
    for place, height in zip(places, whole):
        text = f"{height:.2f}" if height <= top else f"{height:.3g} (cut off)"
        costs.text(place, min(height, top) + 0.02, text, ha="center", va="bottom", fontsize=9)
    costs.set(ylabel="seconds, of those of the plain path", title="What choosing costs", ylim=(0, top + 0.12))
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    for number, kind in enumerate(kinds):
        points = [(place + 0.5 * ((number + 0.5) / len(kinds) - 0.5), row["value"]) for place, (_, some) in zip(places, groups)
                  for row in some if row["kind"] == kind]
        each.scatter(*zip(*points), s=16, color=COLOURS[number % len(COLOURS)], label=kind, alpha=0.85)
    each.hlines([geometric([row["value"] for row in some]) for _, some in groups], places - 0.38, places + 0.38, color="black", linewidth=2)
    each.axhline(1, color=COLOURS[6], linestyle="--", linewidth=1)
    each.set(yscale="log", ylabel="plain / (choosing + chosen)", title="What it saves, request by request")
    each.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    each.yaxis.set_major_formatter("{x:g}")
    each.yaxis.set_minor_formatter(NullFormatter())
    for axes in (costs, each):
        axes.legend(ncols=4 if axes is each else 2, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False)
        axes.set_xticks(places, [name.replace(" ", "\n", 1) for name, _ in groups])
        axes.grid(axis="x", visible=False)
    for ending in ("svg", "png"):
        figure.savefig(f"{stem}.{ending}", dpi=150, metadata={"Date": None} if ending == "svg" else {"Software": None})
    plt.close(figure)


# ---


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--from", type=pathlib.Path, dest="kept", metavar="FILE")
    parser.add_argument("--chart", metavar="STEM")
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--machine")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    if options.kept:
        rows = json.loads(options.kept.read_text())["requests"]
    else:
        rows = rows_of(options)
    print_tables(rows)
    if options.chart:
        draw(rows, options.chart)


def rows_of(options):
    volumes = volumes_in(options.data) if options.data else VOLUMES
    wanted = [word for word in options.only.split(",") if word]
    volumes = {name: file for name, file in volumes.items() if name in wanted} or volumes
    requests = quick_requests(volumes) if options.quick else volume_requests(volumes) + ([] if options.data else image_requests())
    requests = [each for each in requests if not wanted or any(re.search(rf"(^| ){re.escape(word)}( |$)", each.line()) for word in wanted)]
    runner, rows, failed, begin, load = Runner(options.machine), [], [], time.time(), os.getloadavg()[0]
    for number, request in enumerate(requests):
        print(f"{number + 1} of {len(requests)}: {request.line()}", file=sys.stderr, flush=True)
        try:
            rows.append(measured(request, runner, options.runs, 1.5 if options.quick else 5))
        except Failed as failure:
            failed.append({"request": request.line(), "failure": str(failure)})
            print(f"left out: {request.line()}: {failure}", flush=True)
    if not rows:
        sys.exit("no request could be measured")
    version = subprocess.run([EDGEWISE, "--version"], capture_output=True, text=True).stdout.strip()
    loads = (load, os.getloadavg()[0])
    busy = " Other programs ran meanwhile." if load > 1 else ""
    print(f"{version}: machine {rows[0]['machine']}, {rows[0]['threads']} threads, {options.runs} processes a side, {time.time() - begin:.0f} s; load of the "
          f"machine before and after {loads[0]:.1f}, {loads[1]:.1f}.{busy}\n")
    if options.json:
        options.json.write_text(json.dumps({"version": version, "runs": options.runs, "load": loads, "summary": summary_of(rows), "failed": failed,
                                            "requests": rows}, indent=1) + "\n")
    return rows


if __name__ == "__main__":
    main()
