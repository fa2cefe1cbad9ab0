#!/usr/bin/python3
"""Makes every table of docs/performance.md for the version at hand: one command, five to eight minutes on an idle machine.

    script/bench --page docs/performance.md            builds what is needed, then this with a display
    script/bench --only libraries,planning             prints these tables
    EDGEWISE=build/release/bin/edgewise xvfb-run -a -s "-screen 0 1280x1024x24" benchmarks/performance.py [--page FILE]
        [--only PART,...] [--rounds N] [--photo JPEG] [--ct FOLDER]

Parts: libraries (side_by_side.py), rendering (render_speed.py), commands (whole_commands.py), planning, graphs, gathers, arenas and
waking (programs beside the command). Each pair of programs is timed in turns, and errors are measured in the same run. A
page gets the tables between its markers, `<!-- PART -->` and `<!-- end PART -->`, each as soon as it is made, and what
made them between those of `made by`. What fails is told at the end (exit status 1), and its table is left as it was.

Whole commands need a photograph and a series of DICOM slices: the bundled cup of coffee and chest, enlarged, unless
--photo and --ct name others. Needs what `script/setup --bench` installs."""
import argparse
import datetime
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

from gallery_runs import EDGEWISE, ROOT, rewrite

HERE = pathlib.Path(__file__).resolve().parent
PROGRAMS = pathlib.Path(EDGEWISE).parent
sys.path.insert(0, str(ROOT / "tests/io"))
LIBRARIES = ["warp2d", "warp3d", "shear_warp", "shear_warp_foh", "xray", "drr"]  # render_speed.py has the casts
REQUESTS = ["render --mode mip", "render --mode xray", "render --mode composite", "warp --rotate 10,20,30", "render --mode mip --max-error 0.01",
            "render --mode xray --max-error 0.01", "render --mode composite --max-error 0.01", "warp --rotate 10,20,30 --max-error 0.01",
            "render --mode xray --turntable 360"]
HEAD = "data/mr_brain/MR.nii.gz"


class Failed(Exception):
    pass


NOTES = []  # what scripts said at their end


def output_of(words, environment=None, may_fail=False):
    done = subprocess.run(list(map(str, words)), cwd=ROOT, capture_output=True, text=True, env={**os.environ, **(environment or {})})
    if done.returncode and not may_fail:
        raise Failed(f"{' '.join(map(str, words))}: exit {done.returncode}: {done.stderr.strip()[-400:]}")
    if done.returncode and words[0] not in ("dpkg-query", "g++"):
        NOTES.append(f"{pathlib.Path(words[0]).name}: {done.stderr.strip()[-400:]}")
    return done.stdout


def table_of(words, environment=None):
    """The table that a script prints. Goals that are not met, and a row that fails, are told at the end."""
    out = output_of(words, environment, may_fail=True)
    lines = [line for line in out.splitlines() if line.startswith("|")]
    if len(lines) < 3:
        raise Failed(f"{' '.join(map(str, words))}: no table: {out[-400:]}")
    left_out = [line for line in out.splitlines() if line.startswith("left out")]
    return "\n".join(lines + ([""] + [line + "  " for line in left_out] if left_out else []))


