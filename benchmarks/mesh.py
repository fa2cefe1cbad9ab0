#!/usr/bin/python3
"""Surfaces of edgewise against VTK's, one thread each, in turns.

Isosurfaces against vtkFlyingEdges3D with normals, labels against vtkDiscreteFlyingEdges3D (one surface a label, not
smoothed). Times are from samples in memory to a mesh in memory: what edgewise reports as measured, and the filter's
Update() on an input that did not change. In each round both run once more; the table has medians, and the ratio taken
round by round. Meshes are compared: isosurfaces have as many vertices on the grid's edges, to 1 % (VTK's may meet at
samples), and areas that agree to 1 %.

    EDGEWISE=build/release/bin/edgewise benchmarks/mesh.py [--runs 5] [--side 256] [--only NAME,...] [--json FILE]

Needs python3-numpy; without python3-vtk9 nothing is compared, and it ends with a line that says so.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

EDGEWISE = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
AGREE = 0.01


def scenes(side):
    """{name: (samples, isovalue or None for labels)}"""
    z, y, x = np.mgrid[:side, :side, :side].astype("f4") / (side - 1) * 2 - 1
    ball = 1 - np.sqrt(x * x + y * y + z * z)
    waves = np.sin(14 * x) * np.cos(11 * y) + np.sin(13 * y) * np.cos(12 * z) + np.sin(12 * z) * np.cos(15 * x)
    bytes_of = lambda field: np.clip(255 * (field - field.min()) / np.ptp(field), 0, 255).astype("u1")
    labels = np.zeros(x.shape, "u1")
    random = np.random.default_rng(1)
    for label in range(1, 21):
        centre, radius = random.uniform(-0.7, 0.7, 3), random.uniform(0.1, 0.3)
        labels[(x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2 < radius ** 2] = label
    return {"ball u8": (bytes_of(ball), 160.5), "gyroid u8": (bytes_of(waves), 127.5),
            "gyroid i16": (np.round(1000 * waves).astype("i2"), 100.5), "gyroid f32": (waves.astype("f4"), 0.1),
            "20 labels u8": (labels, None)}


def ours(path, isovalue, runs):
    words = ["--labels"] if isovalue is None else ["--isovalue", str(isovalue)]
    with tempfile.TemporaryDirectory() as home:
        done = subprocess.run([EDGEWISE, "mesh", path, "-o", "null:", *words, "--threads", "1", "--repeat", str(runs),
                               "--json", "-", "--quiet"], capture_output=True,
                              env={**os.environ, "XDG_CACHE_HOME": home, "XDG_CONFIG_HOME": home})
    if done.returncode:
        sys.exit(done.stderr.decode())
    return json.loads(done.stdout)


def theirs(samples, isovalue):
    """A function that runs the filter once and returns its seconds, and one that returns its mesh's sizes and area."""
    import vtk
    from vtk.util import numpy_support
    vtk.vtkSMPTools.Initialize(1)
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    kept = samples.reshape(-1)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(kept))
    make = vtk.vtkDiscreteFlyingEdges3D() if isovalue is None else vtk.vtkFlyingEdges3D()
    make.SetInputData(image)
    make.ComputeNormalsOn()
    make.ComputeGradientsOff()
    make.ComputeScalarsOff()
    if isovalue is None:
        make.GenerateValues(20, 1, 20)
    else:
        make.SetValue(0, isovalue)

    def run():
        make.Modified()
        begin = time.perf_counter()
        make.Update()
        return time.perf_counter() - begin

    def result():
        mesh = make.GetOutput()
        measure = vtk.vtkMassProperties()
        measure.SetInputData(mesh)
        measure.Update()
        return mesh.GetNumberOfPoints(), mesh.GetNumberOfCells(), measure.GetSurfaceArea()

    run.kept = kept
    return run, result


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--runs", type=int, default=5)
    arguments.add_argument("--side", type=int, default=256)
    arguments.add_argument("--only", default="")
    arguments.add_argument("--json")
    options = arguments.parse_args()
    try:
        import vtk  # noqa: F401
    except ImportError:
        print("python3-vtk9 is not installed: nothing to compare with")
        return 0
    rows, failed = [], False
    with tempfile.TemporaryDirectory() as folder:
        for name, (samples, isovalue) in scenes(options.side).items():
            if options.only and name not in options.only.split(","):
                continue
            path = pathlib.Path(folder) / "volume.raw"
            path.write_bytes(samples.tobytes())
            kind = {"u": "u", "i": "i", "f": "f"}[samples.dtype.kind] + str(8 * samples.dtype.itemsize)
            source = f"raw:{path}:{'x'.join(map(str, samples.shape[::-1]))}:{kind}"
            run, result = theirs(samples, isovalue)
            run()
            pairs = []
            for _ in range(options.runs):
                # The first run of a process touches its pages for the first time; VTK's has done so.
                report = ours(source, isovalue, 3)
                pairs.append((statistics.median(report["measured"]["seconds"]), run()))
            points, triangles, area = result()
            row = {"scene": name, "ours_ms": 1e3 * statistics.median(a for a, _ in pairs),
                   "vtk_ms": 1e3 * statistics.median(b for _, b in pairs),
                   "ratio": statistics.median(b / a for a, b in pairs), "triangles": report["triangles"],
                   "vtk_triangles": triangles, "area": report["area"], "vtk_area": area, "closed": report["closed"]}
            rows.append(row)
            agrees = isovalue is None or (abs(report["vertices"] - points) <= AGREE * points and
                                          abs(report["area"] - area) <= AGREE * area)
            failed |= not agrees
            print(f"{name:14} {row['ours_ms']:8.1f} ms  vtk {row['vtk_ms']:8.1f} ms  ratio {row['ratio']:5.2f}  "
                  f"triangles {row['triangles']} {triangles}  area {row['area']:.6g} {area:.6g}"
                  f"{'' if agrees else '  DIFFERS'}", flush=True)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps({"side": options.side, "runs": options.runs, "rows": rows}, indent=2))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
