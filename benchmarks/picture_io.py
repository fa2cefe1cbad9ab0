#!/usr/bin/env python3
"""PNG, JPEG and TIFF by edgewise's own readers and writers and by OpenImageIO: seconds, memory, damaged files.

    benchmarks/picture_io.py FOLDER     FOLDER: of the built programs, as build/release/bin

A photograph (data/coffee.png, six times as large each way, with grain: 3600 x 2400, RGB of 8 bits) is read and written by two processes
of the same program (picture_io.cpp), in turns. Medians of ROUNDS rounds (15) of warm runs, the first, which loads the library, and the
peak of resident memory of a process that reads or writes once. Damaged files are made here from those files: cut ones, ones that claim
to be huge, and ones with bytes changed at random (a fixed seed); each is read by a process that may take 4 GiB and 20 s. Prints Markdown.
"""

import os
import pathlib
import random
import re
import resource
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

HERE = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else HERE / "build/release/bin")
PROGRAMS = {"edgewise": BIN / "picture_io_benchmark", "OpenImageIO": BIN / "picture_io_by_openimageio_benchmark"}
ROUNDS, CHANGED = int(os.environ.get("ROUNDS", 15)), int(os.environ.get("CHANGED", 60))
FOLDER = pathlib.Path(tempfile.mkdtemp())
MOST, SECONDS = 4 << 30, 20


def photograph():
    small = cv2.imread(str(HERE / "data/coffee/coffee.png"))
    large = cv2.resize(small, None, fx=6, fy=6, interpolation=cv2.INTER_CUBIC).astype(float)
    large += np.random.default_rng(0).normal(0, 2, large.shape)
    cv2.imwrite(str(FOLDER / "photo.png"), large.clip(0, 255).round().astype("u1"))


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MOST, MOST))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run(program, *words):
    """Seconds of each run, and the peak [MiB]."""
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=True)
    *seconds, peak = done.stdout.splitlines()
    return [float(s) for s in seconds], int(re.search(r"\d+", peak)[0]) / 1024


def table_of_speed():
    print("| | first run [s] | warm runs [s] | peak [MiB] | size of the file [MiB] |\n|---|---|---|---|---|")
    for ending in ("png", "jpg", "tif"):
        for name, program in PROGRAMS.items():
            run(program, "write", FOLDER / "photo.png", FOLDER / f"{name}.{ending}", 1)
        for verb in ("read", "write"):
            first, warm, peak = ({name: [] for name in PROGRAMS} for _ in range(3))
            for round_ in range(ROUNDS):
                order = list(PROGRAMS.items())
                for name, program in order if round_ % 2 else order[::-1]:
                    # Both read the same file: that of edgewise.
                    words = ("read", FOLDER / f"edgewise.{ending}") if verb == "read" else ("write", FOLDER / "photo.png", FOLDER / f"{name}.{ending}")
                    once, most = run(program, *words, 1)
                    twice, _ = run(program, *words, 2)
                    first[name].append(once[0]), warm[name].append(twice[1]), peak[name].append(most)
            for name in PROGRAMS:
                size = (FOLDER / f"{'edgewise' if verb == 'read' else name}.{ending}").stat().st_size / 2**20
                print(f"| {verb} {ending}, {name} | {statistics.median(first[name]):.3f} | {statistics.median(warm[name]):.3f} | "
                      f"{statistics.median(peak[name]):.0f} | {size:.1f} |", flush=True)


def small_files():
    picture = cv2.imread(str(HERE / "data/coffee/coffee.png"))[:64, :96]
    cv2.imwrite(str(FOLDER / "small.png"), picture)
    for ending in ("png", "jpg", "tif"):
        run(PROGRAMS["edgewise"], "write", FOLDER / "small.png", FOLDER / f"small.{ending}", 1)
        yield ending, (FOLDER / f"small.{ending}").read_bytes()


def huge(ending, data):
    """The same file, whose header claims as many pixels as its format can."""
    if ending == "png":
        import zlib
        head = b"IHDR" + struct.pack(">II", 2**31 - 1, 2**31 - 1) + data[24:29]
        yield data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]
        head = b"IHDR" + struct.pack(">II", 30000, 30000) + data[24:29]
        yield data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]
    if ending == "jpg":
        at = data.index(b"\xff\xc0") + 5
        for side in (65500, 30000):
            yield data[:at] + struct.pack(">HH", side, side) + data[at + 4:]
    if ending == "tif":
        at, = struct.unpack_from("<I", data, 4)
        entries, = struct.unpack_from("<H", data, at)
        for side in (2**31 - 1, 30000):
            changed = bytearray(data)
            for i in range(entries):
                tag, = struct.unpack_from("<H", data, at + 2 + 12 * i)
                if tag in (256, 257, 278):
                    struct.pack_into("<I", changed, at + 2 + 12 * i + 8, side)
            yield bytes(changed)


def damaged(ending, data):
    for part in range(1, 20):
        yield data[:len(data) * part // 20]
    yield from huge(ending, data)
    random.seed(1)
    for _ in range(CHANGED):
        changed = bytearray(data)
        for _ in range(random.randint(1, 8)):
            changed[random.randrange(min(len(data), 600) if random.random() < .7 else len(data))] = random.randrange(256)
        yield bytes(changed)


def verdict(program, path):
    begin = time.perf_counter()
    try:
        done = subprocess.run([program, "read", path, "1"], capture_output=True, text=True, timeout=SECONDS, preexec_fn=limits, errors="replace")
    except subprocess.TimeoutExpired:
        return "hangs", SECONDS, 0
    peak = re.search(r"peak\s+(\d+)", done.stdout)
    what = "crashes" if done.returncode < 0 else {0: "read", 4: "refused"}.get(done.returncode, "crashes")
    return what, time.perf_counter() - begin, int(peak[1]) / 1024 if peak else 0


def table_of_damage():
    print("\n| damaged files | | refused | read | crashes | hangs | longest [s] | largest peak [MiB] |\n|---|---|---|---|---|---|---|---|")
    for ending, data in small_files():
        rows = {name: [] for name in PROGRAMS}
        for content in damaged(ending, data):
            path = FOLDER / f"damaged.{ending}"
            path.write_bytes(content)
            for name, program in PROGRAMS.items():
                rows[name].append(verdict(program, path))
        for name, found in rows.items():
            count = [sum(what == kind for what, _, _ in found) for kind in ("refused", "read", "crashes", "hangs")]
            print(f"| {len(found)} of {ending} | {name} | " + " | ".join(map(str, count)) +
                  f" | {max(s for _, s, _ in found):.2f} | {max(m for _, _, m in found):.0f} |", flush=True)


print(f"Load before: {os.getloadavg()[0]:.1f} of {os.cpu_count()} processors\n")
photograph()
table_of_speed()
table_of_damage()
print(f"\nLoad after: {os.getloadavg()[0]:.1f}")
