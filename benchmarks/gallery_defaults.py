"""The part `defaults` of gallery.py: what `edgewise render FILE` shows of ten kinds of data, with no option, with `--mode shaded` and with
`--mode composite`, beside an older version and beside VTK.

VTK: vtkSmartVolumeMapper with its own sample distance, light and material, the same function of colours and opacities (that of the preset,
or the grey ramp) for the same length, parallel rays from the same side. A sheet each: docs/gallery/default_NAME.jpg.
"""
import json
import pathlib
import re
import subprocess
import sys

import numpy as np

from gallery_runs import DOCS, EDGEWISE, ROOT, SCRATCH

TILE, HEAD = 320, 24  # pixels; multiples of 8, so that a tile taken from a JPEG file and saved again stays as it is
MODES = {"": [], "--mode shaded": ["--mode", "shaded"], "--mode composite": ["--mode", "composite"]}
GREY = 48

# File, below the folder of --data, of what was written (MADE) or of the repository; options of the first mode and of the others: which channel.
MADE = SCRATCH / "made"
SCENES = {
    "ct_head": (MADE / "first_hour/ct", [], []),
    "ct_cranium": (MADE / "cranium.nrrd", [], []),
    "ct_chest": ("ct_chest_dicom", [], []),
    "mr_brain": (ROOT / "data/mr_brain/MR.nii.gz", [], []),
    "mr_angio": (ROOT / "data/carotid/carotid.vtk", [], []),
    "tooth": ("ct_tooth_nrrd/tooth.nhdr", [], []),
    "engine": (ROOT / "data/engine/engine.nii.gz", [], []),
    "neuron": (ROOT / "data/neuron/neuron.tif", [], []),
    "frog": (ROOT / "data/frog/frogtissue.mhd", [], []),
    "cells": (MADE / "first_hour/cells.ome.tif", ["--channel", "all"], ["--channel", "1"]),
}


def make_inputs():
    """The head as DICOM and the cells of docs/first_hour.md; a cranium by formula."""
    if not (MADE / "first_hour/cells.ome.tif").exists():
        subprocess.run([ROOT / "script/first_hour_data", MADE / "first_hour"], check=True, stdout=subprocess.DEVNULL)
    if (MADE / "cranium.nrrd").exists():
        return
    # A CT of a head: scalp, two tables of compact bone with spongy bone between, brain, sockets, a nose; noise of 15 HU; values are HU + 1024.
    extent, spacing = (200, 240, 150), (0.8, 0.8, 1.0)
    z, y, x = [np.arange(n, dtype="f4") for n in extent[::-1]]
    z, y, x = ((z - 60) * spacing[2])[:, None, None], ((y - 119.5) * spacing[1])[None, :, None], ((x - 99.5) * spacing[0])[None, None, :]
    far = np.sqrt((x / 70) ** 2 + (y / 88) ** 2 + (np.maximum(z, 0) / 72) ** 2 + (np.minimum(z, 0) / 110) ** 2)
    depth = (1 - far) * 75  # below the surface, about [mm]
    wave = 0.8 * np.sin(0.11 * x + 1) * np.sin(0.09 * y) * np.sin(0.1 * z + 2)
    table = lambda at, half: np.clip((half - np.abs(depth - at)) / 1.8 + 0.5, 0, 1)
    bone = np.clip(1500 * (table(1.2, 1.2) + table(6.2 + wave, 1.0)) + 500 * table(3.6, 1.8), 0, 1700)
    for at, radius in (((-26, -84, -14), 17), ((26, -84, -14), 17), ((0, -88, -38), 11), ((0, 20, -75), 20)):
        bone = bone * np.clip((np.sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2 + (z - at[2]) ** 2) - radius) / 1.8 + 0.5, 0, 1)
    soft = 1060 * np.clip((depth + 5) / 1.8 + 0.5, 0, 1)  # water and a little more, from 5 mm outside the bone
    values = np.clip(24 + soft + bone * (2200 - 1060) / 1700 + 15 * np.random.default_rng(1).standard_normal(bone.shape, dtype="f4"), 0, 4095)
    header = (f"NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: {' '.join(map(str, extent))}\nspace directions: "
              f"({spacing[0]},0,0) (0,{spacing[1]},0) (0,0,{spacing[2]})\nspace origin: (0,0,0)\nspace units: \"mm\" \"mm\" \"mm\"\n"
              "kinds: domain domain domain\nendian: little\nencoding: raw\n\n")
    (MADE / "cranium.nrrd").write_bytes(header.encode() + values.round().astype("<i2").tobytes())


