#!/usr/bin/python3
"""Speed of rendering beside VTK, one thread each, in turns, with the error of both against one f64 reference.

Rows: a maximum, a faint composite and a lit one of 256^3 samples of 8 bits; an opaque composite of the bundled CT head (rays end
early, air is left out); the same four by the path that the planner takes for an error of at most the peer's, where edgewise runs
with `--max-error` instead of `--via`; an isosurface, extracted and drawn by VTK, by the fastest of edgewise's paths; a composite of an almost
empty volume with what is empty left out, and not. In each round the peer and edgewise run one after the other; the table has
medians over the rounds, and the median of the ratios of each round.

Both draw the same rays: parallel, through centres of square pixels, one sample each smallest spacing, linear interpolation. The
reference takes 8 samples in its place, in f64 numpy, on every 8th row of pixels. It follows the rules of the side that it judges,
which differ in three points:
- In edgewise a volume reaches half a voxel beyond the outermost samples, in VTK it ends at these.
- edgewise mirrors light (R.V), VTK halves the angle between light and eye (N.H). Both have the same exponent here.
- VTK drops ambient light, unless a light has an ambient colour: the light here has one.
Surfaces: where both hit, light against casts with a step of a tenth.

VTK draws what its rays gave as a texture, which magnifies it by n / (n - 1). The error of the peer is that of what its window shows.
--rounds 0 times nothing, and prints the error of the rays as well.

Nothing switches skipping off. A transfer function that has an opacity of 1e-12 where the other has none forbids it, and gives the
same picture: that is the row "skipping off".

    EDGEWISE=build/release/bin/edgewise xvfb-run -a -s "-screen 0 1280x1024x24" benchmarks/render_speed.py [--side 256]
        [--rounds 3] [--only NAME,...] [--angio FILE] [--json FILE]

Needs numpy, scipy and VTK (script/setup --bench). FILE of --angio: any volume of 8 bits that is nearly empty, as an MR
angiography with its background removed; without it a few thin vessels take its place.
"""
import argparse
import ctypes
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import scipy.ndimage

EDGEWISE = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
HEAD = pathlib.Path(__file__).resolve().parents[1] / "data/ct_head/quarter.nhdr"
FINER, EVERY = 8, 8
AMBIENT, DIFFUSE, SPECULAR, POWER = 0.1, 0.7, 0.2, 10
LOOK = ["--light", "head", "--material", f"{AMBIENT},{DIFFUSE},{SPECULAR},{POWER}"]
WORK = pathlib.Path(tempfile.mkdtemp(prefix="edgewise-speed-"))
HOME = {**os.environ, "XDG_CACHE_HOME": str(WORK), "XDG_CONFIG_HOME": str(WORK)}  # no kept plans
# Value, opacity per smallest spacing, grey.
FAINT = [(0, 0, 0), (255, 0.05, 1)]
LIT = [(0, 0, 1), (90, 0, 1), (150, 0.2, 1), (255, 0.5, 1)]
OPAQUE = [(0, 0, 0), (500, 0, 0.7), (1100, 0.06, 0.7), (1250, 0.6, 1), (3000, 0.9, 1)]
KEPT = []  # windows: VTK's driver fails where one is closed before the next is opened


