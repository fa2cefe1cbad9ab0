#!/usr/bin/python3
"""Whole commands of edgewise against those of other programs, in turns, at first sight.

A time is the wall time of a process, from its start to its end: starting, reading, planning, computing, writing.
Nothing is kept from runs before: each run of either side has empty folders for caches and settings, so edgewise
has its built-in profile, and OpenGL compiles its shaders. Files are in the page cache. All use the threads that
they take by themselves. In each round all sides run one after the other. The ratio is taken round by round: the
median, and the least and the largest. "start" is what a program takes to start and end, with the imports of its script.

Each pair of results is compared in the same run, in levels of 255 of the range of edgewise's, away from the border
of the data. A mean difference beyond its bound is an error (exit 1). Sizes of files stand in the table.

    EDGEWISE=build/release/bin/edgewise xvfb-run -a benchmarks/whole_commands.py --photo FILE --ct FOLDER
    ... --runs 1 --json FILE --only png,mip        rounds (5), all the figures, some of png jpeg mip xray cone

Needs python3-numpy and python3-opencv. Other programs are left out where they are not installed, with a line that
says so: libvips-tools (VIPS names another command), python3-vtk9 and a display (xvfb, xauth), plastimatch. Nothing is installed.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

EDGEWISE = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
VIPS = os.environ.get("VIPS", "vips")
PYTHON = "/usr/bin/python3"
DEGREES, SIDE, FIELD_OF_VIEW = 10, 512, 20
SHARE = 0.007  # of white, which the largest sample adds to VTK's additive picture

OPENCV = """
import sys
import cv2
if len(sys.argv) < 2:
    sys.exit()
image = cv2.imread(sys.argv[1])
height, width = image.shape[:2]
turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -float(sys.argv[3]), 1)
cv2.imwrite(sys.argv[2], cv2.warpAffine(image, turn, (width, height), flags=cv2.INTER_LINEAR))
"""

# The reader turns rows and slices round, so the eye stands in front, head up, with these vectors.
VTK_CAST = """
import sys
import vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkIOImage import vtkDICOMImageReader, vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkRenderer, vtkRenderWindow, vtkVolume,
                                         vtkVolumeProperty, vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper, vtkGPUVolumeRayCastMapper
if len(sys.argv) < 2:
    sys.exit()
folder, out, kind, mode = sys.argv[1:5]
side, low, high, share = int(sys.argv[5]), *map(float, sys.argv[6:])
reader = vtkDICOMImageReader()
reader.SetDirectoryName(folder)
reader.Update()
step = min(reader.GetOutput().GetSpacing())
mapper = vtkGPUVolumeRayCastMapper() if kind == "gpu" else vtkFixedPointVolumeRayCastMapper()
mapper.SetInputConnection(reader.GetOutputPort())
mapper.SetAutoAdjustSampleDistances(0)
mapper.SetSampleDistance(step)
colour, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
if mode == "mip":
    mapper.SetBlendModeToMaximumIntensity()
    colour.AddRGBPoint(low, 0, 0, 0)
else:
    mapper.SetBlendModeToAdditive()  # adds opacity times the value as a share of the data's range
    colour.AddRGBPoint(low, 1, 1, 1)
opacity.AddPoint(low, share)
colour.AddRGBPoint(high, 1, 1, 1)
opacity.AddPoint(high, share)
look = vtkVolumeProperty()
look.SetColor(colour)
look.SetScalarOpacity(opacity)
look.SetScalarOpacityUnitDistance(step)
look.SetInterpolationTypeToLinear()
look.ShadeOff()
volume = vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(look)
renderer, window = vtkRenderer(), vtkRenderWindow()
renderer.AddVolume(volume)
window.SetOffScreenRendering(1)
window.SetMultiSamples(0)
window.SetDesiredUpdateRate(1e-4)
window.SetSize(side, side)
window.AddRenderer(renderer)
x, y, z = reader.GetOutput().GetCenter()
camera = renderer.GetActiveCamera()
camera.ParallelProjectionOn()
camera.SetFocalPoint(x, y, z)
camera.SetPosition(x, y + 1000, z)
camera.SetViewUp(0, 0, -1)
camera.SetParallelScale(side * step / 2)
renderer.ResetCameraClippingRange()
window.Render()
grab = vtkWindowToImageFilter()
grab.SetInput(window)
grab.SetInputBufferTypeToRGB()
grab.ReadFrontBufferOff()
writer = vtkPNGWriter()
writer.SetFileName(out)
writer.SetInputConnection(grab.GetOutputPort())
writer.Write()
"""

VTK_SLAB = """
import sys
from vtkmodules.vtkIOImage import vtkDICOMImageReader, vtkPNGWriter
from vtkmodules.vtkImagingCore import vtkImageReslice, vtkImageShiftScale
if len(sys.argv) < 2:
    sys.exit()
