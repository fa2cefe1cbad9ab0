#!/usr/bin/python3
"""edgewise against what a user would pick instead, one thread each, in one program run.

Every round times the peer and edgewise one after the other; the ratio is taken round by round and its median is
reported, so that a drifting machine hurts both alike. Accuracy is measured in the same run against f64 references
that share no code with either side. Usage: EDGEWISE=build/release/bin/edgewise xvfb-run -a benchmarks/side_by_side.py [JOB ...]
"""
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
ROUNDS = int(os.environ.get("EDGEWISE_ROUNDS", 5))
SIDE = 256
WORK = pathlib.Path(tempfile.mkdtemp(prefix="edgewise-bench-"))
os.environ["OMP_NUM_THREADS"] = "1"


def edgewise(*arguments):
    """Runs the command and returns its report."""
    done = subprocess.run([EDGEWISE, *map(str, arguments), "--threads", "1", "--json", "-", "--quiet"],
                          capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"edgewise {' '.join(map(str, arguments))}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def seconds_of(*arguments, repeat=7):
    return float(np.median(edgewise(*arguments, "--repeat", repeat)["measured"]["seconds"]))


def median_time(call, count):
    call()
    times = []
    for _ in range(count):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def write_nrrd(path, samples):
    names = {"uint8": "uint8", "float32": "float"}
    sizes = " ".join(map(str, samples.shape[::-1]))
    spacings = " ".join("1" for _ in samples.shape)
    header = (f"NRRD0004\ntype: {names[samples.dtype.name]}\ndimension: {samples.ndim}\nsizes: {sizes}\n"
              f"spacings: {spacings}\nendian: little\nencoding: raw\n\n")
    pathlib.Path(path).write_bytes(header.encode() + samples.tobytes())


def read_nrrd(path):
    header, data = pathlib.Path(path).read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in header.decode().splitlines() if ": " in line)
    types = {"float": "<f4", "uint8": "u1", "unsigned char": "u1"}
    if fields["encoding"] in ("gzip", "gz"):
        import zlib
        data = zlib.decompress(data, 47)
    shape = [int(n) for n in fields["sizes"].split()][::-1]
    return np.frombuffer(data, types[fields["type"]], int(np.prod(shape))).reshape(shape)


def rotation(x, y, z):
    """EQ 37: Rz Ry Rx, degrees."""
    x, y, z = np.radians([x, y, z])
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    return (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


def sample_linear(samples, matrix, inside_by=1):
    """f64 linear interpolation at the inverse of a rotation about the centre, and where it is well inside."""
    shape = np.array(samples.shape)[::-1]
    centre = (shape - 1) / 2
    at = np.indices(samples.shape)[::-1].reshape(len(shape), -1) - centre[:, None]
    at = matrix.T @ at + centre[:, None]
    inside = ((at >= inside_by) & (at <= (shape - 1 - inside_by)[:, None])).all(0).reshape(samples.shape)
    values = scipy.ndimage.map_coordinates(samples.astype("f8"), at[::-1], order=1, mode="nearest")
    return values.reshape(samples.shape), inside


def largest(output, reference, inside, span):
    return float(np.abs(output.astype("f8") - reference)[inside].max() / span)


def volume():
    """A ball with a grating inside: smooth, of full 8-bit range."""
    z, y, x = (np.mgrid[0:SIDE, 0:SIDE, 0:SIDE] / SIDE - 0.5).astype("f4")
    r = np.sqrt(x * x + y * y + z * z)
    grating = 1 + 0.3 * np.sin(45 * x) * np.sin(45 * y) * np.sin(45 * z)
    return (np.clip(0.48 - r, 0, 0.5) * 420 * grating).clip(0, 255).astype("u1")


def pair(peer, ours):
    """Median seconds of both and the median of the ratios, interleaved."""
    rows = []
    for _ in range(ROUNDS):
        theirs = peer()
        rows.append((theirs, ours()))
    rows = np.array(rows)
    return np.median(rows[:, 0]), np.median(rows[:, 1]), np.median(rows[:, 0] / rows[:, 1])


def warp_2d():
    import cv2
    cv2.setNumThreads(1)
    image = (np.random.default_rng(1).random((2048, 2048)) * 255).astype("f4")
    write_nrrd(WORK / "image.nrrd", image)
    turn = cv2.getRotationMatrix2D((1023.5, 1023.5), -30, 1)
    arguments = ["warp", WORK / "image.nrrd", "-o", WORK / "turned.nrrd", "--rotate", "30", "--via",
                 "warp.backward/filter=foh", "--max-error", "1"]
    times = pair(lambda: median_time(lambda: cv2.warpAffine(image, turn, (2048, 2048), flags=cv2.INTER_LINEAR), 7),
                 lambda: seconds_of(*arguments))
    angle = np.radians(30)
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    exact, inside = sample_linear(image, matrix)
    theirs = cv2.warpAffine(image, turn, (2048, 2048), flags=cv2.INTER_LINEAR)
    return ("2D f32 2048x2048, 30 degrees, linear", "OpenCV warpAffine", 4, times,
            largest(theirs, exact, inside, 255), largest(read_nrrd(WORK / "turned.nrrd"), exact, inside, 255))


def vtk_image(samples):
    import vtk
    from vtkmodules.util import numpy_support
    vtk.vtkMultiThreader.SetGlobalMaximumNumberOfThreads(1)
    vtk.vtkSMPTools.Initialize(1)
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(samples.ravel(), deep=1))
    return image