def run(command, words):
    """What it says, and the report; None where it refuses."""
    home = {"XDG_CONFIG_HOME": str(SCRATCH / "home"), "XDG_CACHE_HOME": str(SCRATCH / "home"), "PATH": "/usr/bin:/bin"}
    done = subprocess.run([command, *map(str, words), "--json", "-"], capture_output=True, text=True, env=home)
    return done.stderr, json.loads(done.stdout) if done.returncode == 0 else None


def tile(picture):
    import cv2
    out = np.full((TILE, TILE, 3), GREY, "u1")
    if picture is None:
        return out
    factor = TILE / max(picture.shape[:2])
    size = [max(1, round(n * factor)) for n in picture.shape[1::-1]]
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR)
    left, top = (TILE - size[0]) // 2, (TILE - size[1]) // 2
    out[top:top + size[1], left:left + size[0]] = small
    return out


# VTK -------------------------------------------------------------------------------------------------------------------
def view_axes(info):
    """Right, down and away on the screen, as axes of the file with signs, by the rule of the default view."""
    if info["orientation"] is None:
        return [(0, 1), (1, 1), (2, 1)]
    axes, directions = [], np.array(info["direction"])  # of each axis of the file, LPS
    for screen in ((1, 0, 0), (0, 0, -1), (0, 1, 0)):  # the patient's left, feet, back
        along = directions @ screen
        axis = int(np.argmax(np.abs(along)))
        axes.append((axis, 1 if along[axis] > 0 else -1))
    return axes


def samples_of(file, options, info):
    out = SCRATCH / "values.nrrd"
    said, report = run(EDGEWISE, ["warp", file, *options, "-o", out, "--bits", "32"])
    if report is None:
        sys.exit(f"{file}: {said}")
    data = out.read_bytes().split(b"\n\n", 1)[1]
    return np.frombuffer(data, "<f4").reshape(info["extent"][::-1])


def function_of(report, said, info, samples, presets):
    """(value, opacity, colour) of the picture's transfer function, and the length that opacities are for."""
    least = min(info["spacing"])
    name, window = report["request"].get("preset"), report["request"].get("preset_window")
    if not name:
        low, high = float(samples.min()), float(samples.max())
        share = re.search(r"opacities are for 1/(\d+) of", said)
        return [(low, 0, (0, 0, 0)), (high, 0.05, (1, 1, 1))], least / (int(share[1]) if share else 1)
    preset = presets[name]
    points = [(p["value"], p["opacity"], p["color"]) for p in preset["points"]]
    low, high = window
    if preset["values"] == "window":
        points = [(low + value * (high - low), *rest) for value, *rest in points]
    elif preset["values"] == "hounsfield":  # plus what the file adds
        points = [(value + low - points[0][0], *rest) for value, *rest in points]
    said_length = re.search(r"opacities are for ([\d.e-]+) mm", said)
    return points, float(said_length[1]) if said_length else preset["unit"] or least


def vtk_picture(samples, info, size, kind, function):
    """kind: mip, shaded or composite. size: of edgewise's picture, which shows as much."""
    import vtk
    from vtkmodules.util import numpy_support
    scale = 1 / min(info["spacing"])  # micrometres in mm are too small for VTK's tolerances
    spacing = np.array(info["spacing"]) * scale
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.SetSpacing(*spacing)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(np.ascontiguousarray(samples).ravel(), deep=1))
    mapper, volume, look = vtk.vtkSmartVolumeMapper(), vtk.vtkVolume(), vtk.vtkVolumeProperty()
    mapper.SetInputData(image)
    mapper.SetRequestedRenderModeToRayCast()
    opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    if kind == "mip":
        mapper.SetBlendModeToMaximumIntensity()
        for value, grey in ((float(samples.min()), 0), (float(samples.max()), 1)):
            opacity.AddPoint(value, 1)
            colour.AddRGBPoint(value, grey, grey, grey)
    else:
        points, unit = function
        for value, share, rgb in points:
            opacity.AddPoint(value, share)
            colour.AddRGBPoint(value, *rgb)
        look.SetScalarOpacityUnitDistance(unit * scale)
    look.SetScalarOpacity(opacity)
    look.SetColor(colour)
    look.SetInterpolationTypeToLinear()
    (look.ShadeOn if kind == "shaded" else look.ShadeOff)()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.AddVolume(volume)
    window.SetOffScreenRendering(1)
    window.SetSize(*size)
    window.SetMultiSamples(0)
    window.SetDesiredUpdateRate(1e-4)
    window.AddRenderer(renderer)
    right, down, away = [sign * np.eye(3)[axis] for axis, sign in view_axes(info)]
    sides = np.array(info["extent"]) * spacing
    middle = (np.array(info["extent"]) - 1) / 2 * spacing
    pixel = max(abs(right) @ sides / size[0], abs(down) @ sides / size[1])
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(middle - 10 * sides.max() * away))
    camera.SetViewUp(*-down)
    camera.SetParallelScale(size[1] * pixel / 2)
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    KEPT.append((window, renderer))
    pixels = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    return pixels.reshape(size[1], size[0], -1)[::-1, :, 2::-1]