folder, out = sys.argv[1:3]
side, low, white = int(sys.argv[3]), float(sys.argv[4]), float(sys.argv[5])
reader = vtkDICOMImageReader()
reader.SetDirectoryName(folder)
reader.Update()
image = reader.GetOutput()
step, depth = min(image.GetSpacing()), image.GetDimensions()[1]
slab = vtkImageReslice()
slab.SetInputConnection(reader.GetOutputPort())
slab.SetResliceAxesDirectionCosines(1, 0, 0, 0, 0, -1, 0, 1, 0)
slab.SetResliceAxesOrigin(*image.GetCenter())
slab.SetOutputSpacing(step, step, step)
slab.SetOutputExtent(0, side - 1, 0, side - 1, 0, 0)
slab.SetOutputOrigin(-(side - 1) / 2 * step, -(side - 1) / 2 * step, 0)
slab.SetInterpolationModeToLinear()
slab.SetSlabModeToMean()
slab.SetSlabNumberOfSlices(depth)
slab.SetOutputScalarType(10)  # float
slab.SetBackgroundLevel(low)
grey = vtkImageShiftScale()
grey.SetInputConnection(slab.GetOutputPort())
grey.SetShift(-low)
grey.SetScale(255 * depth * step / white)
grey.SetOutputScalarTypeToUnsignedChar()
grey.ClampOverflowOn()
writer = vtkPNGWriter()
writer.SetFileName(out)
writer.SetInputConnection(grey.GetOutputPort())
writer.Write()
"""


class Side:
    """A program with its arguments, and the file that it writes."""

    def __init__(self, name, settings, words, out, start, bound=None, fitted=False):
        self.name, self.settings, self.words, self.out, self.start = name, settings, words, out, start
        self.bound, self.fitted = bound, fitted  # of the mean difference [levels]; other units
        self.seconds, self.start_seconds, self.difference = [], [], None


class Job:
    def __init__(self, title, ours, peers, inside):
        self.title, self.ours, self.peers, self.inside = title, ours, peers, inside


def first_sight(words):
    """Wall seconds of a process that finds nothing in its home."""
    with tempfile.TemporaryDirectory() as home:
        places = {name: f"{home}/{name}" for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MESA_SHADER_CACHE_DIR")}
        start = time.perf_counter()
        done = subprocess.run([str(word) for word in words], env={**os.environ, **places}, capture_output=True, text=True)
        taken = time.perf_counter() - start
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))}: exit {done.returncode}: {done.stderr or done.stdout}")
    return taken


def pixels(path):
    """The picture, or the values of an NRRD or of a PFM as plastimatch writes it: rows from the top."""
    if path.suffix in (".pfm", ".nrrd"):
        return np.frombuffer(path.read_bytes()[-4 * SIDE * SIDE:], "<f4").reshape(SIDE, SIDE).astype("f8")
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype("f8")


def difference(ours, theirs, inside, fitted):
    """Mean and largest difference in levels of 255 of the range, where `inside`."""
    if theirs.ndim > ours.ndim:  # a grey picture in three channels
        theirs = theirs[..., 0]
    ours, theirs, scale = ours[inside], theirs[inside], 1
    if fitted:
        columns = np.stack([theirs, np.ones_like(theirs)], axis=1)
        theirs = columns @ np.linalg.lstsq(columns, ours, rcond=None)[0]
        scale = 255 / np.ptp(ours)
    apart = np.abs(ours - theirs) * scale
    return float(apart.mean()), float(apart.max())


def inside_turned(height, width, margin):
    """Pixels of a picture turned about its centre that see the input, `margin` pixels away from its border."""
    angle = math.radians(DEGREES)
    y, x = np.mgrid[0:height, 0:width].astype("f4")
    x, y = x - (width - 1) / 2, y - (height - 1) / 2
    across = np.abs(math.cos(angle) * x + math.sin(angle) * y)
    down = np.abs(math.cos(angle) * y - math.sin(angle) * x)
    return (across <= (width - 1) / 2 - margin) & (down <= (height - 1) / 2 - margin)


def inside_centre(rows, columns):
    result = np.zeros((SIDE, SIDE), bool)
    result[(SIDE - rows) // 2:(SIDE + rows) // 2, (SIDE - columns) // 2:(SIDE + columns) // 2] = True
    return result


class Peers:
    """What is installed; a line for what is not."""

    def __init__(self, folder):
        self.folder, self.said = folder, set()
        for name, text in (("opencv", OPENCV), ("cast", VTK_CAST), ("slab", VTK_SLAB)):
            (folder / f"{name}.py").write_text(text)

    def script(self, name):
        return [PYTHON, self.folder / f"{name}.py"]

    def has(self, name, found, packages):
        if not found and name not in self.said:
            print(f"left out: {name} (Debian: {packages})", flush=True)
            self.said.add(name)
        return found

    def vips(self):
        return self.has("libvips", shutil.which(VIPS), "libvips-tools")

    def vtk(self, display):
        found = subprocess.run([PYTHON, "-c", "import vtkmodules"], capture_output=True).returncode == 0
        if not self.has("VTK", found, "python3-vtk9"):
            return False
        return not display or self.has("VTK's rendering, which needs a display", "DISPLAY" in os.environ, "xvfb xauth")

    def plastimatch(self):
        return self.has("plastimatch", shutil.which("plastimatch"), "plastimatch")


def edgewise(settings, out, verb, source, *words):
    return Side("edgewise", settings, [EDGEWISE, verb, source, "-o", out, "--quiet", *words], out, [EDGEWISE, "--version"])


def turned(photo, work, peers, ending):
    height, width = cv2.imread(str(photo)).shape[:2]
    cosine, sine = math.cos(math.radians(DEGREES)), math.sin(math.radians(DEGREES))
    x, y = (width - 1) / 2, (height - 1) / 2
    vips = [VIPS, "affine", photo]
    about = [f"{cosine} {-sine} {sine} {cosine}", "--odx", x - cosine * x + sine * y, "--ody", y - sine * x - cosine * y,
             "--oarea", f"0 0 {width} {height}", "--interpolate", "bilinear"]
    jpeg = ending == "jpg"
    settings = "quality 95, 4:4:4" if jpeg else "level 1 RLE or 3, 5 filters"
    ours = edgewise(settings, work / f"ours.{ending}", "warp", photo, "--rotate", DEGREES)
    others = []
    if peers.vips():
        ways = [("quality 95, 4:4:4", "[Q=95]")] if jpeg else [
            ("level 6, no filter (default)", ""), ("level 1, 5 filters", "[compression=1,filter=all]")]
        for number, (what, option) in enumerate(ways):
            out = work / f"vips{number}.{ending}"
            others.append(Side("libvips affine", what, [*vips, f"{out}{option}", *about], out, [VIPS, "--version"],
                               0.5 if jpeg else 0.1))
    out = work / f"opencv.{ending}"
    others.append(Side("OpenCV, Python", "quality 95, 4:2:0" if jpeg else "level 1 RLE, filter sub (default)",
                       [*peers.script("opencv"), photo, out, DEGREES], out, peers.script("opencv"), 2 if jpeg else 0.3))
    title = f"photograph {width}x{height}, {DEGREES} degrees, JPEG -> {ending.upper().replace('JPG', 'JPEG')}"
    return Job(title, ours, others, inside_turned(height, width, 8 if jpeg else 2))


def cast(scan, work, peers, mode):
    """Front view, windowed by the range of the data. White in an X-ray is the integral over 1 / SHARE of the largest samples, as VTK adds them."""
    about = described(scan)
    low, high = about["range"]
    spacing = min(about["spacing"])
    window, share, bounds = (low, high), 1, {"fixed": 6, "gpu": 0.2}
    if mode == "xray":
        window, share, bounds = (0, (high - low) / SHARE * spacing), SHARE, {"gpu": 1}
    ours = edgewise("PNG", work / f"ours_{mode}.png", "render", scan, "--mode", mode, "--size", f"{SIDE}x{SIDE}",
                    "--window", "{},{}".format(*window), *(["--zero", low] if mode == "xray" else []))
    others = []
    names = {"fixed": "VTK, fixed-point ray cast", "gpu": "VTK, OpenGL ray cast"}
    if peers.vtk(display=True):
        for kind, bound in bounds.items():
            out = work / f"vtk_{kind}_{mode}.png"
            others.append(Side(names[kind], "PNG of three channels",
                               [*peers.script("cast"), scan, out, kind, mode, SIDE, low, high, share], out,
                               peers.script("cast"), bound))
    if mode == "xray" and peers.vtk(display=False):
        out = work / "slab.png"
        others.append(Side("VTK, vtkImageReslice, mean of a slab", "PNG",
                           [*peers.script("slab"), scan, out, SIDE, low, window[1]], out, peers.script("slab"), 1))
    rows, columns = (int(about["extent"][axis] - 4) * about["spacing"][axis] / spacing for axis in (2, 0))
    title = "{} of a CT {}x{}x{}, front, DICOM -> {}x{} PNG".format(
        "MIP" if mode == "mip" else "X-ray", *about["extent"], SIDE, SIDE)
    return Job(title, ours, others, inside_centre(min(int(rows), SIDE - 8), min(int(columns), SIDE - 8)))


def described(scan):
    done = subprocess.run([EDGEWISE, "info", scan, "--json", "-"], capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else sys.exit(done.stderr)


def cone(scan, work, peers):
    """Rays from a point. With --perspective the eye is where the volume's corners just fit; the source is put there."""
    about = described(scan)
    half = [n * s / 2 for n, s in zip(about["extent"], about["spacing"])]
    middle = [o + h - s / 2 for o, h, s in zip(about["origin"], half, about["spacing"])]
    slope = math.tan(math.radians(FIELD_OF_VIEW / 2))
    distance = max(half[0], half[2]) / slope + half[1]
    ours = edgewise("NRRD, f32", work / "ours_cone.nrrd", "render", scan, "--mode", "xray", "--zero", 0, "--size",
                    f"{SIDE}x{SIDE}", "--perspective", FIELD_OF_VIEW)
    others = []
    if peers.plastimatch():
        words = ["plastimatch", "drr", "-t", "pfm", "-i", "exact", "-P", "none", "--sad", distance, "--sid", distance,
                 "-n", "0 -1 0", "--vup", "0 0 1", "-o", "{} {} {}".format(*middle), "-r", f"{SIDE} {SIDE}",
                 "-z", "{0} {0}".format(2 * distance * slope), "-O", work / "drr_", scan]
        others.append(Side("plastimatch drr, exact", "PFM, f32", words, work / "drr_0000.pfm",
                           ["plastimatch", "--version"], 4, fitted=True))
    title = "X-ray of a CT {}x{}x{} from a point, DICOM -> {}x{} f32".format(*about["extent"], SIDE, SIDE)
    return Job(title, ours, others, inside_centre(SIDE // 2, SIDE * 3 // 4))


def measure(job, runs):
    """All sides in turns; the first round finds the files on the disk and does not count."""
    sides = [job.ours, *job.peers]
    for round_ in range(runs + 1):
        for side in sides:
            start, whole = first_sight(side.start), first_sight(side.words)
            if round_ > 0:
                side.start_seconds.append(start)
                side.seconds.append(whole)
    ours = pixels(job.ours.out)
    for peer in job.peers:
        peer.difference = difference(ours, pixels(peer.out), job.inside, peer.fitted)


def line(job, side):
    ratios = [theirs / ours for theirs, ours in zip(side.seconds, job.ours.seconds)]
    ratio, apart = "-", "-"
    if side is not job.ours:
        ratio = f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        apart = "{:.2g}, {:.3g}".format(*side.difference)
    return (f"| {job.title} | {side.name} | {statistics.median(side.seconds):.3f} | "
            f"{statistics.median(side.start_seconds):.3f} | {ratio} | {side.out.stat().st_size / 1e6:.2f} | {side.settings} | {apart} |")


def figures(job):
    return {"job": job.title, "sides": [
        {"name": side.name, "settings": side.settings, "command": [str(word) for word in side.words],
         "seconds": side.seconds, "start_seconds": side.start_seconds, "bytes": side.out.stat().st_size,
         "difference": side.difference and {"mean": side.difference[0], "largest": side.difference[1], "bound": side.bound}}
        for side in [job.ours, *job.peers]]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photo", type=pathlib.Path, default=os.environ.get("EDGEWISE_PHOTO"), help="JPEG; else $EDGEWISE_PHOTO")
    parser.add_argument("--ct", type=pathlib.Path, default=os.environ.get("EDGEWISE_CT"),
                        help="folder of a DICOM series, axial slices, HU; else $EDGEWISE_CT")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--only", default="png,jpeg,mip,xray,cone")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="edgewise-bench-") as folder:
        work = pathlib.Path(folder)
        peers = Peers(work)
        jobs = {"png": (given.photo, lambda: turned(given.photo, work, peers, "png")),
                "jpeg": (given.photo, lambda: turned(given.photo, work, peers, "jpg")),
                "mip": (given.ct, lambda: cast(given.ct, work, peers, "mip")),
                "xray": (given.ct, lambda: cast(given.ct, work, peers, "xray")),
                "cone": (given.ct, lambda: cone(given.ct, work, peers))}
        made = []
        for name in given.only.split(","):
            if jobs[name][0] is None:
                parser.error(f"{name} needs --photo or --ct")
            made.append(jobs[name][1]())
        print("\n| job | program | seconds | start | ratio (least to largest) | file [MB] | written as | "
              "difference: mean, largest [levels] |\n|---|---|---|---|---|---|---|---|", flush=True)
        wrong = []
        for job in made:
            measure(job, given.runs)
            print("\n".join(line(job, side) for side in [job.ours, *job.peers]), flush=True)
            wrong += [f"{job.title}: {peer.name}" for peer in job.peers if peer.difference[0] > peer.bound]
        if given.json:
            given.json.write_text(json.dumps({"runs": given.runs, "jobs": [figures(job) for job in made]}, indent=1) + "\n")
    if wrong:
        sys.exit("results differ: " + "; ".join(wrong))


if __name__ == "__main__":
    main()