def warp_3d():
    import vtk
    from vtkmodules.util import numpy_support
    samples = volume()
    write_nrrd(WORK / "volume.nrrd", samples)
    reslice, turn, centre = vtk.vtkImageReslice(), vtk.vtkTransform(), (SIDE - 1) / 2
    matrix = rotation(30, 30, 30)
    homogeneous = np.eye(4)
    homogeneous[:3, :3] = matrix.T  # reslicing asks where an output sample comes from
    turn.Translate(centre, centre, centre)
    turn.Concatenate(homogeneous.ravel().tolist())
    turn.Translate(-centre, -centre, -centre)
    reslice.SetInputData(vtk_image(samples))
    reslice.SetResliceTransform(turn)
    reslice.SetInterpolationModeToLinear()
    reslice.SetOutputExtent(0, SIDE - 1, 0, SIDE - 1, 0, SIDE - 1)
    reslice.SetOutputSpacing(1, 1, 1)
    reslice.SetOutputOrigin(0, 0, 0)
    reslice.SetNumberOfThreads(1)
    arguments = ["warp", WORK / "volume.nrrd", "-o", WORK / "turned3.nrrd", "--rotate", "30,30,30", "--via",
                 "warp.backward/filter=foh", "--max-error", "1"]
    times = pair(lambda: median_time(lambda: (reslice.Modified(), reslice.Update()), 3),
                 lambda: seconds_of(*arguments))
    exact, inside = sample_linear(samples, matrix)
    theirs = numpy_support.vtk_to_numpy(reslice.GetOutput().GetPointData().GetScalars()).reshape(samples.shape)
    return ("3D u8 256^3, 30,30,30 degrees, linear", "vtkImageReslice", 5, times,
            largest(theirs, exact, inside, 255), largest(read_nrrd(WORK / "turned3.nrrd"), exact, inside, 255))


# Value, opacity per voxel, grey.
RAMPS = {"composite": [(0, 0, 0), (255, 0.05, 1)], "shaded": [(0, 0, 1), (90, 0, 1), (150, 0.2, 1), (255, 0.5, 1)]}


def vtk_view(samples, mode):
    """A window of SIDE^2 pixels of one voxel each, rays one voxel a step, and its camera."""
    import vtk
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(vtk_image(samples))
    mapper.SetNumberOfThreads(1)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(1)
    mapper.SetInteractiveSampleDistance(1)
    (mapper.SetBlendModeToMaximumIntensity if mode == "mip" else mapper.SetBlendModeToComposite)()
    opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    for value, share, grey in RAMPS.get(mode, [(0, 1, 0), (255, 1, 1)]):
        opacity.AddPoint(value, share)
        colour.AddRGBPoint(value, grey, grey, grey)
    look = vtk.vtkVolumeProperty()
    look.SetScalarOpacity(opacity)
    look.SetColor(colour)
    look.SetInterpolationTypeToLinear()
    (look.ShadeOn if mode == "shaded" else look.ShadeOff)()
    actor = vtk.vtkVolume()
    actor.SetMapper(mapper)
    actor.SetProperty(look)
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.AddVolume(actor)
    window.SetOffScreenRendering(1)
    window.SetSize(SIDE, SIDE)
    window.AddRenderer(renderer)
    window.SetDesiredUpdateRate(1e-4)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    renderer.ResetCamera()
    camera.Azimuth(30)
    camera.Elevation(20)
    camera.SetParallelScale(SIDE / 2)
    renderer.ResetCameraClippingRange()
    window.Render()
    return window, camera, renderer


