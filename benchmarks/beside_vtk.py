#!/usr/bin/python3
"""How far pictures of edgewise and of VTK differ, for any volumes: maximum, composite, lit composite, isosurface.

VTK's conventions are asked of edgewise by parameters, and what has none is asked of VTK:
- The volume ends at the outermost samples: six clip planes (edgewise goes half a voxel on).
- Opacities are those of the smallest spacing, which is also the step. Samples of the two lie at other places of a ray. --finer N
  takes N in place of each, which shows what that makes.
- VTK raises N.H to the power, edgewise R.V. With a light at the eye R.V has twice the angle, so 10 there is 2.5 here.
- VTK drops ambient light unless a light has an ambient colour: the light here has one.
Rays that run in a face of the volume are left out: there rounding decides whether a ray meets it.

    EDGEWISE=build/release/bin/edgewise xvfb-run -a -s "-screen 0 1280x1024x24" benchmarks/beside_vtk.py FILE... [--size 256]
        [--finer 1] [--pictures FOLDER]

FILE: any volume that edgewise reads. Levels and transfer functions follow from the percentiles of its values. Pictures have
edgewise on the left, VTK in the middle, and 8 times their difference. Needs numpy, OpenCV and VTK (script/setup --bench).
"""
import argparse
import json
import pathlib
import subprocess

import numpy as np

import render_speed
from render_speed import EDGEWISE, WORK, Scene

MATERIAL = ["--material", f"{render_speed.AMBIENT},{render_speed.DIFFUSE},{render_speed.SPECULAR},{render_speed.POWER / 4}"]
TURN = (20, 35, 0)


def read(file):
    """Values and spacing; whole numbers as 16 bits, all others scaled to them."""
    info = json.loads(subprocess.run([EDGEWISE, "info", file, "--json", "-"], capture_output=True, text=True, check=True).stdout)
    out = WORK / "read.nrrd"
    subprocess.run([EDGEWISE, "warp", file, "-o", out, "--quiet"], check=True)
    head, data = out.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    kind = {"float": "<f4", "int16": "<i2", "short": "<i2", "uint16": "<u2", "ushort": "<u2", "unsigned short": "<u2", "uint8": "u1", "uchar": "u1",
            "unsigned char": "u1", "int8": "i1"}[fields["type"]]
    samples = np.frombuffer(data, kind).reshape(info["extent"][::-1]).astype("f4")
    if kind == "<f4":
        samples = (samples - samples.min()) / np.ptp(samples) * 4000
    return samples.round().astype("<i2"), info["spacing"]


def inside(scene):
    """Pixels whose rays do not run in a face."""
    at = (np.arange(scene.size) - (scene.size - 1) / 2) * scene.pixel
    start = scene.middle + at[:, None, None] * scene.back[:, 1] + at[None, :, None] * scene.back[:, 0]
    keep = np.ones((scene.size,) * 2, bool)
    for axis in range(3):
        if abs(scene.back[axis, 2]) < 1e-9:
            top = (scene.samples.shape[2 - axis] - 1) * scene.spacing[axis]
            keep &= np.minimum(np.abs(start[..., axis]), np.abs(start[..., axis] - top)) > scene.pixel
    return keep


def compare(file, size, finer, folder):
    samples, spacing = read(file)
    name = pathlib.Path(file).name.split(".")[0]
    length = np.linalg.norm(np.array(samples.shape[::-1]) * spacing)
    scene = Scene(name, samples, spacing, TURN, size, round(float(length) / size, 6))
    clip = [word for axis in range(3) for sign in (1, -1) for word in
            ("--clip-plane", ",".join(str(sign * (k == axis)) for k in range(3)) + f",{0 if sign > 0 else samples.shape[2 - axis] - 1}")]
    seen = samples[samples != np.bincount((samples - samples.min()).ravel()).argmax() + samples.min()]
    low, middle, high = (float(v) for v in np.percentile(seen, [40, 70, 95]))
    middle, high = max(middle, low + 1), max(high, low + 2)
    points = [(float(samples.min()), 0, 0), (low, 0, 0.3), (middle, 0.15, 0.7), (high, 0.6, 1)]
    keep = inside(scene)
    white = [(low, 1, 0), (high, 1, 1)]
    for what in ("mip", "composite", "shaded", "surface"):
        if what == "surface":
            level = (low + middle) / 2 + 0.25
            _, window, _ = scene.vtk_surface(level)
            words = ["--mode", "surface", "--isovalue", level, *MATERIAL]
        else:
            window, _ = scene.vtk_volume(None if what == "mip" else points, what == "shaded", white, finer)
            words = ["--mode", "mip"] if what == "mip" else scene.transfer(points) + (["--shade", "phong", *MATERIAL] if what == "shaded" else [])
        ours, theirs = scene.picture([*words, *clip, "--via", f"project.ray_cast/filter=foh/step={1 / finer}"]), scene.pixels(window)
        ours = 255 * (np.clip((ours - low) / (high - low), 0, 1) if what == "mip" else np.clip(ours, 0, 1))
        away = np.abs(ours - theirs)
        print(f"| {name} | {what} | {np.sqrt(np.mean(away[keep] ** 2)):.2f} | {np.median(away[keep & ((ours > 0) | (theirs > 0))]):.2f} | "
              f"{100 * (away[keep] > 16).mean():.2f} % |", flush=True)
        if folder:
            import cv2
            cv2.imwrite(str(pathlib.Path(folder) / f"{name}_{what}.png"), np.concatenate([ours, theirs, np.clip(8 * away, 0, 255)], 1).astype("u1"))


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("files", nargs="+")
    arguments.add_argument("--size", type=int, default=256)
    arguments.add_argument("--finer", type=int, default=1)
    arguments.add_argument("--pictures")
    options = arguments.parse_args()
    print("| volume | picture | root mean square, of 255 | median where either shows something | pixels that differ by more than 16 |")
    print("|---|---|---:|---:|---:|")
    for file in options.files:
        compare(file, options.size, options.finer, options.pictures)


if __name__ == "__main__":
    main()
