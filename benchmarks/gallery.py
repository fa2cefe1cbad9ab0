#!/usr/bin/python3
"""Makes docs/gallery.md's pictures, charts and tables, and judges each chart.

    edgewise calibrate
    EDGEWISE=build/release/bin/edgewise benchmarks/gallery.py [all|scenes|sweeps|left-out|thesis] [--scene NAME ...]

Runs from the root of the repository. Commands are those that stand in docs/gallery.md; the tables there are rewritten
between their markers. Numbers of charts also go to build/gallery. Ends with 1 where the path that the planner chose is
clearly beaten, or where a chart has fewer paths than promised. `thesis` needs numpy and matplotlib
(script/setup --bench).
"""
import argparse
import json
import os
import shlex
import subprocess
import sys

from gallery_left_out import left_out_table
from gallery_runs import DOCS, EDGEWISE, PAGE, ROOT, SCRATCH, median, milliseconds, quartiles, rewrite, route

FEWEST_PATHS, FEWEST_FAMILIES = 15, 4  # of a rendering; a warp of a picture has fewer ways
SAME = 1.03  # two runs of one path differ by as much

# Request of each scene, and the ending of the picture that stands in the page.
SCENES = {
    "ct_head": ("render data/ct_head/quarter.nhdr --orient RPI --mode composite "
                "--transfer data/ct_head/skin_and_bone.json --rotate 0,30,0 --size 256x256 "
                "--max-error 0.03", "png"),
    "mr_head": ("render data/mr_brain/MR.nii.gz --mode xray --view left --rotate 0,20,0 --max-error 0.005", "png"),
    "carotid": ("render data/carotid/carotid.vtk --mode mip --rotate 30,40,0 --size 192x192 --max-error 0.02", "png"),
    "neuron": ("render data/neuron/neuron.tif --mode mip --rotate 0,20,0 --size 256x256 --max-error 0.03", "png"),
    "hydrogen": ("render data/hydrogen/hydrogen.vti --mode xray --rotate 20,30,0 --size 192x192 --max-error 0.002",
                 "png"),
    "coffee": ("warp data/coffee/coffee.png --rotate 30 --max-error 0.015", "jpg"),
}
SWEEPS = {
    "ct_head_turned": "render data/ct_head/quarter.nhdr --orient RPI --mode xray --size 128x128 --rotate 0,0,0 "
                      "--sweep rotate.y=0:90:7.5 --without store --without warp.backward --limit 8 "
                      "--max-error 0.03",
    "hydrogen_frames": "render data/hydrogen/hydrogen.vti --mode xray --size 96x96 --turntable 36 --max-error 0.002 "
                       "--without store --without warp --without project.shear_warp "
                       "--without project.ray_cast/filter=zoh --sweep turntable=1:61:10 --limit 9",
    "ct_head_size": "render data/ct_head/quarter.nhdr --orient RPI --mode mip --rotate 0,30,0 --size 64x64 "
                    "--without store --sweep size=64:448:64 --limit 10 --max-error 0.03",
}