def vtk_pixels(window):
    import vtk
    from vtkmodules.util import numpy_support
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    pixels = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    return pixels.reshape(SIDE, SIDE, -1)[:, :, 0].astype("f8")


def exact_view(samples, camera, mode):
    """What VTK's conventions ask for along each of the camera's rays, eight trilinear samples a voxel, f64: the largest
    value; or emission and opacity front to back, times 255 as its pixels are. Shaded: trilinear central differences
    under a light at the eye, ambient 0.1, diffuse 0.7, specular 0.2, power 10."""
    focal = np.array(camera.GetFocalPoint())
    along = np.array(camera.GetDirectionOfProjection())
    right = np.cross(along, camera.GetViewUp())
    right /= np.linalg.norm(right)
    up = np.cross(right, along)
    steps = (np.arange(SIDE) - (SIDE - 1) / 2) * (2 * camera.GetParallelScale() / SIDE)
    rows = np.arange(0, SIDE, 8)
    start = focal + steps[rows][:, None, None] * up + steps[None, :, None] * right
    result, left = np.zeros(start.shape[:2]), np.ones(start.shape[:2])
    held = samples.astype("f4")

    def field(points):
        read = scipy.ndimage.map_coordinates(held, points.reshape(-1, 3).T[::-1], order=1, mode="constant", output="f8")
        return read.reshape(points.shape[:-1])

    def lit(points):
        gradient = np.stack([field(points + step) - field(points - step) for step in np.eye(3)], axis=-1) / 2
        length = np.linalg.norm(gradient, axis=-1)
        facing = np.abs(gradient @ along) / np.maximum(length, 1e-9)
        return 0.1 + 0.7 * facing, 0.2 * np.maximum(0, 2 * facing**2 - 1) ** 10 * (length > 0)

    for t in np.arange(-0.9 * SIDE, 0.9 * SIDE, 1 / 8):
        points = start + t * along
        value = field(points)
        if mode == "mip":
            np.maximum(result, value, out=result)
            continue
        values, shares, greys = np.array(RAMPS[mode], "f8").T
        opacity = 1 - (1 - np.interp(value, values, shares)) ** (1 / 8)
        light = 255 * np.interp(value, values, greys)
        if mode == "shaded" and opacity.any():
            diffuse, mirrored = lit(points)
            light = diffuse * light + 255 * mirrored
        result += left * opacity * light
        left *= 1 - opacity
    return rows, result


def cast(mode):
    samples = volume()
    write_nrrd(WORK / "volume.nrrd", samples)
    window, camera, _ = vtk_view(samples, mode)
    rows, exact = exact_view(samples, camera, mode)
    theirs = float(np.sqrt(np.mean((vtk_pixels(window)[rows] - exact) ** 2)) / np.ptp(exact))

    def turn():
        camera.Azimuth(0.01)
        window.Render()

    (WORK / "transfer.json").write_text(json.dumps({"points": [
        {"value": value, "opacity": share, "color": [grey] * 3}
        for value, share, grey in RAMPS.get(mode, RAMPS["composite"])]}))
    arguments = ["render", WORK / "volume.nrrd", "-o", WORK / "picture.png", "--mode",
                 "composite" if mode == "shaded" else mode, "--rotate", "20,30,0",
                 "--size", "256x256", "--spacing", 1, "--via", "project.ray_cast/filter=foh/step=1", "--max-error", "1",
                 "--reference", "linear"]
    if mode != "mip":
        arguments += ["--transfer", WORK / "transfer.json"]
    if mode == "shaded":
        arguments += ["--shade", "phong", "--light", "head", "--material", "0.1,0.7,0.2,10"]
    times = pair(lambda: median_time(turn, 5), lambda: seconds_of(*arguments))
    ours = edgewise(*arguments, "--verify")["measured"]["error"]["nrmse"]
    goal = 10 if mode == "shaded" else 5
    return (f"{mode} u8 256^3 -> 256^2, linear, step 1", "vtkFixedPointVolumeRayCastMapper", goal, times, theirs, ours)