KEPT = []  # VTK's driver fails where a window is closed before the next is opened


# Sheets ----------------------------------------------------------------------------------------------------------------
def described(picture):
    """How bright it is, of 255, where it is not black: a half is darker, 99 % are; what is all white [%]; its corners."""
    lit = picture.max(axis=2)
    lit = lit[lit > 8]
    if not lit.size:
        return "| 0 | 0 | 0 | 0 |"
    corners = picture[[0, 0, -1, -1], [0, -1, 0, -1]].max()
    return f"| {np.median(lit):.0f} | {np.quantile(lit, 0.99):.0f} | {100 * (picture.min(axis=2) == 255).sum() / lit.size:.1f} | {corners} |"


def sheet(name, file, first, others, before, presets):
    """Rows of the table."""
    import cv2
    path = DOCS / f"default_{name}.jpg"
    old = cv2.imread(str(path)) if path.exists() and not before else None
    rows, table = [], []
    samples = None
    for number, (mode, words) in enumerate(MODES.items()):
        options = others if number else first
        info = json.loads(subprocess.run([EDGEWISE, "info", file, "--json", "-"], capture_output=True, text=True, check=True).stdout)
        out = SCRATCH / "now.png"
        said, report = run(EDGEWISE, ["render", file, *options, *words, "-o", out])
        if report is None:
            sys.exit(f"{file} {mode}: {said}")
        now = cv2.imread(str(out))
        was = None
        if before:
            old_out = SCRATCH / "before.png"
            old_out.unlink(missing_ok=True)
            said_before, report_before = run(before, ["render", file, *options, *words, "-o", old_out])
            if report_before is None:
                print(f"{name} {mode}, before: {said_before.strip()}", file=sys.stderr)
            was = cv2.imread(str(old_out))
        top = number * (TILE + HEAD)
        left = old[top + HEAD:top + HEAD + TILE, :TILE] if old is not None else tile(was)
        theirs = None
        if not (number == 0 and first):
            if samples is None:
                samples = samples_of(file, options, info)
            kind = ("mip", "shaded", "composite")[number]
            function = None if number == 0 else function_of(report, said, info, samples, presets)
            theirs = vtk_picture(samples, info, now.shape[1::-1], kind, function)
        row = np.concatenate([left, tile(now), tile(theirs)], 1)
        head = np.full((HEAD, row.shape[1], 3), GREY, "u1")
        for column, text in enumerate(("0.30.0", f"now {mode}", "VTK" if theirs is not None else "")):
            cv2.putText(head, text, (8 + column * TILE, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
        rows += [head, row]
        shown = report["request"]
        preset = f"`{shown['preset']}`" if shown.get("preset") else ""
        if preset and shown.get("preset_window"):
            preset += " over {:.4g} to {:.4g}".format(*shown["preset_window"])
        table.append(f"| {name if number == 0 else ''} | {f'`{mode}`' if mode else 'none'} | {preset} {described(now)}")
    cv2.imwrite(str(path), np.concatenate(rows, 0), [cv2.IMWRITE_JPEG_QUALITY, 88])
    return table


def defaults(data, before, only):
    """The table of the page; sheets are written."""
    make_inputs()
    presets = {p["name"]: p for p in json.loads(subprocess.run([EDGEWISE, "list", "presets", "--json", "-"], capture_output=True, text=True, check=True).stdout)["presets"]}
    table = ["| data | options | preset | half below | 99 % below | white, % | corners |", "|---|---|---|---:|---:|---:|---:|"]
    for name, (file, first, others) in SCENES.items():
        if only and name not in only:
            continue
        path = pathlib.Path(data or ".") / file if isinstance(file, str) else file
        if not path.exists():
            sys.exit(f"{name}: {path} is not there; --data names the folder with {file}")
        table += sheet(name, path, first, others, before, presets)
        print(name, file=sys.stderr)
    return "\n".join(table)