def turned(a, b, c):
    """EQ 37: about x, then y, then z [degree]."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.radians([a, b, c])), np.sin(np.radians([a, b, c]))
    return (np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]]) @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]]) @
            np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]))


class Scene:
    """Samples, their spacing, and a view: a turn and square pixels."""

    def __init__(self, name, samples, spacing, turn, size, pixel):
        self.name, self.samples, self.spacing, self.size, self.pixel = name, samples, np.array(spacing, "f8"), size, pixel
        self.turn, self.back = turn, turned(*turn).T  # screen -> object
        self.step = float(self.spacing.min())
        self.middle = (np.array(samples.shape[::-1]) - 1) / 2 * self.spacing
        self.file, self.references = WORK / f"{name}.nrrd", {}
        kind = {"u1": "uint8", "i2": "int16", "f4": "float"}[samples.dtype.str[1:]]
        self.file.write_bytes((f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {' '.join(map(str, samples.shape[::-1]))}\nspacings: "
                               f"{' '.join(map(str, self.spacing))}\nendian: little\nencoding: raw\n\n").encode() + samples.tobytes())

    # --- edgewise

    def edgewise(self, words, *more):
        command = [EDGEWISE, "render", self.file, "--rotate", ",".join(map(str, self.turn)), "--size", f"{self.size}x{self.size}", "--spacing",
                   self.pixel, "--reference", "linear", "--max-error", "9", *words, *more, "--threads", "1", "--json", "-", "--quiet"]
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=HOME)
        if done.returncode:
            sys.exit(f"{' '.join(map(str, command))}: exit {done.returncode}: {done.stderr}")
        return json.loads(done.stdout)

    def seconds(self, words, repeat=7):
        return float(np.median(self.edgewise(words, "-o", "null:", "--repeat", repeat)["measured"]["seconds"]))

    def picture(self, words):
        out = WORK / "picture.nrrd"
        self.edgewise(words, "-o", out)
        head, data = out.read_bytes().split(b"\n\n", 1)
        assert b"encoding: raw" in head
        return np.frombuffer(data, "<f4").reshape(self.size, self.size, -1)[..., 0].astype("f8")

    def transfer(self, points):
        file = pathlib.Path(tempfile.mkstemp(dir=WORK, suffix=".json")[1])
        file.write_text(json.dumps({"unit": self.step, "points": [{"value": v, "opacity": a, "color": [g] * 3} for v, a, g in points]}))
        return ["--mode", "composite", "--transfer", file]

    # --- VTK

    def vtk_image(self):
        import vtk
        from vtkmodules.util import numpy_support
        vtk.vtkMultiThreader.SetGlobalMaximumNumberOfThreads(1)
        vtk.vtkSMPTools.Initialize(1)
        image = vtk.vtkImageData()
        image.SetDimensions(*self.samples.shape[::-1])
        image.SetSpacing(*self.spacing)
        image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(np.ascontiguousarray(self.samples).ravel(), deep=1))
        return image

    def window_with(self, prop):
        """A window that looks at a prop along the rays of the scene. @return it and its camera"""
        import vtk
        renderer, window, light = vtk.vtkRenderer(), vtk.vtkRenderWindow(), vtk.vtkLight()
        renderer.AddViewProp(prop)
        light.SetLightTypeToHeadlight()
        light.SetAmbientColor(1, 1, 1)
        renderer.AddLight(light)
        window.SetOffScreenRendering(1)
        window.SetSize(self.size, self.size)
        window.SetMultiSamples(0)
        window.SetDesiredUpdateRate(1e-4)
        window.AddRenderer(renderer)
        camera = renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*self.middle)
        camera.SetPosition(*(self.middle - 1000 * self.back[:, 2]))
        camera.SetViewUp(*(-self.back[:, 1]))
        camera.SetParallelScale(self.size * self.pixel / 2)
        renderer.ResetCameraClippingRange()
        window.Render()
        KEPT.append((window, renderer, prop))
        return window, camera

    def vtk_volume(self, points, lit=False, window=((0, 1, 0), (255, 1, 1)), finer=1):
        """@param points  None: the largest value, from black to white in the window
        @param finer  samples each smallest spacing"""
        import vtk
        mapper, volume, look = vtk.vtkFixedPointVolumeRayCastMapper(), vtk.vtkVolume(), vtk.vtkVolumeProperty()
        mapper.SetInputData(self.vtk_image())
        mapper.SetNumberOfThreads(1)
        mapper.SetAutoAdjustSampleDistances(0)
        mapper.SetImageSampleDistance(1)
        mapper.SetSampleDistance(self.step / finer)
        mapper.SetInteractiveSampleDistance(self.step / finer)
        (mapper.SetBlendModeToComposite if points else mapper.SetBlendModeToMaximumIntensity)()
        opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
        for value, share, grey in points or window:
            opacity.AddPoint(value, share)
            colour.AddRGBPoint(value, grey, grey, grey)
        look.SetScalarOpacity(opacity)
        look.SetScalarOpacityUnitDistance(self.step)
        look.SetColor(colour)
        look.SetInterpolationTypeToLinear()
        (look.ShadeOn if lit else look.ShadeOff)()
        materials(look)
        volume.SetMapper(mapper)
        volume.SetProperty(look)
        return self.window_with(volume)

    def vtk_surface(self, level):
        import vtk
        flying, mapper, actor = vtk.vtkFlyingEdges3D(), vtk.vtkPolyDataMapper(), vtk.vtkActor()
        flying.SetInputData(self.vtk_image())
        flying.ComputeNormalsOn()
        flying.SetValue(0, level)
        mapper.SetInputConnection(flying.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor.SetMapper(mapper)
        materials(actor.GetProperty())
        actor.GetProperty().SetInterpolationToPhong()
        return flying, *self.window_with(actor)

    def pixels(self, window):
        import vtk
        from vtkmodules.util import numpy_support
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        grab.Update()
        data = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        return data.reshape(self.size, self.size, -1)[::-1, :, 0].astype("f8")

    def cast_pixels(self):
        """What the rays of the volume mapper that ran last gave, before VTK draws it as a texture."""
        image = KEPT[-1][2].GetMapper().GetRayCastImage()
        width, height = image.GetImageMemorySize()
        address = int(image.GetImage().split("_")[1], 16)  # "_ADDRESS_p_void"
        memory = np.ctypeslib.as_array((ctypes.c_uint16 * (4 * width * height)).from_address(address)).reshape(height, width, 4)
        (x, y), (wide, high) = image.GetImageOrigin(), image.GetImageInUseSize()
        picture = np.zeros((self.size, self.size))
        picture[y:y + high, x:x + wide] = memory[:high, :wide, 0] * (255 / 32767)  # 15 bits
        return picture[::-1]

    # --- the reference

    def exact(self, points, lit=False, of_vtk=False):
        """Every EVERY-th row of pixels; light from 0 to 1, or the largest value. Made once: rows share it."""
        key = (str(points), lit, of_vtk)
        if key not in self.references:
            self.references[key] = self.made_exact(points, lit, of_vtk)
        return self.references[key]

    def made_exact(self, points, lit, of_vtk):
        at = (np.arange(self.size) - (self.size - 1) / 2) * self.pixel
        rows = at[::EVERY]
        start = self.middle + rows[:, None, None] * self.back[:, 1] + at[None, :, None] * self.back[:, 0]
        held, top = self.samples.astype("f4"), np.array(self.samples.shape[::-1]) - 1
        margin = 1e-9 if of_vtk else 0.5
        reach = np.linalg.norm((top + 1) * self.spacing) / 2 + self.step
        offsets = np.arange(-reach, reach, self.step / FINER)
        result, left = np.zeros(start.shape[:2]), np.ones(start.shape[:2])
        if points is None:
            result -= np.inf

        def field(index):
            return scipy.ndimage.map_coordinates(held, index.reshape(-1, 3).T[::-1], order=1, mode="nearest",
                                                 output="f8").reshape(index.shape[:-1])

        for offset in offsets:
            index = (start + offset * self.back[:, 2]) / self.spacing
            inside = ((index >= -margin) & (index <= top + margin)).all(-1)
            if not inside.any():
                continue
            index = np.clip(index, 0, top)[inside]
            value = field(index)
            if points is None:
                result[inside] = np.maximum(result[inside], value)
                continue
            values, shares, greys = np.array(points, "f8").T
            opacity = 1 - (1 - np.interp(value, values, shares)) ** (1 / FINER)
            light = np.interp(value, values, greys)
            if lit and opacity.any():
                gradient = np.stack([field(np.clip(index + side, 0, top)) - field(np.clip(index - side, 0, top)) for side in np.eye(3)], -1)
                gradient /= self.spacing
                length = np.linalg.norm(gradient, axis=-1)
                facing = np.abs(gradient @ self.back[:, 2]) / np.maximum(length, 1e-9)
                mirrored = facing if of_vtk else np.maximum(0, 2 * facing ** 2 - 1)
                light = light * (AMBIENT + DIFFUSE * facing) + SPECULAR * mirrored ** POWER * (length > 0)
            result[inside] += left[inside] * opacity * light
            left[inside] *= 1 - opacity
        result[~np.isfinite(result)] = 0
        return result


def materials(look):
    look.SetAmbient(AMBIENT)
    look.SetDiffuse(DIFFUSE)
    look.SetSpecular(SPECULAR)
    look.SetSpecularPower(POWER)


def nrmse(picture, reference):
    return float(np.sqrt(np.mean((picture - reference) ** 2)) / np.ptp(reference))


def timed(call, count):
    call()
    times = []
    for _ in range(count):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def ball(side):
    """A ball with a grating inside: smooth, of full 8-bit range."""
    z, y, x = (np.mgrid[0:side, 0:side, 0:side] / side - 0.5).astype("f4")
    r = np.sqrt(x * x + y * y + z * z)
    return (np.clip(0.48 - r, 0, 0.5) * 420 * (1 + 0.3 * np.sin(45 * x) * np.sin(45 * y) * np.sin(45 * z))).clip(0, 255).astype("u1")


def vessels(side):
    """Less than a hundredth is not zero."""
    random, samples = np.random.default_rng(7), np.zeros((side,) * 3, "f4")
    for _ in range(6):
        at, way = random.uniform(0.2, 0.8, 3) * side, random.normal(size=3)
        for _ in range(side):
            way = way + 0.3 * random.normal(size=3)
            at = np.clip(at + way / np.linalg.norm(way), 2, side - 3)
            samples[tuple(at.astype(int))] = 1
    smooth = scipy.ndimage.gaussian_filter(samples, 0.9)
    return np.where(smooth > 0.02, np.uint8(255 * np.minimum(1, 4 * smooth)), 0).astype("u1")


def read_with_edgewise(file, type_):
    """The stored samples of any file that edgewise reads, and their spacing."""
    out = WORK / "read.nrrd"
    info = json.loads(subprocess.run([EDGEWISE, "info", file, "--json", "-"], capture_output=True, text=True, check=True).stdout)
    subprocess.run([EDGEWISE, "warp", file, "-o", out, "--quiet"], check=True)
    return np.frombuffer(out.read_bytes().split(b"\n\n", 1)[1], type_).reshape(info["extent"][::-1]), info["spacing"]


CAST = ["--via", "project.ray_cast/filter=foh/step=1"]


class Volume:
    """A row: vtkFixedPointVolumeRayCastMapper against a cast by edgewise, or against what the planner takes for the peer's error."""
    peer_name = "vtkFixedPointVolumeRayCastMapper"

    def __init__(self, what, scene, points, goal, lit=False, planned=False):
        self.what, self.scene, self.points, self.lit, self.goal, self.planned = what, scene, points, lit, goal, planned
        self.words = (scene.transfer(points) if points else ["--mode", "mip"]) + (["--shade", "phong", *LOOK] if lit else [])
        self.words += [] if planned else CAST

    def prepare(self):
        self.window, self.camera = self.scene.vtk_volume(self.points, self.lit)
        scale = 1 / 255 if self.points else 1
        exact = self.scene.exact(self.points, self.lit, of_vtk=True)
        self.peer_error = nrmse(self.scene.pixels(self.window)[::EVERY] * scale, exact)
        self.peer_rays_error = nrmse(self.scene.cast_pixels()[::EVERY] * scale, exact)
        if self.planned:
            self.words += ["--max-error", self.peer_error]
            steps = self.scene.edgewise(self.words, "-o", "null:")["plan"]["steps"]
            self.what += " by " + " > ".join(step["transition"] + "".join(f"/{key}={value:g}" if isinstance(value, float) else f"/{key}={value}" for key, value in step["parameters"].items())
                                             for step in steps)
        self.error = nrmse(self.scene.picture(self.words)[::EVERY], self.scene.exact(self.points, self.lit))

    def peer(self):
        def again():
            self.camera.Azimuth(0.01)
            self.window.Render()
        return timed(again, 5)

    def ours(self):
        return self.scene.seconds(self.words)