def surface():
    """A first hit against a surface that VTK extracts, gives normals, and draws: the picture of one new isovalue. Errors
    are those of the light where both hit, against f64 rays with bisection."""
    import vtk
    samples, level = volume(), 60
    write_nrrd(WORK / "volume.nrrd", samples)
    flying = vtk.vtkFlyingEdges3D()
    flying.SetInputData(vtk_image(samples))
    flying.ComputeNormalsOn()
    flying.SetValue(0, level)
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputConnection(flying.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    for set_share, share in (("Ambient", 0.1), ("Diffuse", 0.7), ("Specular", 0.2), ("SpecularPower", 10)):
        getattr(actor.GetProperty(), "Set" + set_share)(share)
    actor.GetProperty().SetInterpolationToPhong()
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.AddActor(actor)
    window.SetOffScreenRendering(1)
    window.SetSize(SIDE, SIDE)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    back = rotation(20, 30, 0)[:3, :3].T  # screen -> object
    middle = np.full(3, (SIDE - 1) / 2)
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(middle - 1000 * back[:, 2]))
    camera.SetViewUp(*(-back[:, 1]))
    camera.SetParallelScale(SIDE / 2)
    renderer.ResetCameraClippingRange()
    window.Render()

    def again():
        flying.Modified()
        window.Render()

    request = ["render", WORK / "volume.nrrd", "-o", WORK / "picture.nrrd", "--mode", "surface", "--isovalue", level, "--rotate",
               "20,30,0", "--size", "256x256", "--spacing", 1, "--via", "project.ray_cast/filter=foh/step=1", "--max-error", "1",
               "--reference", "linear"]
    times = pair(lambda: median_time(again, 3), lambda: seconds_of(*request))
    ours = edgewise(*request, "--verify")["measured"]["error"]["nrmse"]
    drawn = vtk_pixels(window) / 255
    fine = [*request[:3], WORK / "fine.nrrd", *request[4:14], "--via", "project.ray_cast/filter=foh/step=0.1", "--max-error", "1",
            "--reference", "linear"]
    edgewise(*fine)
    exact = read_nrrd(WORK / "fine.nrrd")[..., 0].astype("f8")
    both = (drawn[::-1] > 0) & (exact > 0)
    peer = np.sqrt(np.mean((drawn[::-1] - exact)[both] ** 2))
    return ("surface u8 256^3 -> 256^2, extracted and drawn", "vtkFlyingEdges3D, normals, drawn by Mesa", 3, times, float(peer), ours)


def shear_warp(hold, goal):
    write_nrrd(WORK / "volume.nrrd", volume())
    request = ["render", WORK / "volume.nrrd", "-o", WORK / "picture.png", "--rotate", "20,30,0", "--size", "256x256",
               "--spacing", 1, "--max-error", "1"]
    cast_it = request + ["--via", "project.ray_cast/filter=foh/step=1"]
    shear_it = request + ["--via", f"project.shear_warp/filter={hold}"]
    times = pair(lambda: seconds_of(*cast_it), lambda: seconds_of(*shear_it))
    errors = [edgewise(*r, "--verify")["measured"]["error"]["nrmse"] for r in (cast_it, shear_it)]
    return (f"mip u8 256^3 -> 256^2, shear-warp, {hold}", "own ray cast, foh, step 1", goal, times, *errors)


def ball_error(picture, source=None, detector=None):
    """NRMSE of a view of the ball against its formula, the chord of each ray; scale and offset, which turn chords into
    the units of a picture, are fitted. With a source the rays diverge: distances of the centre and the detector."""
    across = np.arange(SIDE) - (SIDE - 1) / 2
    square = across[:, None] ** 2 + across[None] ** 2
    if source:
        square = source**2 * square / (detector**2 + square)
    chord = 2 * np.sqrt(np.maximum(0, 100.0**2 - square)).ravel()
    columns = np.stack([chord, np.ones_like(chord)], axis=1)
    picture = np.asarray(picture, "f8").ravel()
    fitted = columns @ np.linalg.lstsq(columns, picture, rcond=None)[0]
    return float(np.sqrt(np.mean((picture - fitted) ** 2)) / np.ptp(fitted))


def xray():
    ball = WORK / "ball.mha"
    subprocess.run(["plastimatch", "synth", "--pattern", "sphere", "--output", ball, "--dim", "256 256 256", "--spacing",
                    "1 1 1", "--origin", "-127.5 -127.5 -127.5", "--radius", "100 100 100", "--foreground", "1000",
                    "--background", "0"], check=True, capture_output=True)

    def drr():
        done = subprocess.run(["plastimatch", "drr", "-t", "raw", "-N", "10", "-a", "8", "-i", "uniform", "--sad", "10000",
                               "--sid", "10100", "-r", "256 256", "-z", "256 256", "-O", str(WORK / "drr_"), ball],
                              check=True, capture_output=True, text=True).stdout
        return float(next(line for line in done.splitlines() if line.startswith("Total time")).split()[2]) / 8

    def request(views):
        return ["render", ball, "-o", WORK / "xray_%03d.nrrd", "--mode", "xray", "--turntable", views, "--size", "256x256",
                "--spacing", 1, "--max-error", ".02", "--via", "spectrum.forward/width=6", "--via", "spectrum.slice"]

    times = pair(drr, lambda: (seconds_of(*request(40), repeat=3) - seconds_of(*request(8), repeat=3)) / 32)
    theirs = np.fromfile(WORK / "drr_0000.raw", "f4")
    return ("X-ray 256^2 of 256^3, spectrum in memory", "plastimatch drr, uniform", 5, times,
            ball_error(theirs, 10000, 10100), ball_error(read_nrrd(WORK / "xray_000.nrrd")))


