#!/usr/bin/python3
"""What is left of a volume that is turned on and on until it stands as before: twelve times 30 degrees about (1, 1, 1).

    EDGEWISE=build/release/bin/edgewise benchmarks/round_turn.py [N]      N samples a side, default 96

Prints the RMS of the difference over the volume's range, as a table in Markdown. Each volume fades to 0 within the ball that all turns keep.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/cli"))
import files  # noqa: E402

EDGEWISE = os.environ.get("EDGEWISE", str(ROOT / "build/release/bin/edgewise"))
EDGES = ["warp.phase_shears", "warp.backward/filter=bspline3", "warp.backward/filter=lanczos3", "warp.backward/filter=foh",
         "warp.shear/filter=bspline3"]


def turn(degrees):
    """About (1, 1, 1), row by row."""
    t = np.radians(degrees)
    even, odd = (1 - np.cos(t)) / 3, np.sin(t) / np.sqrt(3)
    a, b, c = even + np.cos(t), even - odd, even + odd
    return ",".join(f"{value:.17g}" for value in (a, b, c, c, a, b, b, c, a))


def volumes(n, folder):
    random = np.random.default_rng(4)
    r = np.linalg.norm(np.indices((n, n, n)) - (n - 1) / 2, axis=0)
    fades = np.clip((0.47 * n - r) / (0.12 * n), 0, 1)
    window = 0.5 - 0.5 * np.cos(np.pi * fades)
    frequency = np.linalg.norm(np.meshgrid(*[np.fft.fftfreq(n)] * 3, indexing="ij"), axis=0)
    noise = np.fft.fftn(random.normal(size=(n, n, n)))
    for cut in 0.15, 0.25, 0.35:
        yield f"noise below {cut} cycles a sample", np.fft.ifftn(noise * (frequency < cut)).real * window
    subprocess.run([EDGEWISE, "warp", ROOT / "data/engine/engine.nii.gz", "-o", folder / "engine.nrrd", "--size", f"{n}x{n}x{n}", "--quiet"],
                   check=True)
    yield "the engine, scaled to fit", files.read(folder / "engine.nrrd")[..., 0].astype("f8") * window


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 96
    print("| volume | " + " | ".join(f"`{edge}`" for edge in EDGES) + " |\n|---|" + "---|" * len(EDGES))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        now, then = folder / "now.nrrd", folder / "then.nrrd"
        for title, volume in volumes(n, folder):
            volume = volume.astype("<f4")
            errors = []
            for edge in EDGES:
                files.write_nrrd(now, volume)
                for _ in range(12):
                    promised = [] if "phase" in edge else ["--max-error", "10"]  # phases promise nothing
                    subprocess.run([EDGEWISE, "warp", now, "-o", then, "--matrix", turn(30), "--size", f"{n}x{n}x{n}", "--via", edge,
                                    *promised, "--quiet"], check=True)
                    now, then = then, now
                left = files.read(now).reshape(volume.shape) - volume.astype("f8")
                errors.append(np.sqrt(np.mean(left ** 2)) / np.ptp(volume))
            print(f"| {title} | " + " | ".join(f"{error:.2g}" for error in errors) + " |", flush=True)


if __name__ == "__main__":
    main()
