#!/usr/bin/python3
"""Tables and pictures of audits, as docs/planner.md shows them.

    edgewise audit benchmarks/audit_requests.json -o estimate.json --planner estimate
    edgewise audit benchmarks/audit_requests.json -o pilot.json --planner pilot
    benchmarks/audit_report.py estimate.json pilot.json [--held-out] [--svg FOLDER] > tables.md

Prints Markdown: the goals and what was reached, one column an audit; then, for each audit, a table by family and the
requests that lost most. --svg also writes, for each audit, NAME_seconds.svg and NAME_error.svg (predicted against
measured, all paths, the chosen ones marked), NAME_ratio.svg (predicted / measured by family) and, for all of them,
regret.svg. A path that was cancelled has no measured time and is in no picture. Needs numpy; --svg needs matplotlib.
"""
import argparse
import json
import pathlib
import sys

import numpy as np

LEAST_ERROR = 1e-6  # below it is the rounding of f32
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#666666", "#b8860b", "#7f3fbf", "#000000"]


def entries_of(report, held_out):
    return [entry for entry in report["requests"] if "error" not in entry and (entry["held_out"] or not held_out)]


def paths_of(entries):
    """All paths that were measured, each with the family of its request."""
    return [{**path, "family": entry["family"]} for entry in entries for path in entry["measured_paths"]
            if path["measured"]]


def time_ratios(paths):
    return np.array([path["predicted"]["seconds"] / path["measured"]["seconds"] for path in paths])


def error_pairs(paths):
    """[paths, 2]: predicted and measured errors where a prediction exists."""
    pairs = [(path["predicted"]["error"], path["measured"]["error"]["nrmse"]) for path in paths
             if path["predicted"]["error"] is not None and path["measured"]["error"]]
    return np.maximum(np.array(pairs, float).reshape(-1, 2), LEAST_ERROR)


def cell(value, form="{:.2f}"):
    return "–" if value is None else form.format(value)


def goals(summaries):
    """[(what, goal, function of a summary)]"""
    interval = lambda s: s.get("interval") or {}
    return [
        ("regret, geometric mean", "pilot 1.03, estimate 1.10", lambda s: cell(s["regret_geomean"], "{:.3f}")),
        ("regret, median", "", lambda s: cell(s["regret_median"], "{:.3f}")),
        ("regret, p95", "pilot 1.10, estimate 1.5", lambda s: cell(s["regret_p95"])),
        ("regret, largest", "pilot 1.5", lambda s: cell(s["regret_max"])),
        ("regret of one fixed path a family", "", lambda s: "{} (p95 {})".format(
            cell(s["fixed_path"]["regret_geomean"]), cell(s["fixed_path"]["regret_p95"]))),
        ("regret of others' fixed rules", "", lambda s: ", ".join(
            "{} {} (keeps {} of {})".format(rule["library"], cell(rule["regret_geomean"]), rule["serves"], rule["requests"])
            for rule in s.get("others", []) if rule["requests"]) or "–"),
        ("share of that gap closed", "", lambda s: cell(s["gap_closed"], "{:.0%}")),
        ("seconds, predicted / measured, median of chosen", "", lambda s: cell(s["time_ratio_median"])),
        ("its median \\|ln\\|", "0.10", lambda s: cell(s["time_ratio_median_abs_log"])),
        ("its p90 \\|ln\\|", "0.25", lambda s: cell(s["time_ratio_p90_abs_log"])),
        ("median \\|ln\\| of all paths", "", lambda s: cell(s["time_ratio_of_paths"]["median_abs_log"])),
        ("p90 \\|ln\\| of all paths", "", lambda s: cell(s["time_ratio_of_paths"]["p90_abs_log"])),
        ("Kendall tau of paths, mean", "0.9", lambda s: cell(s["kendall_tau"])),
        ("90 % interval covers", "85 to 95 %", lambda s: cell(interval(s).get("covered"), "{:.0%}")),
        ("error budgets broken", "pilot 0, estimate 2 %", lambda s: "{} of {}".format(s["broken"]["error"], s["requests"])),
        ("worst error over its budget", "1.5", lambda s: cell(s["broken"]["error_worst_over_budget"])),
        ("predicted error / measured, within 1 to 3", "95 %", lambda s: cell(s["error_ratio"]["within_1_3"], "{:.0%}")),
        ("predicted error below measured", "", lambda s: cell(s["error_ratio"]["below_1"], "{:.0%}")),
        ("memory budgets broken", "0", lambda s: str(s["broken"]["bytes"])),
        ("bytes, predicted / measured, p05 to p95", "0.95 to 1.15", lambda s: "{} to {}".format(
            cell(s["bytes_ratio"]["p05"]), cell(s["bytes_ratio"]["p95"]))),
        ("requests; paths run, cancelled", "", lambda s: "{}; {}, {}".format(
            s["requests"], s["paths"], s["paths_cancelled"])),
    ]