def drr():
    """The bundled chest from a point, 512 x 512. plastimatch sums voxels, edgewise the linear field between them: the error of the
    peer is how far its integrals are from edgewise's, after a fitted scale, and holds that difference as well."""
    scan, size, field = pathlib.Path(__file__).parent.parent / "data/ct_chest/chest.nrrd", 512, 20
    about = json.loads(subprocess.run([EDGEWISE, "info", scan, "--json", "-"], capture_output=True, text=True, check=True).stdout)
    half = [n * s / 2 for n, s in zip(about["extent"], about["spacing"])]
    middle = [o + h - s / 2 for o, h, s in zip(about["origin"], half, about["spacing"])]
    slope = np.tan(np.radians(field / 2))
    distance = max(half[0], half[2]) / slope + half[1]

    def theirs():
        start = time.perf_counter()
        subprocess.run(["plastimatch", "drr", "-t", "raw", "-i", "exact", "-P", "preprocess", "--sad", str(distance), "--sid", str(distance),
                        "-n", "0 -1 0", "--vup", "0 0 1", "-o", "{} {} {}".format(*middle), "-r", f"{size} {size}",
                        "-z", "{0} {0}".format(2 * distance * slope), "-O", WORK / "chest_", scan], check=True, capture_output=True)
        return time.perf_counter() - start

    def loading():
        """All of plastimatch but the rays: a picture of 1 x 1."""
        start = time.perf_counter()
        subprocess.run(["plastimatch", "drr", "-t", "raw", "-i", "exact", "-P", "preprocess", "--sad", str(distance), "--sid", str(distance),
                        "-n", "0 -1 0", "--vup", "0 0 1", "-o", "{} {} {}".format(*middle), "-r", "2 2", "-z", "1 1", "-O", WORK / "one_", scan],
                       check=True, capture_output=True)
        return time.perf_counter() - start

    request = ["render", scan, "-o", WORK / "chest.nrrd", "--mode", "drr", "--perspective", field, "--size", f"{size}x{size}", "--max-error", "0.01"]
    idle = float(np.median([loading() for _ in range(ROUNDS)]))
    times = pair(lambda: theirs() - idle, lambda: seconds_of(*request))
    ours = -np.log(read_nrrd(WORK / "chest.nrrd").astype("f8")).ravel()
    peer = np.fromfile(WORK / "chest_0000.raw", "f4").astype("f8")
    columns = np.stack([peer, np.ones_like(peer)], axis=1)
    apart = columns @ np.linalg.lstsq(columns, ours, rcond=None)[0] - ours
    return ("DRR of the chest CT, 512^2, from a point", "plastimatch drr, exact", 8, times, float(np.sqrt(np.mean(apart**2)) / np.ptp(ours)),
            edgewise(*request, "--verify")["measured"]["error"]["nrmse"])


JOBS = {"warp2d": warp_2d, "warp3d": warp_3d, "mip": lambda: cast("mip"),
        "composite": lambda: cast("composite"), "shaded": lambda: cast("shaded"), "surface": surface, "shear_warp": lambda: shear_warp("zoh", 3),
        "shear_warp_foh": lambda: shear_warp("foh", 3), "xray": xray, "drr": drr}


def main():
    print("| job | peer | peer [ms] | edgewise [ms] | ratio | goal | error of the peer | error of edgewise |")
    print("|---|---|---|---|---|---|---|---|")
    short = []
    for name in sys.argv[1:] or JOBS:
        job, peer, goal, (theirs, ours, ratio), peer_error, our_error = JOBS[name]()
        print(f"| {job} | {peer} | {theirs * 1e3:.1f} | {ours * 1e3:.1f} | {ratio:.1f} | {goal or '-'} | {peer_error:.2g} | "
              f"{our_error:.2g} |", flush=True)
        if goal and ratio < goal:
            short.append(name)
    if short:
        sys.exit("below the goal: " + ", ".join(short))


if __name__ == "__main__":
    main()
