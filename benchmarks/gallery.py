#!/usr/bin/python3
"""Makes the pictures and tables of docs/gallery.md.

    EDGEWISE=build/release/bin/edgewise xvfb-run -a -s "-screen 0 1280x1024x24" benchmarks/gallery.py defaults --data FOLDER
        [--before OLDER_EDGEWISE] [--only NAME ...]
    EDGEWISE=build/release/bin/edgewise benchmarks/gallery.py pictures|chart|thesis

Runs from the root of the repository; tables are written between their markers in the page.
- `defaults`: sheets of default pictures beside an older version and VTK, and the table of them. FOLDER holds what is not bundled (ct_chest_dicom,
  ct_tooth_nrrd). Without --before the older version's pictures stay as they are in the sheets. Some seconds.
- `pictures`: runs each command of the pages in docs that writes a picture into docs/gallery.
- `chart`: all paths to one picture. Times are real: on a machine that does nothing else, after `edgewise calibrate`. Ends with 1
  where the path that the planner chose is clearly beaten (three quarters of its times are longer than three quarters of the rival's,
  medians are more than 3 % apart, and the rival's error is not larger).
- `thesis`: figures 75 to 77 of the thesis.

`defaults` needs OpenCV and VTK, `thesis` numpy and matplotlib (script/setup --bench).
"""
import argparse
import json
import re
import shlex
import subprocess
import sys

from gallery_runs import DOCS, EDGEWISE, PAGE, ROOT, SCRATCH, median, milliseconds, quartiles, rewrite, route

FEWEST_PATHS, FEWEST_FAMILIES = 15, 4
SAME = 1.03  # two runs of one path differ by as much


def run(command):
    """A command as it stands in a page, from the root of the repository."""
    words = shlex.split(command)
    assert words[0] == "edgewise"
    done = subprocess.run([EDGEWISE, *words[1:], "--quiet"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command}\n{done.stderr}")


def commands(verbs):
    """Those of all pages that write into docs/gallery, in order."""
    found = {}
    for page in sorted((ROOT / "docs").glob("*.md")):
        for command in re.findall(rf"^edgewise (?:{verbs}) .*$", page.read_text(encoding="utf8"), re.M):
            if "-o docs/gallery/" in command:
                found[command] = None
    return list(found)


def beats(rival, chosen):
    """Clearly faster, and no less accurate."""
    if rival["measured"]["error"] is None or chosen["measured"]["error"] is None:
        return False
    faster = (quartiles(rival)[1] < quartiles(chosen)[0]
              and median(rival) * SAME < median(chosen))
    return faster and rival["measured"]["error"]["nrmse"] <= chosen["measured"]["error"]["nrmse"]


def judged(chart):
    """What is wrong with a chart, in words."""
    points = [point for point in chart["points"] if point["measured"]]
    families = {point["family"] for point in points}
    wrong = []
    if len(points) < FEWEST_PATHS or len(families) < FEWEST_FAMILIES:
        wrong.append(f"{len(points)} paths, {len(families)} families")
    if not any(point["front"] for point in points):
        wrong.append("no front")
    chosen = next((point for point in points if point["chosen"]), None)
    if chosen is None:
        return [*wrong, "what the planner chose was not measured"]
    return wrong + [f"{described(chosen)}\n    is beaten by {described(rival)}" for rival in points if beats(rival, chosen)]


def described(point):
    predicted, error = point["predicted"], point["measured"]["error"]
    return (f"{route(point['plan'])}: {milliseconds(median(point))} measured, {milliseconds(predicted['seconds'])} "
            f"predicted; error {error['nrmse']:.3g} measured, {predicted['error']:.3g} predicted")


def chart():
    wrong = []
    for command in commands("chart"):
        run(command)
        file = re.search(r"-o (build/gallery/\S+\.json)", command)[1]
        wrong += judged(json.loads((ROOT / file).read_text()))
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["defaults", "pictures", "chart", "thesis"])
    parser.add_argument("--data", help="folder of what is not bundled")
    parser.add_argument("--before", help="an older edgewise")
    parser.add_argument("--only", nargs="+", help="these sheets; the table stays as it is")
    options = parser.parse_args()
    SCRATCH.mkdir(parents=True, exist_ok=True)
    DOCS.mkdir(parents=True, exist_ok=True)
    if options.part == "defaults":
        from gallery_defaults import defaults
        table = defaults(options.data, options.before, options.only)
        if not options.only:
            rewrite(PAGE, {"defaults": table})
    if options.part == "pictures":
        for command in commands("render|warp"):
            run(command)
    if options.part == "chart":
        sys.exit("\n".join(chart()))
    if options.part == "thesis":
        from gallery_thesis import thesis_figures
        rewrite(PAGE, {"thesis": thesis_figures()})


if __name__ == "__main__":
    main()