class Surface:
    peer_name = "vtkFlyingEdges3D, normals, drawn by Mesa"

    def __init__(self, what, scene, level, goal, path):
        self.what, self.scene, self.level, self.goal, self.words = what, scene, level, goal, ["--mode", "surface", "--isovalue", level, *path]

    def prepare(self):
        self.flying, self.window, _ = self.scene.vtk_surface(self.level)
        fine = self.scene.picture(["--mode", "surface", "--isovalue", self.level, "--via", "project.ray_cast/filter=foh/step=0.1"])
        errors = []
        for picture in (self.scene.pixels(self.window) / 255, self.scene.picture(self.words)):
            both = (picture > 0) & (fine > 0)
            errors.append(float(np.sqrt(np.mean((picture - fine)[both] ** 2))))
        self.peer_error, self.error = errors

    def peer(self):
        def again():
            self.flying.Modified()
            self.window.Render()
        return timed(again, 3)

    def ours(self):
        return self.scene.seconds(self.words)


class Skipping:
    """The same picture with what is clear left out, and not."""
    peer_name = "edgewise, skipping off"

    def __init__(self, what, scene, goal, path):
        self.what, self.scene, self.goal = what, scene, goal
        low = 0.15 * float(scene.samples.max())
        points = [(0, 0, 1), (low, 0, 1), (3 * low, 0.4, 1)]
        seen = [(value, max(share, 1e-12), grey) for value, share, grey in points]
        self.words, self.off = scene.transfer(points) + path, scene.transfer(seen) + CAST + ["--without", "store.crop"]
        self.points, self.cast = points, path == CAST

    def prepare(self):
        exact = self.scene.exact(self.points)
        if not self.cast:  # as accurate as the cast
            same = self.scene.edgewise(self.off, "-o", "null:", "--verify=8192")["measured"]["error"]["nrmse"]
            self.words = [*self.words, "--max-error", 1.05 * same]
        off, on = self.scene.picture(self.off), self.scene.picture(self.words)
        if self.cast and np.abs(on - off).max() > 1e-5:
            sys.exit("skipping changes the picture")
        self.peer_error, self.error = nrmse(off[::EVERY], exact), nrmse(on[::EVERY], exact)

    def peer(self):
        return self.scene.seconds(self.off)

    def ours(self):
        return self.scene.seconds(self.words)


