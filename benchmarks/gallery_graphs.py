#!/usr/bin/python3
"""The graphs of the thesis's FIGURES 10, 11 (58, 86) and 12, drawn by `edgewise graph` with what each edge is predicted to cost.

    EDGEWISE=build/release/bin/edgewise benchmarks/gallery_graphs.py      writes docs/graphs/*.svg; needs Graphviz

The built-in machine profile prices them, so the drawings are the same on every machine.
"""
import os
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).parent.parent
EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
GRAPHS = {
    "figure_10": "filter data/coffee/coffee.png --op convolve --kernel gauss:5",
    "figure_10_dilation": "filter data/coffee/coffee.png --op dilate --kernel sphere:9",
    "figure_11": "render data/ct_chest/chest.nrrd --mode xray --rotate 0,30,0",
    "figure_11_surface": "render data/engine/engine.nii.gz --mode surface --isovalue 90 --rotate 120,0,30 --via surface",
    "figure_86": "render data/ct_chest/chest.nrrd --mode xray --turntable 36 --via spectrum",
    "figure_12": "",
}


def main():
    out = ROOT / "docs/graphs"
    out.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as empty:
        env = {**os.environ, "XDG_CONFIG_HOME": empty, "XDG_CACHE_HOME": empty}
        for name, request in GRAPHS.items():
            subprocess.run([EDGEWISE, "graph", *request.split(), "--threads", "1", "-o", out / f"{name}.svg"] if request else
                           [EDGEWISE, "graph", "-o", out / f"{name}.svg"], cwd=ROOT, env=env, check=True)


if __name__ == "__main__":
    main()
