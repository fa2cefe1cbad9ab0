#!/usr/bin/python3
"""How far pictures of edgewise and of VTK differ, for any volumes: maximum, composite, shaded composite, isosurface.

VTK's conventions are asked of edgewise by parameters, and what has none is asked of VTK:
- The volume ends at the outermost samples: six clip planes (edgewise goes half a voxel on).
- Opacities are those of the smallest spacing, which is also the step. Samples of the two lie at other places of a ray. --finer N
  takes N in place of each, which shows what that makes.
- VTK raises N.H to the power, edgewise R.V. With a light at the eye R.V has twice the angle, so 10 there is 2.5 here.
- VTK drops ambient light unless a light has an ambient colour: the light here has one.
- VTK draws what its rays gave, n pixels along an axis, as a texture whose outermost texel centres lie on the edges of these pixels. So
  it is magnified by n / (n - 1) and interpolated. What the rays gave is read from its memory and compared here. The column "as drawn" is the
  difference to what its window shows.
Rays that run in a face of the volume are left out: there rounding decides whether a ray meets it.

    EDGEWISE=build/release/bin/edgewise xvfb-run -a -s "-screen 0 1280x1024x24" benchmarks/beside_vtk.py FILE... [--size 256]
        [--finer 1] [--level VALUE] [--pictures FOLDER] [-o FILE]

FILE: any volume that edgewise reads. Levels and transfer functions follow from the percentiles of its values; --level is another value
of the surface. Pictures have edgewise on the left, VTK in the middle, and 8 times their difference. -o puts the four of the last volume
into one, edgewise above, VTK below. Needs numpy, OpenCV and VTK (script/setup --bench).
"""
import argparse
import json
import pathlib
import subprocess

import numpy as np

import render_speed
from render_speed import EDGEWISE, WORK, Scene

MATERIAL = ["--light", "head", "--material", f"{render_speed.AMBIENT},{render_speed.DIFFUSE},{render_speed.SPECULAR},{render_speed.POWER / 4}"]
TURN = (20, 35, 0)


def read(file):
    """Values, spacing, and how values of the file become these; whole numbers as 16 bits, all others scaled to them."""
    info = json.loads(subprocess.run([EDGEWISE, "info", file, "--json", "-"], capture_output=True, text=True, check=True).stdout)
    out = WORK / "read.nrrd"
    subprocess.run([EDGEWISE, "warp", file, "-o", out, "--quiet"], check=True)
    head, data = out.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    kind = {"float": "<f4", "int16": "<i2", "short": "<i2", "uint16": "<u2", "ushort": "<u2", "unsigned short": "<u2", "uint8": "u1", "uchar": "u1",
            "unsigned char": "u1", "int8": "i1"}[fields["type"]]
    samples = np.frombuffer(data, kind).reshape(info["extent"][::-1]).astype("f4")
    least, scale = (float(samples.min()), 4000 / float(np.ptp(samples))) if kind == "<f4" else (0, 1)
    return ((samples - least) * scale).round().astype("<i2"), info["spacing"], lambda value: (value - least) * scale


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


def compare(file, size, finer, folder, level):
    samples, spacing, stored = read(file)
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
    level = (low + middle) / 2 + 0.25 if level is None else stored(level)
    white = [(low, 1, 0), (high, 1, 1)]
    pairs = []
    for what in ("mip", "composite", "shaded", "surface"):
        if what == "surface":
            _, window, _ = scene.vtk_surface(level)
            words = ["--mode", "surface", "--isovalue", level, *MATERIAL]
        else:
            window, _ = scene.vtk_volume(None if what == "mip" else points, what == "shaded", white, finer)
            words = ["--mode", "mip"] if what == "mip" else scene.transfer(points) + (["--shade", "phong", *MATERIAL] if what == "shaded" else [])
        ours, drawn = scene.picture([*words, *clip, "--via", f"project.ray_cast/filter=foh/step={1 / finer}"]), scene.pixels(window)
        theirs = drawn if what == "surface" else scene.cast_pixels()
        ours = 255 * (np.clip((ours - low) / (high - low), 0, 1) if what == "mip" else np.clip(ours, 0, 1))
        away = np.abs(ours - theirs)
        shown = away[keep & ((ours > 0) | (theirs > 0))]
        print(f"| {name} | {what} | {np.sqrt(np.mean(away[keep] ** 2)):.2f} | {np.sqrt(np.mean((ours - drawn)[keep] ** 2)):.2f} | {np.mean(away[keep]) / 2.55:.2f} % | {away[keep].max() / 2.55:.0f} % | "
              f"{np.median(shown):.2f} | {100 * (away[keep] > 16).mean():.2f} % |", flush=True)
        pairs.append(np.concatenate([ours, theirs]))
        if folder:
            import cv2
            cv2.imwrite(str(pathlib.Path(folder) / f"{name}_{what}.png"), np.concatenate([ours, theirs, np.clip(8 * away, 0, 255)], 1).astype("u1"))
    return np.concatenate(pairs, 1).astype("u1")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("files", nargs="+")
    arguments.add_argument("--size", type=int, default=256)
    arguments.add_argument("--finer", type=int, default=1)
    arguments.add_argument("--level", type=float)
    arguments.add_argument("--pictures")
    arguments.add_argument("-o", dest="out")
    options = arguments.parse_args()
    print("| volume | picture | root mean square, of 255 | as drawn | mean, of the range | largest | median where either shows something, of 255 | "
          "pixels that differ by more than 16 |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for file in options.files:
        pairs = compare(file, options.size, options.finer, options.pictures, options.level)
    if options.out:
        import cv2
        cv2.imwrite(options.out, pairs)


if __name__ == "__main__":
    main()