def run(command):
    """A command as it stands in the page, from the root of the repository."""
    words = shlex.split(command)
    assert words[0] == "edgewise"
    done = subprocess.run([EDGEWISE, *words[1:], "--quiet"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command}\n{done.stderr}")


def beats(rival, chosen):
    """Clearly faster, and no less accurate."""
    if rival["measured"]["error"] is None or chosen["measured"]["error"] is None:
        return False
    faster = (quartiles(rival)[1] < quartiles(chosen)[0]
              and median(rival) * SAME < median(chosen))
    return faster and rival["measured"]["error"]["nrmse"] <= chosen["measured"]["error"]["nrmse"]


def judged(name, chart, verb):
    """What is wrong with a chart, in words."""
    points = [point for point in chart["points"] if point["measured"]]
    families = {point["family"] for point in points}
    wrong = []
    if verb == "render" and (len(points) < FEWEST_PATHS or len(families) < FEWEST_FAMILIES):
        wrong.append(f"{name}: {len(points)} paths, {len(families)} families")
    if not any(point["front"] for point in points):
        wrong.append(f"{name}: no front")
    chosen = next((point for point in points if point["chosen"]), None)
    if chosen is None:
        return [*wrong, f"{name}: what the planner chose was not measured"]
    for rival in points:
        if beats(rival, chosen):
            wrong.append(f"{name}: {described(chosen)}\n    is beaten by {described(rival)}")
    return wrong


def described(point):
    predicted, error = point["predicted"], point["measured"]["error"]
    return (f"{route(point['plan'])}: {milliseconds(median(point))} measured, {milliseconds(predicted['seconds'])} "
            f"predicted; error {error['nrmse']:.3g} measured, {predicted['error']:.3g} predicted")


def scenes_table(names):
    lines = ["| scene | paths | families | on the front | chosen | ms | error | its budget | most accurate: ms | error |",
             "|---|---:|---:|---:|---|---:|---:|---:|---:|---:|"]
    for name in names:
        chart = json.loads((SCRATCH / f"{name}.json").read_text())
        points = [point for point in chart["points"] if point["measured"] and point["measured"]["error"]]
        chosen = next(point for point in points if point["chosen"])
        best = min(points, key=lambda point: (point["measured"]["error"]["nrmse"], median(point)))
        error = lambda point: f"{point['measured']['error']['nrmse']:.2g}"
        lines.append(f"| {name} | {len(points)} | {len({point['family'] for point in points})} | "
                     f"{sum(point['front'] for point in points)} | `{route(chosen['plan'])}` | "
                     f"{median(chosen) * 1e3:.3g} | {error(chosen)} | {chart['request']['budget']['error']:g} | "
                     f"{median(best) * 1e3:.3g} | {error(best)} |")
    return "\n".join([*lines, "", made_by()])


def made_by():
    version = subprocess.run([EDGEWISE, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf8") if line.startswith("model name")), "unknown processor")
    return f"Measured with {version}, {os.cpu_count()} cores of {cpu}."


def chart_command(name, request):
    return f"edgewise chart {request} -o docs/gallery/{name}.svg -o build/gallery/{name}.json"


def picture_command(name, request, ending):
    quality = " --quality 60" if ending == "jpg" else ""
    return f"edgewise {request} -o docs/gallery/{name}_picture.{ending}{quality}"


def scenes(names):
    wrong = []
    for name in names:
        request, ending = SCENES[name]
        run(chart_command(name, request))
        run(picture_command(name, request, ending))
        chart = json.loads((SCRATCH / f"{name}.json").read_text())
        wrong += judged(name, chart, request.split()[0])
        print(f"{name}: {len(chart['points'])} paths", file=sys.stderr)
    return wrong


def commands():
    """name of a marker -> the commands that stand in it"""
    found = {name: [picture_command(name, *SCENES[name]), chart_command(name, SCENES[name][0])] for name in SCENES}
    return {**found, **{name: [chart_command(name, request)] for name, request in SWEEPS.items()}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", default="all", choices=["all", "scenes", "sweeps", "left-out", "thesis"])
    parser.add_argument("--scene", nargs="+", choices=list(SCENES), default=list(SCENES))
    options = parser.parse_args()
    SCRATCH.mkdir(parents=True, exist_ok=True)
    DOCS.mkdir(parents=True, exist_ok=True)
    rewrite(PAGE, {f"{name} commands": "```\n" + "\n".join(lines) + "\n```" for name, lines in commands().items()})
    wrong = []
    if options.part in ("all", "scenes"):
        wrong = scenes(options.scene)
        if options.scene == list(SCENES):
            rewrite(PAGE, {"scenes": scenes_table(SCENES)})
    if options.part in ("all", "sweeps"):
        for name, request in SWEEPS.items():
            run(chart_command(name, request))
    if options.part in ("all", "left-out"):
        rewrite(PAGE, {"left out": left_out_table() + "\n\n" + made_by()})
    if options.part in ("all", "thesis"):
        from gallery_thesis import thesis_figures  # the only part that needs matplotlib
        rewrite(PAGE, {"thesis": thesis_figures()})
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
