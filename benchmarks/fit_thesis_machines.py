#!/usr/bin/env python3
"""Fits the profiles of the thesis's machines to some rows of its tables and tells how the others are met.

    /usr/bin/python3 benchmarks/fit_thesis_machines.py build/release/bin/edgewise [--write]

Every row is a request (`describe:` volume, `--via` the edges that the thesis timed); `edgewise plan` counts
its work, and the seconds are linear in it:

    seconds = start * steps + (operation (operations + local) + gather gathers
              + global (global + N congested)) / ranks * (serial + (1 - serial) / threads)
              + latency messages + byte sent

so operation, gather, global, N global, start, latency and byte come from least absolute relative differences
(least squares, weighted again and again), none below 0. --write puts them into planner/machines/*.json and the rows, with their use (fit or
test), into tests/thesis/timings.csv, which tests/thesis/machines_test.cpp predicts once more by the planner.
Needs numpy and scipy."""
import csv
import functools
import json
import pathlib
import subprocess
import sys

import numpy as np
from scipy.optimize import nnls

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLES = ROOT / "tests" / "thesis" / "tables"
COLUMNS = ["table", "machine", "ranks", "threads", "layout", "edges", "size", "turn", "degrees", "seconds", "use"]
ANGLES = [20, 40, 60, 80]
TURNS = ["x", "y", "z", "xyz"]

BACK = {f: f"warp.backward/filter={f}" for f in ("zoh", "foh")}
FORWARD = {f: f"warp.permutation/filter={f}" for f in ("me", "zoh", "foh")}
FASTEST = {"zoh": BACK["zoh"], "foh": FORWARD["foh"]}  # what the thesis renders with
CAST = {f: f"project.ray_cast/filter={f}/step=1" for f in ("zoh", "foh")}
THEN_MAX = ";project.combine"


def table(number):
    with open(TABLES / f"table{number:02d}.csv", newline="", encoding="utf8") as f:
        f.readline()
        return list(csv.DictReader(f))


def row(number, machine, layout, edges, size, turn, degrees, seconds, fit, ranks, threads=1):
    return dict(zip(COLUMNS, [number, machine, ranks, threads, layout, edges, int(size), turn, degrees,
                              float(seconds), "fit" if fit else "test"]))


def rows_of_1k():
    one = functools.partial(row, machine="maspar-mp1-1k", layout="columns", ranks=1024)
    for number, keys in ((7, {"backward_s": BACK["foh"], "forward_s": FORWARD["foh"]}),
                         (9, {"backward_s": BACK["foh"], "forward_s": FORWARD["foh"], "overlapped_forward_s": FORWARD["foh"]}),
                         (10, {"backward_s": BACK["zoh"], "forward_s": FORWARD["zoh"], "rule_only_me_s": FORWARD["me"]}),
                         (11, {"backward_bilinear_s": BACK["foh"], "overlapped_forward_bilinear_s": FORWARD["foh"],
                               "backward_zoh_s": BACK["zoh"]})):
        for r in table(number):
            for key, edge in keys.items():
                # Tables 7 and 9 are the same programs before they were optimized.
                yield one(number, edges=edge, size=r["size"], turn="2d", degrees=45, seconds=r[key],
                          fit=number >= 10 and int(r["size"]) <= 512)
    for r in table(13):
        for angle in [0] + ANGLES:
            yield one(13, edges=FASTEST[r["filter"]], size=r["size"], turn=r["axes"], degrees=angle,
                      seconds=r[f"deg{angle}_s"], fit=r["axes"] in "xy")
    for r in table(27):
        yield one(27, edges=FASTEST[r["filter"]] + THEN_MAX, size=r["size"], turn="all", degrees="mean",
                  seconds=r["mean_s"], fit=False)


def rows_of_16k():
    one = functools.partial(row, machine="maspar-mp1-16k", ranks=16384)
    for r in table(14):
        edge = (BACK if r["direction"] == "backward" else FORWARD)[r["filter"]]
        yield one(14, layout="slice-and-dice", edges=edge, size=r["size"], turn="all", degrees="mean",
                  seconds=r["mean_s"], fit=int(r["size"]) <= 128)
    for r in table(17):
        for angle in ANGLES:
            # Its "backward foh" has the times of forward foh (Tables 14 and 23): the label is taken for a slip.
            yield one(17, layout="columns", edges=FASTEST[r["filter"]], size=r["size"], turn=r["axes"],
                      degrees=angle, seconds=r[f"deg{angle}_s"], fit=r["axes"] in "xy" and r["size"] == "128")
    for r in table(23):
        for angle in [0] + ANGLES:
            yield one(23, layout="slice-and-dice", edges=FASTEST[r["filter"]] + THEN_MAX, size=128, turn=r["axes"],
                      degrees=angle, seconds=float(r[f"deg{angle}_ms"]) / 1000, fit=False)