def print_goals(names, summaries):
    print("| | goal | " + " | ".join(names) + " |\n|---|---|" + "---|" * len(names))
    for what, goal, take in goals(summaries):
        print(f"| {what} | {goal} | " + " | ".join(take(summary) for summary in summaries) + " |")
    print()


def print_families(name, entries):
    print(f"**{name}, by family**\n\n| family | requests | paths | regret, geometric mean | largest | seconds, predicted / "
          "measured: p10, median, p90 of paths | error, predicted / measured: p10, median, p90 | fixed best |")
    print("|---|---|---|---|---|---|---|---|")
    for family in sorted({entry["family"] for entry in entries}):
        mine = [entry for entry in entries if entry["family"] == family]
        regret = np.array([entry["regret"] for entry in mine])
        paths = paths_of(mine)
        pairs = error_pairs(paths)
        spread = lambda values: ", ".join(f"{q:.2f}" for q in np.percentile(values, (10, 50, 90))) if len(values) else "–"
        commonest = [" > ".join(entry["best"]["steps"]) for entry in mine]
        best = max(sorted(set(commonest)), key=commonest.count) if commonest else ""
        print(f"| {family} | {len(mine)} | {len(paths)} | {np.exp(np.log(regret).mean()):.3f} | {regret.max():.2f} | "
              f"{spread(time_ratios(paths))} | {spread(pairs[:, 0] / pairs[:, 1])} | `{best}` in {commonest.count(best)} |")
    print()


def print_worst(name, entries, count=8):
    worst = [entry for entry in sorted(entries, key=lambda entry: -entry["regret"])[:count] if entry["regret"] > 1.02]
    if not worst:
        return
    print(f"**{name}, what lost most**\n\n| regret | request | chosen | best |\n|---|---|---|---|")
    for entry in worst:
        print(f"| {entry['regret']:.2f} | `{' '.join(entry['args'])}` | `{' > '.join(entry['chosen']['steps'])}` | "
              f"`{' > '.join(entry['best']['steps'])}` |")
    print()


def save(plt, figure, file):
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})
    plt.close(figure)


def scatter(plt, file, title, unit, rows, band):
    """rows: (family, predicted, measured, chosen); band: ratios predicted / measured that are drawn."""
    figure, axes = plt.subplots(figsize=(6.4, 6.0))
    families = sorted({row[0] for row in rows})
    low = min(min(row[1], row[2]) for row in rows) / 2
    high = max(max(row[1], row[2]) for row in rows) * 2
    line = np.array([low, high])
    axes.plot(line, line, color="black", linewidth=0.8)
    axes.fill_between(line, line * band[0], line * band[1], color="#dddddd", zorder=0,
                      label=f"predicted / measured {band[0]:g} to {band[1]:g}")
    for i, family in enumerate(families):
        for chosen in (False, True):
            mine = [row for row in rows if row[0] == family and row[3] == chosen]
            axes.scatter([row[2] for row in mine], [row[1] for row in mine], s=26 if chosen else 9,
                         color=COLOURS[i % len(COLOURS)], edgecolors="black" if chosen else "none",
                         linewidths=0.7, alpha=1 if chosen else 0.55, label=None if chosen else family)
    axes.scatter([], [], s=26, color="white", edgecolors="black", linewidths=0.7, label="chosen")
    axes.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high), title=title,
             xlabel=f"measured{unit}", ylabel=f"predicted{unit}")
    axes.legend(fontsize=7, loc="upper left")
    save(plt, figure, file)