def of_rays(row):
    return f"{row.peer_rays_error:.2g}" if hasattr(row, "peer_rays_error") else ""


def rows(side, angio):
    cube = Scene("ball", ball(side), (1, 1, 1), (20, 30, 0), side, 1)
    head = Scene("head", *read_with_edgewise(HEAD, "<i2"), (90, 30, 180), max(16, 2 * side), 0.5 * 256 / side)
    if angio:
        thin = Scene("angio", *read_with_edgewise(angio, "u1"), (20, 30, 0), side, 0.0)
        thin.pixel = round(1.2 * max(thin.samples.shape) * thin.step / side, 6)
    else:
        thin = Scene("vessels", vessels(side), (1, 1, 1), (20, 30, 0), side, 1.2)
    size, shape = f"u8 {side}^3 -> {side}^2", "x".join(map(str, thin.samples.shape[::-1]))
    volumes = {
        "mip": (f"MIP {size}", cube, None, 10, False),
        "composite": (f"composite {size}", cube, FAINT, 10, False),
        "shaded": (f"shaded composite {size}", cube, LIT, 10, True),
        "opaque": (f"opaque composite, CT head -> {head.size}^2", head, OPAQUE, 6, False)}
    return {
        **{name: Volume(*row) for name, row in volumes.items()},
        **{f"{name}_any": Volume(*row, planned=True) for name, row in volumes.items()},
        "surface": Surface(f"isosurface picture {size}, cast", cube, 60.5, 3, CAST),
        "surface_mesh": Surface(f"isosurface picture {size}, mesh drawn", cube, 60.5, 3, ["--via", "surface.flying_edges"]),
        "angio": Skipping(f"composite of {thin.name} {shape}, cast", thin, 10, CAST),
        "angio_any": Skipping(f"composite of {thin.name} {shape}, the planner's path", thin, 10, [])}


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--side", type=int, default=256)
    arguments.add_argument("--rounds", type=int, default=3)
    arguments.add_argument("--only", default="")
    arguments.add_argument("--angio")
    arguments.add_argument("--json")
    options = arguments.parse_args()
    if options.rounds:
        print("| job | peer | peer [ms] | edgewise [ms] | ratio | ratios of the rounds | goal | error of the peer | of its rays | error of edgewise |")
        print("|---|---|---:|---:|---:|---|---:|---:|---:|---:|")
    table = []
    for name, row in rows(options.side, options.angio).items():
        if options.only and name not in options.only.split(","):
            continue
        row.prepare()
        if not options.rounds:
            print(f"{row.what}: error of the peer as drawn {row.peer_error:.2g}, of its rays {getattr(row, 'peer_rays_error', np.nan):.2g}, "
                  f"of edgewise {row.error:.2g}", flush=True)
            continue
        pairs = [(row.peer(), row.ours()) for _ in range(options.rounds)]
        ratios = [peer / ours for peer, ours in pairs]
        peer, ours = np.median(pairs, axis=0)
        print(f"| {row.what} | {row.peer_name} | {peer * 1e3:.1f} | {ours * 1e3:.1f} | {np.median(ratios):.1f} | "
              f"{min(ratios):.1f} to {max(ratios):.1f} | {row.goal} | {row.peer_error:.2g} | {of_rays(row)} | {row.error:.2g} |", flush=True)
        table.append({"row": name, "job": row.what, "peer": row.peer_name, "seconds": pairs, "ratio": float(np.median(ratios)), "goal": row.goal,
                      "peer_error": row.peer_error, "error": row.error})
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps({"side": options.side, "rounds": options.rounds, "rows": table}, indent=2))


if __name__ == "__main__":
    main()