def rows_of_mp2():
    for number, layout in ((30, "slice-and-dice"), (28, "columns")):
        for r in table(number):
            for what in ("mean", "min", "max"):
                yield row(number, "maspar-mp2-4k", layout, FASTEST[r["filter"]] + THEN_MAX, 128, "all", what,
                          r[f"{what}_s"], (number == 28) == (what == "max"), 4096)


def rows_of_proteus():
    for r in table(29):
        for f in ("foh", "zoh"):
            for pe, ranks, threads in ((1, 1, 1), (32, 8, 4)):
                yield row(29, "proteus-32", "slice-and-dice" if ranks > 1 else "", CAST[f], r["size"], "all", "mean",
                          r[f"pe{pe}_{f}_s"], r["size"] in ("32", "128"), ranks, threads)


def words_of(turn, degrees):
    if turn == "2d":
        return str(degrees)
    return ",".join(str(degrees) if axis in turn else "0" for axis in "xyz")


def poses(r):
    """The rotations that a row stands for."""
    if r["turn"] != "all":
        return [(r["turn"], r["degrees"])]
    return [("x", 0)] + [(turn, angle) for turn in TURNS for angle in ANGLES]


@functools.lru_cache(maxsize=None)
def counted(program, ranks, layout, edges, size, turn, degrees):
    """Work of all steps of one request, in the order of NAMES."""
    image = turn == "2d"
    job = "render" if "project" in edges else "warp"
    via = ([f"net.spread/layout={layout}"] if layout else []) + edges.split(";")
    command = [program, "plan", job, f"describe:{size}x{size}{'' if image else f'x{size}'}:u8", "--rotate",
               words_of(turn, degrees), "--machine", "default", "--ranks", str(ranks), "--threads", "1", "--json", "-",
               "--max-error", "1000", "--max-memory", "100TB", "--spacing", "1",
               "--size", f"{size}x{size}" + ("" if image or job == "render" else f"x{size}")]
    for edge in via:
        command += ["--via", edge]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: {done.stderr}")
    steps = json.loads(done.stdout)["plan"]["steps"]
    if len(steps) != len(via):
        sys.exit(f"{' '.join(command)}: {[s['transition'] for s in steps]}")
    total = {name: sum(s["work"][name] for s in steps) for name, value in steps[0]["work"].items() if not isinstance(value, str)}
    return len(steps), total


# What is fitted, by group of machines; what is not there is 0 (operation counts local reads too). The MP-1s have
# the same processors and the same network, and differ in what a start takes. The MP-2 was measured at one size, which
# does not tell a start or a congestion from the rest: these are the MP-1's.
GROUPS = {("maspar-mp1-1k", "maspar-mp1-16k"): ["operation", "global", "waiting", "start maspar-mp1-1k", "start maspar-mp1-16k"],
          ("maspar-mp2-4k",): ["operation", "global_waiting"],
          ("proteus-32",): ["operation", "gather", "start", "byte"]}


def features(program, r, pose, serial):
    steps, w = counted(program, r["ranks"], r["layout"], r["edges"], r["size"], *pose)
    each = (serial + (1 - serial) / r["threads"]) / r["ranks"]
    return {"operation": (w["operations"] + w["local"]) * each, "gather": w["gathers"] * each,
            "global": w["global"] * each, "waiting": w["congested"] * each,
            "start": steps, "latency": w["messages"], "byte": w["sent"],
            "start maspar-mp1-1k": steps * (r["machine"] == "maspar-mp1-1k"),
            "start maspar-mp1-16k": steps * (r["machine"] == "maspar-mp1-16k")}


def statistic(r, values):
    if r["turn"] != "all":
        return values[0]
    return {"mean": np.mean, "min": np.min, "max": np.max}[r["degrees"]](values, axis=0)


def solve(program, rows, names, serial, fixed, congestion):
    """Least absolute relative differences. Of a least or greatest time the pose is found in turn."""
    def columns(r, pose):
        f = features(program, r, pose, serial)
        f["global_waiting"] = f["global"] + congestion * f["waiting"]
        return np.array([f[n] for n in names]), sum(f[n] * v for n, v in fixed.items())
    x, weights = None, np.ones(len(rows))
    for _ in range(12):
        a, b = [], []
        for r in rows:
            all_poses = [columns(r, pose) for pose in poses(r)]
            if r["degrees"] in ("min", "max") and x is not None:
                times = [c @ x + f for c, f in all_poses]
                all_poses = [all_poses[int((np.argmin if r["degrees"] == "min" else np.argmax)(times))]]
            a.append(np.mean([c for c, _ in all_poses], axis=0) / r["seconds"])
            b.append(1 - np.mean([f for _, f in all_poses]) / r["seconds"])
        a, b = np.array(a), np.array(b)
        x, _ = nnls(a * weights[:, None], b * weights)
        weights = 1 / np.sqrt(np.maximum(np.abs(a @ x - b), 0.02))
    return dict(zip(names, x))