def ratio_boxes(plt, file, title, entries):
    families = sorted({entry["family"] for entry in entries})
    values = [time_ratios(paths_of([e for e in entries if e["family"] == family])) for family in families]
    figure, axes = plt.subplots(figsize=(6.4, 0.5 * len(families) + 1.4))
    axes.axvline(1, color="black", linewidth=0.8)
    axes.axvspan(np.exp(-0.25), np.exp(0.25), color="#dddddd", zorder=0)
    axes.boxplot(values, vert=False, whis=(5, 95), sym=".", flierprops={"markersize": 3})
    axes.set_yticks(range(1, len(families) + 1), families)
    axes.set(xscale="log", xlabel="seconds, predicted / measured", title=f"{title}: all paths (whiskers 5 to 95 %)")
    save(plt, figure, file)


def regret_curves(plt, file, names, audits):
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    for i, (name, entries) in enumerate(zip(names, audits)):
        regret = np.sort([entry["regret"] for entry in entries])
        axes.step(regret, np.arange(1, len(regret) + 1) / len(regret), where="post", color=COLOURS[i], label=name)
    axes.set(xscale="log", xlabel="regret: seconds of the chosen path / of the best", ylabel="share of requests", ylim=(0, 1.02))
    for numbers in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
        numbers(plt.FormatStrFormatter("%g"))  # not powers of ten
    axes.grid(alpha=0.3)
    axes.legend()
    save(plt, figure, file)


def draw(folder, names, audits):
    try:
        import matplotlib
    except ImportError:
        sys.exit("--svg needs matplotlib; script/setup --bench installs it")
    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "edgewise"  # the same pictures from the same numbers
    import matplotlib.pyplot as plt
    folder.mkdir(parents=True, exist_ok=True)
    for name, entries in zip(names, audits):
        paths = paths_of(entries)
        times = [(p["family"], p["predicted"]["seconds"], p["measured"]["seconds"], p.get("chosen", False)) for p in paths]
        scatter(plt, folder / f"{name}_seconds.svg", f"{name}: seconds of {len(times)} paths", " [s]", times, (0.78, 1.28))
        errors = [(p["family"], max(p["predicted"]["error"], LEAST_ERROR), max(p["measured"]["error"]["nrmse"], LEAST_ERROR),
                   p.get("chosen", False)) for p in paths if p["predicted"]["error"] is not None and p["measured"]["error"]]
        scatter(plt, folder / f"{name}_error.svg", f"{name}: error of {len(errors)} paths", " [NRMSE]", errors, (1, 3))
        ratio_boxes(plt, folder / f"{name}_ratio.svg", name, entries)
    regret_curves(plt, folder / "regret.svg", names, audits)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("audits", nargs="+", type=pathlib.Path)
    parser.add_argument("--held-out", action="store_true", help="only requests that no fit has seen")
    parser.add_argument("--svg", type=pathlib.Path, metavar="FOLDER")
    options = parser.parse_args()
    names, audits, summaries = [], [], []
    for file in options.audits:
        report = json.loads(file.read_text())
        entries = entries_of(report, options.held_out)
        if not entries:
            sys.exit(f"{file}: no request that could be audited")
        names.append(file.stem)
        audits.append(entries)
        summaries.append(report["summary"]["held_out"] if options.held_out else report["summary"])
    print_goals(names, summaries)
    for name, entries in zip(names, audits):
        print_families(name, entries)
        print_worst(name, entries)
    if options.svg:
        draw(options.svg, names, audits)


if __name__ == "__main__":
    main()