def markdown(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def short(value):
    """Three digits, and none behind the point from 100 on."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def cells(out):
    """Lines of columns that stand two blanks or more apart, without their head."""
    return [re.split(r"\s{2,}", line.strip()) for line in out.splitlines()[1:] if line.strip()]


# --- the parts


def libraries(options, work):
    return table_of([HERE / "side_by_side.py", *LIBRARIES], {"EDGEWISE_ROUNDS": str(options.rounds or 5)})


def rendering(options, work):
    return table_of([HERE / "render_speed.py", "--rounds", options.rounds or 3])


def commands(options, work):
    photo, scan = options.photo or photograph(work), options.ct or series(work)
    return table_of([HERE / "whole_commands.py", "--photo", photo, "--ct", scan, "--runs", options.rounds or 3])


def photograph(work):
    """The bundled picture at 6 megapixels."""
    import cv2
    file = work / "photo.jpg"
    picture = cv2.imread(str(ROOT / "data/coffee/coffee.png"))
    cv2.imwrite(str(file), cv2.resize(picture, (3000, 2000), interpolation=cv2.INTER_CUBIC), [cv2.IMWRITE_JPEG_QUALITY, 92])
    return file


def series(work):
    """The bundled chest at 512 x 512 x 40, a DICOM file a slice."""
    import dicom_writing
    import numpy as np
    import scipy.ndimage
    folder, samples = work / "ct", work / "chest.nrrd"
    folder.mkdir()
    about = json.loads(output_of([EDGEWISE, "info", "data/ct_chest/chest.nrrd", "--json", "-"]))
    output_of([EDGEWISE, "warp", "data/ct_chest/chest.nrrd", "-o", samples, "--quiet"])
    shape = about["extent"][::-1]
    small = np.frombuffer(samples.read_bytes().split(b"\n\n", 1)[1], "<i2").reshape(shape)
    factor = 512 / shape[1]
    large = scipy.ndimage.zoom(small.astype("f4"), (1, factor, factor), order=1, grid_mode=True, mode="nearest").round().astype("<i2")
    spacing, (x, y, z) = [step / factor for step in about["spacing"][1::-1]], about["origin"]
    for k, rows in enumerate(large):
        elements = dicom_writing.picture(rows, number=k + 1, spacing=spacing, position=[x, y, z + k * about["spacing"][2]],
                                         more={0x00281052: ("DS", [0]), 0x00281053: ("DS", [1])})
        (folder / f"{k:03d}.dcm").write_bytes(dicom_writing.file_of(elements))
    return folder


def planning(options, work):
    """A first request: nothing is kept from others, and the profile is the built-in one."""
    rows = []
    for request in REQUESTS:
        verb, *words = request.split()
        reports = []
        for _ in range(options.rounds or 3):
            with tempfile.TemporaryDirectory() as home:
                kept_nowhere = {"XDG_CACHE_HOME": home, "XDG_CONFIG_HOME": home}
                out = output_of([EDGEWISE, verb, HEAD, "-o", "null:", *words, "--json", "-", "--quiet"], kept_nowhere)
                reports.append(json.loads(out))
        plan = [report["planning"] for report in reports]
        middle = lambda values: short(1e3 * statistics.median(values))
        rows.append([f"`{request}`", str(plan[0]["vertices"]), str(plan[0]["edges"]), middle([one["seconds"] for one in plan]),
                     middle([one["parts"]["search"] for one in plan]), middle([one["parts"]["preview"] for one in plan]),
                     middle([report["measured"]["seconds"][0] for report in reports])])
    return markdown(["request", "vertices", "edges", "planning [ms]", "of which search", "preview", "the run [ms]"], rows)


def graphs(options, work):
    found = {}
    for line in output_of([PROGRAMS / "planning_benchmark"]).splitlines():
        if "vertices" in line:
            column = line.split(";")[0]
            found[column] = {}
        else:
            name, took, _ = line.rsplit(maxsplit=2)
            found[column][name.strip()] = took
    names = {"expand": "expansion", "price": "prices of the edges", "one objective": "search, one objective", "three criteria": "search, three criteria",
             "plan": "the whole call"}
    return markdown(["[ms]", *found], [[text, *(short(float(column[name])) for column in found.values())] for name, text in names.items()])


def gathers(options, work):
    rows = cells(output_of([PROGRAMS / "gathers_benchmark", "11"]))
    return markdown(["job", "gathers [ms]", "loads [ms]", "ratio"], [row[:4] for row in rows])


def arenas(options, work):
    rows = cells(output_of([PROGRAMS / "arenas_benchmark", "0,100,1000", "50,1000"]))
    return markdown(["since the last run [us]", "work [us]", "a new arena [us]", "the kept one [us]", "ratio"], rows)


def waking(options, work):
    rows = cells(output_of([PROGRAMS / "waking_benchmark", "5,20", "0.5,4,8,16"]))
    return markdown(["asleep [ms]", "work [ms]", "left to the system [ms]", "one worker for each core [ms]", "ratio"],
                    [[row[0], row[1], row[3], row[6], row[8]] for row in rows])


PARTS = {each.__name__: each for each in (libraries, rendering, commands, planning, graphs, gathers, arenas, waking)}


# --- what made them


def load():
    return f"{os.getloadavg()[0]:.1f}"


def made_by(loads, parts, rounds):
    version = output_of([EDGEWISE, "--version"]).strip()
    cpu = next((line.split(":")[1].strip() for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")),
               "unknown processor")
    peers = []
    for name, package in (("OpenCV", "python3-opencv"), ("VTK", "python3-vtk9"), ("plastimatch", "plastimatch"), ("libvips", "libvips-tools")):
        found = output_of(["dpkg-query", "-W", "-f=${Version}", package], may_fail=True)
        peers += [f"{name} {re.sub(r'^[0-9]:|[+-].*$', '', found)}"] if found else []
    compiler = output_of(["g++", "-dumpfullversion"], may_fail=True).strip()
    only = "" if parts == list(PARTS) else f" Of these: {', '.join(parts)}."
    only += f" Rounds of each comparison: {rounds}." if rounds else ""
    if max(map(float, loads)) > os.cpu_count() + 1:
        only += " Other programs ran meanwhile, so seconds are too long; ratios suffer less, errors not at all."
    return (f"{version}, {datetime.date.today()}: {os.cpu_count()} cores of {cpu}, g++ {compiler}; {', '.join(peers)}. Load of the machine before the first "
            f"table and after each (1: one busy core): {', '.join(loads)}.{only}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--page", type=pathlib.Path)
    arguments.add_argument("--only", default=",".join(PARTS))
    arguments.add_argument("--rounds", type=int, help="of each comparison, instead of 5 (libraries) and 3")
    arguments.add_argument("--photo", type=pathlib.Path, default=os.environ.get("EDGEWISE_PHOTO"))
    arguments.add_argument("--ct", type=pathlib.Path, default=os.environ.get("EDGEWISE_CT"))
    options = arguments.parse_args()
    parts, failed, loads = options.only.split(","), [], [load()]
    for name in parts:
        if name not in PARTS:
            arguments.error(f"--only: {name}; there are {', '.join(PARTS)}")
    with tempfile.TemporaryDirectory(prefix="edgewise-performance-") as folder:
        for name in parts:
            begin = datetime.datetime.now()
            try:
                table = PARTS[name](options, pathlib.Path(folder))
            except (Failed, OSError) as problem:
                failed.append(f"{name}: {problem}")
                continue
            loads.append(load())
            print(f"\n{name} ({(datetime.datetime.now() - begin).seconds} s)\n\n{table}", flush=True)
            if options.page:
                rewrite(options.page, {name: table, "made by": made_by(loads, parts, options.rounds)})
    print("\n".join(NOTES), file=sys.stderr)
    if failed:
        sys.exit("\n".join(failed))


if __name__ == "__main__":
    main()