def predicted(program, r, profile):
    times = []
    for pose in poses(r):
        f = features(program, r, pose, profile["serial"])
        times.append(f["operation"] * profile["operation"] + f["gather"] * profile["gather"]
                     + (f["global"] + profile["congestion"] * f["waiting"]) * profile["global"]
                     + f["start"] * profile["start"] + f["latency"] * profile["latency"] + f["byte"] * profile["byte"])
    return statistic(r, np.array(times))


ABOUT = {"maspar-mp1-1k": ("MasPar MP-1, 1024 processors", 1024, 1), "maspar-mp1-16k": ("MasPar MP-1, 16384 processors", 16384, 1),
         "maspar-mp2-4k": ("MasPar MP-2, 4096 processors", 4096, 1), "proteus-32": ("Proteus, 8 clusters of 4 i860", 8, 4)}

USED = {"maspar-mp1-1k": "10, 11, 13 (of the 16k: 14, 17)", "maspar-mp1-16k": "14, 17 (of the 1k: 10, 11, 13)",
        "maspar-mp2-4k": "28, 30", "proteus-32": "29"}


def fit(program, machines, names, rows, other):
    """One profile a machine of a group."""
    fixed = {"start": other["start"]} if "global_waiting" in names else {}
    best = None
    for serial in np.linspace(0, 0.3, 7) if "proteus-32" in machines else [0.0]:
        found = solve(program, rows, names, serial, fixed, other.get("congestion", 1))
        trial = {}
        for machine in machines:
            cpu, ranks, processors = ABOUT[machine]
            p = {"schema": 1, "name": machine, "cpu": cpu, "processors": processors, "ranks": ranks, "memory": 0,
                 "streamed": 0, "operation": found["operation"], "gather": found.get("gather", 0),
                 "global": found.get("global", found.get("global_waiting", 0)), "latency": 0,
                 "byte": found.get("byte", 0), "serial": round(float(serial), 3), "factors": {}}
            p["local"] = p["operation"] if processors == 1 else 0
            p["congestion"] = found["waiting"] / found["global"] if "waiting" in found else (
                other["congestion"] if fixed else 1)
            p["start"] = found.get("start", found.get(f"start {machine}", fixed.get("start")))
            p = {k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in p.items()}
            fitted = f"fitted to rows of tables {USED[machine]}"
            p["provenance"] = {name: fitted for name in ("operation", "gather", "global", "congestion", "byte", "start")
                               if p[name] and (name != "congestion" or p["global"])}
            if fixed:
                p["provenance"] |= {"congestion": "fitted on the MP-1", "start": "fitted on the MP-1"}
            if processors == 1:
                p["provenance"]["local"] = "derived: one operation"
            trial[machine] = p
        error = np.mean([abs(predicted(program, r, trial[r["machine"]]) / r["seconds"] - 1) for r in rows])
        if best is None or error < best[0]:
            best = error, trial
    return best[1]


def main():
    program = sys.argv[1]
    rows = [*rows_of_1k(), *rows_of_16k(), *rows_of_mp2(), *rows_of_proteus()]
    profiles = {}
    for machines, names in GROUPS.items():
        used = [r for r in rows if r["machine"] in machines and r["use"] == "fit"]
        profiles |= fit(program, machines, names, used, profiles.get("maspar-mp1-16k", {}))
    for machine in ABOUT:
        mine = [r for r in rows if r["machine"] == machine]
        print(json.dumps(profiles[machine]))
        off = [(r, predicted(program, r, profiles[machine]) / r["seconds"]) for r in mine]
        for number in sorted({r["table"] for r in mine}):
            for use in ("fit", "test"):
                ratios = [x for r, x in off if r["table"] == number and r["use"] == use]
                if ratios:
                    print(f"  table {number:2d} {use:4s} {len(ratios):3d} rows  median |error| {np.median(np.abs(np.array(ratios) - 1)):.3f}  "
                          f"ratio {min(ratios):.2f} to {max(ratios):.2f}")
        for use in ("fit", "test"):
            ratios = np.array([x for r, x in off if r["use"] == use])
            print(f"  {machine} {use}: median |error| {np.median(np.abs(ratios - 1)):.3f} of {len(ratios)} rows")
    if "--write" in sys.argv:
        for machine, profile in profiles.items():
            (ROOT / "planner" / "machines" / f"{machine}.json").write_text(json.dumps(profile, indent=2) + "\n", encoding="utf8")
        with open(ROOT / "tests" / "thesis" / "timings.csv", "w", newline="", encoding="utf8") as f:
            writer = csv.DictWriter(f, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
