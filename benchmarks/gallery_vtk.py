#!/usr/bin/python3
"""The same scene by VTK and by edgewise, side by side: MIP, composite, shaded composite, isosurface of the bundled CT head.

VTK's conventions are reproduced by parameters: parallel rays through the centres of square pixels of 0.75 mm, one sample each smallest
spacing, linear interpolation, opacities for that length, a light at the eye, ambient 0.1, diffuse 0.7, specular 0.2, power 10.
Writes docs/gallery/vtk_NAME.png (edgewise left, VTK right) and prints how far they differ, of 255.
Usage: EDGEWISE=build/release/bin/edgewise xvfb-run -a -s "-screen 0 1280x1024x24" benchmarks/gallery_vtk.py
"""
import json
import os
import pathlib
import subprocess
import tempfile

import cv2
import numpy as np
import vtk
from vtkmodules.util import numpy_support

EDGEWISE = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
HEAD = "data/ct_head/quarter.nhdr"
SIZE, TURN, PIXEL = 320, (90, 30, 180), 0.75
LEVEL = 1250
POINTS = [(0, 0, (0, 0, 0)), (500, 0, (0.9, 0.6, 0.4)), (1100, 0.06, (0.9, 0.6, 0.4)), (1250, 0.6, (1, 0.95, 0.85)), (3000, 0.9, (1, 1, 1))]
LOOK = ["--light", "head", "--material", "0.1,0.7,0.2,10"]  # VTK's
WORK = pathlib.Path(tempfile.mkdtemp(prefix="edgewise-vtk-"))


def turned(a, b, c):
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.radians([a, b, c])), np.sin(np.radians([a, b, c]))
    return (np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]]) @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]]) @
            np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]))


def volume():
    """The samples as edgewise reads them, and their spacing."""
    info = json.loads(subprocess.run([EDGEWISE, "info", HEAD, "--json", "-"], capture_output=True, text=True, check=True).stdout)
    subprocess.run([EDGEWISE, "warp", HEAD, "-o", WORK / "v.nrrd", "--quiet"], check=True)
    head, data = (WORK / "v.nrrd").read_bytes().split(b"\n\n", 1)
    kind = {"short": "<i2", "int16": "<i2", "unsigned short": "<u2", "uint16": "<u2", "uint8": "u1", "unsigned char": "u1"}
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    assert "gzip" not in fields["encoding"], "compressed"
    samples = np.frombuffer(data, kind[fields["type"]]).reshape(info["extent"][::-1])
    return samples, info["spacing"]


def scene(samples, spacing):
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.SetSpacing(*spacing)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(np.ascontiguousarray(samples).ravel(), deep=1))
    return image


def vtk_picture(image, samples, spacing, mode, step):
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    if mode == "surface":
        flying = vtk.vtkFlyingEdges3D()
        flying.SetInputData(image)
        flying.SetValue(0, LEVEL)
        flying.ComputeNormalsOn()
        mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        mapper.SetInputConnection(flying.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetInterpolationToPhong()
        renderer.AddActor(actor)
    else:
        mapper, actor, look = vtk.vtkFixedPointVolumeRayCastMapper(), vtk.vtkVolume(), vtk.vtkVolumeProperty()
        mapper.SetInputData(image)
        mapper.SetAutoAdjustSampleDistances(0)
        mapper.SetImageSampleDistance(1)
        mapper.SetSampleDistance(step)
        mapper.SetInteractiveSampleDistance(step)
        (mapper.SetBlendModeToMaximumIntensity if mode == "mip" else mapper.SetBlendModeToComposite)()
        opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
        if mode == "mip":
            low, high = float(samples.min()), float(samples.max())
            for value, grey in ((low, 0), (high, 1)):
                opacity.AddPoint(value, 1)
                colour.AddRGBPoint(value, grey, grey, grey)
        else:
            for value, share, rgb in POINTS:
                opacity.AddPoint(value, share)
                colour.AddRGBPoint(value, *rgb)
        look.SetScalarOpacity(opacity)
        look.SetColor(colour)
        look.SetScalarOpacityUnitDistance(step)
        look.SetInterpolationTypeToLinear()
        (look.ShadeOn if mode == "shaded" else look.ShadeOff)()
        actor.SetMapper(mapper)
        actor.SetProperty(look)
        renderer.AddVolume(actor)
    look.SetAmbient(0.1)
    look.SetDiffuse(0.7)
    look.SetSpecular(0.2)
    look.SetSpecularPower(10)
    window.SetOffScreenRendering(1)
    window.SetSize(SIZE, SIZE)
    window.SetMultiSamples(0)
    window.SetDesiredUpdateRate(1e-4)
    window.AddRenderer(renderer)
    middle = (np.array(samples.shape[::-1]) - 1) / 2 * spacing
    back = turned(*TURN).T  # screen -> object
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(middle - 1000 * back[:, 2]))
    camera.SetViewUp(*(-back[:, 1]))
    camera.SetParallelScale(SIZE * PIXEL / 2)
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    pixels = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    return pixels.reshape(SIZE, SIZE, -1)[::-1, :, :3]


def our_picture(samples, mode):
    (WORK / "t.json").write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": c} for v, a, c in POINTS]}))
    words = {"mip": ["--mode", "mip", "--window", f"{samples.min()},{samples.max()}"],
             "composite": ["--mode", "composite", "--transfer", WORK / "t.json", "--window", "0,1"],
             "shaded": ["--mode", "composite", "--shade", "phong", *LOOK, "--transfer", WORK / "t.json", "--window", "0,1"],
             "surface": ["--mode", "surface", "--isovalue", LEVEL, *LOOK, "--window", "0,1"]}[mode]
    subprocess.run([EDGEWISE, "render", HEAD, "-o", WORK / "o.png", "--view", "z", "--rotate", ",".join(map(str, TURN)), "--size",
                    f"{SIZE}x{SIZE}", "--spacing", str(PIXEL), "--max-error", "9", "--via", "project.ray_cast/filter=foh/step=1", "--quiet",
                    *map(str, words)], check=True)
    picture = cv2.imread(str(WORK / "o.png"))[:, :, ::-1]
    return picture


def main():
    samples, spacing = volume()
    step = min(spacing)
    image = scene(samples, spacing)
    print("| picture | root mean square | largest | pixels that differ by more than 16 |\n|---|---:|---:|---:|")
    for mode in ("mip", "composite", "shaded", "surface"):
        theirs, ours = vtk_picture(image, samples, spacing, mode, step).astype(int), our_picture(samples, mode).astype(int)
        away = np.abs(ours - theirs).max(-1)
        print(f"| {mode} | {np.sqrt(((ours - theirs) ** 2).mean()):.2f} | {away.max()} | {(away > 16).mean() * 100:.1f} % |")
        both = np.concatenate([ours, np.full((SIZE, 6, 3), 128), theirs], 1).astype("u1")
        cv2.imwrite(f"docs/gallery/vtk_{mode}.png", both[:, :, ::-1])


if __name__ == "__main__":
    main()
