#!/usr/bin/python3
"""Measured errors of edges, as a table in Markdown: NRMSE on the bundled MR brain turned by 30, 20 and 10 degrees, against the reference at 2048
random output samples. `script/edges_page --errors` puts it into docs/edges.md. EDGEWISE: the command, default build/release/bin/edgewise."""
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
HEAD = ROOT / "data/mr_brain/MR.nii.gz"
TURN = ["--rotate", "30,20,10"]

RESULTS = ("warp", "mip", "xray", "composite")
# Paths that are forced, and what they make.
ROWS = [
    (["warp.backward/filter=zoh"], ["warp"]),
    (["warp.backward/filter=foh"], ["warp"]),
    (["warp.backward/filter=keys"], ["warp"]),
    (["warp.backward/filter=lanczos3"], ["warp"]),
    (["warp.backward/filter=bspline3"], ["warp"]),
    (["warp.permutation/filter=me"], ["warp"]),
    (["warp.permutation/filter=zoh"], ["warp"]),
    (["warp.permutation/filter=foh"], ["warp"]),
    (["warp.shear/filter=foh"], ["warp"]),
    (["warp.shear/filter=bspline3"], ["warp"]),
    (["warp.backward/filter=bspline3", "project.combine"], ["mip"]),
    (["warp.scale/filter=bspline3", "project.parallel_product/filter=foh"], ["mip", "xray", "composite"]),
    (["project.ray_cast/filter=zoh/step=1"], ["mip"]),
    (["project.ray_cast/filter=foh/step=1"], ["mip", "xray", "composite"]),
    (["project.ray_cast/filter=bspline3/step=0.5"], ["mip", "composite"]),
    (["project.preintegrated_cast/filter=foh/step=1"], ["composite"]),
    (["store.reduce/level=1", "project.level_cast/step=2"], ["mip", "xray", "composite"]),
    (["project.shear_warp/filter=foh"], ["mip", "xray", "composite"]),
    (["project.splat"], ["xray"]),
    (["project.splat_sheets"], ["composite"]),
    (["project.splat_ordered"], ["composite"]),
    (["project.splat_ewa"], ["xray"]),
    (["project.splat_ewa_sheets"], ["composite"]),
    (["spectrum.forward/width=4", "spectrum.inverse"], ["xray"]),
    (["spectrum.forward/width=6", "spectrum.inverse"], ["xray"]),
]


def measured(result, path):
    """The measured and the predicted error of a path, or why there is none."""
    verb = ["warp"] if result == "warp" else ["render", "--mode", result]
    forced = [word for edge in path for word in ("--via", edge)]
    done = subprocess.run([EDGEWISE, *verb[:1], str(HEAD), "-o", "null:", *verb[1:], *TURN, *forced,
                           "--verify", "--json", "-", "--quiet"],
                          capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' > '.join(path)}, {result}: {done.stderr.strip()}")
    report = json.loads(done.stdout)
    predicted = report["plan"]["predicted"]["error"]
    error = report["measured"]["error"]["nrmse"]
    return f"{error:.2g} ({predicted:.2g})" if predicted is not None else f"{error:.2g}"


def table():
    lines = ["| path | " + " | ".join(RESULTS) + " |", "|---|" + "---|" * len(RESULTS)]
    for path, results in ROWS:
        cells = [measured(result, path) if result in results else "" for result in RESULTS]
        lines.append(f"| {', '.join(f'`{edge}`' for edge in path)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(table(), end="")
