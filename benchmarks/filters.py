#!/usr/bin/env python3
"""The filter job beside OpenCV, and the planner's choice beside every edge, on one thread.

    EDGEWISE=build/release/bin/edgewise benchmarks/filters.py [images] [edges] [volumes] [morphology] [extremes]

images      kernels of k x k random weights on 2048 x 2048 f32: cv2.filter2D in the same run, in turns, and how far both
            are from scipy in f64 on a part of the image
edges       the same kernels, and boxes and Gaussians: seconds of the chosen path over those of the fastest edge
volumes     the same on 128^3, kernels of 3^3 to 31^3
morphology  dilation of 2048 x 2048 u8 by flat squares and discs: cv2.dilate in the same run
extremes    dilations and medians of u8, images and volumes: the chosen path over the fastest edge
Medians of three rounds, or of as many as ROUNDS says; all as Markdown tables.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy import signal

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
FOLDER = pathlib.Path(tempfile.mkdtemp())
SUMS = ["backward", "forward", "separable", "running", "fourier"]
ROUNDS, SIDE = int(os.environ.get("ROUNDS", 3)), 2048
TYPES = {"f4": "float", "u1": "uint8"}


def write(path, a):
    sizes = " ".join(map(str, a.shape[::-1]))
    head = f"NRRD0004\ntype: {TYPES[a.dtype.str[1:]]}\ndimension: {a.ndim}\nsizes: {sizes}\nendian: little\nencoding: raw\n\n"
    path.write_bytes(head.encode() + a.tobytes())


def read(path):
    head, body = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    kind = next(k for k, v in TYPES.items() if v == fields["type"])
    return np.frombuffer(body, kind).reshape([int(n) for n in fields["sizes"].split()][::-1])


def run(source, *words, out="null:", repeat=5):
    """Median seconds and the path; None where it cannot serve."""
    done = subprocess.run([COMMAND, "filter", source, "-o", out, "--threads", "1", "--repeat", str(repeat), "--json", "-", "--quiet", *map(str, words)],
                          capture_output=True)
    if done.returncode == 3:
        return None, None
    report = json.loads(done.stdout)
    assert done.returncode == 0, report
    steps = [step["transition"].removeprefix("filter.") for step in report["plan"]["steps"]]
    return float(np.median(report["measured"]["seconds"])), " ".join(steps)


def timed(function):
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin


def images():
    import cv2

    cv2.setNumThreads(1)
    random = np.random.default_rng(1)
    image = random.random((SIDE, SIDE)).astype("f4")
    source, file, out = FOLDER / "image.nrrd", FOLDER / "kernel.nrrd", FOLDER / "out.nrrd"
    write(source, image)
    print("| k | path | edgewise [ms] | cv2.filter2D [ms] | ratio | error, edgewise | error, cv2 |\n|---|---|---|---|---|---|---|")
    for k in (3, 5, 7, 9, 11, 13, 15, 19, 25, 31, 51, 75, 101):
        kernel = random.random((k, k)).astype("f4") / k**2
        write(file, kernel)
        words = ["--op", "correlate", "--kernel", file]
        ours, theirs = [], []
        for _ in range(ROUNDS):
            seconds, path = run(source, *words)
            ours.append(seconds)
            theirs.append(np.median([timed(lambda: cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REFLECT_101)) for _ in range(3)]))
        run(source, *words, out=out, repeat=1)
        part = image[: 200 + k, : 200 + k].astype("f8")
        want = signal.correlate(part, kernel.astype("f8"), mode="valid", method="direct" if k < 20 else "fft")[:200, :200]
        at = k // 2
        off = [np.sqrt(np.mean((a[at : at + 200, at : at + 200] - want) ** 2)) / np.ptp(want) for a in (read(out), cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REFLECT_101))]
        a, b = 1e3 * np.median(ours), 1e3 * np.median(theirs)
        print(f"| {k} | {path} | {a:.1f} | {b:.1f} | {b / a:.2f} | {off[0]:.1e} | {off[1]:.1e} |", flush=True)


def beside_edges(source, kernels, op="correlate", edges=SUMS):
    print("| kernel | path | chosen [ms] | fastest edge | its time [ms] | ratio |\n|---|---|---|---|---|---|")
    for name, words in kernels:
        words = ["--op", op, "--kernel", words]
        chosen, each = [], {edge: [] for edge in edges}
        for _ in range(ROUNDS):
            seconds, path = run(source, *words, repeat=3)
            chosen.append(seconds)
            for edge in edges:
                if each[edge] is None:
                    continue
                seconds, _ = run(source, *words, "--via", f"filter.{edge}", repeat=3)
                if seconds is None or seconds > 4 * chosen[-1]:
                    each[edge] = None
                else:
                    each[edge].append(seconds)
        best, edge = min((np.median(s), e) for e, s in each.items() if s)
        print(f"| {name} | {path} | {1e3 * np.median(chosen):.2f} | {edge} | {1e3 * best:.2f} | {np.median(chosen) / best:.2f} |", flush=True)


def kernels_of(sizes, axes, random):
    for k in sizes:
        file = FOLDER / f"kernel{k}.nrrd"
        write(file, random.random((k,) * axes).astype("f4") / k**axes)
        yield f"random {k}", file
    for radius in (1, 2, 5, 10, 15) if axes == 3 else (1, 2, 5, 15, 50):
        yield f"box:{radius}", f"box:{radius}"
    for sigma in (0.7, 1.5, 3) if axes == 3 else (0.7, 2, 5, 12):
        yield f"gauss:{sigma}", f"gauss:{sigma}"


def edges():
    random = np.random.default_rng(2)
    source = FOLDER / "image.nrrd"
    write(source, random.random((SIDE, SIDE)).astype("f4"))
    beside_edges(source, kernels_of((3, 5, 7, 9, 11, 13, 15, 19, 25, 31, 51, 101), 2, random))


def volumes():
    random = np.random.default_rng(3)
    source = FOLDER / "volume.nrrd"
    write(source, random.random((128, 128, 128)).astype("f4"))
    beside_edges(source, kernels_of((3, 5, 7, 9, 13, 21, 31), 3, random))


def morphology():
    import cv2

    cv2.setNumThreads(1)
    image = np.random.default_rng(4).integers(0, 255, (SIDE, SIDE)).astype("u1")
    source, out = FOLDER / "image.nrrd", FOLDER / "out.nrrd"
    write(source, image)
    print("| flat kernel | path | edgewise [ms] | cv2.dilate [ms] | ratio | pixels that differ |\n|---|---|---|---|---|---|")
    for kernel, size in (("box", 1), ("box", 3), ("box", 7), ("box", 15), ("box", 31), ("sphere", 3), ("sphere", 7), ("sphere", 15), ("sphere", 31)):
        k = 2 * size + 1
        if kernel == "box":
            places = np.ones((k, k), "u1")
        else:
            y, x = np.mgrid[-size : size + 1, -size : size + 1]
            places = (x * x + y * y <= size * size).astype("u1")
        words = ["--op", "dilate", "--kernel", f"{kernel}:{size}", "--border", "clamp"]
        dilated = lambda: cv2.dilate(image, places, borderType=cv2.BORDER_REPLICATE)
        ours, theirs = [], []
        for _ in range(ROUNDS):
            seconds, path = run(source, *words)
            ours.append(seconds)
            theirs.append(np.median([timed(dilated) for _ in range(3)]))
        run(source, *words, out=out, repeat=1)
        a, b = 1e3 * np.median(ours), 1e3 * np.median(theirs)
        print(f"| {kernel} {k} | {path} | {a:.2f} | {b:.2f} | {b / a:.1f} | {np.count_nonzero(read(out) != dilated())} |", flush=True)


def extremes():
    random = np.random.default_rng(5)
    for axes, side in ((2, SIDE), (3, 128)):
        source = FOLDER / f"bytes{axes}.nrrd"
        write(source, random.integers(0, 255, (side,) * axes).astype("u1"))
        radii = (1, 2, 3, 5, 7, 15, 31, 50) if axes == 2 else (1, 2, 3, 5, 7, 10, 15)
        kernels = [(f"{axes}D {shape}:{r}", f"{shape}:{r}") for shape in ("box", "sphere") for r in radii]
        beside_edges(source, kernels, "dilate", ["backward", "runs", "van_herk"])
        kernels = [(f"{axes}D median sphere:{r}", f"sphere:{r}") for r in (1, 2, 4)]
        beside_edges(source, kernels, "median", ["median", "median_histogram"])


if __name__ == "__main__":
    for name in sys.argv[1:] or ["images", "edges", "volumes", "morphology", "extremes"]:
        print(f"\n{name}\n")
        globals()[name]()
