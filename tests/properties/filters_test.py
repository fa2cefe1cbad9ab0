"""Every filter of samples through warps and casts, against the same filter written in numpy. Needs EDGEWISE."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy as np

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")


def keys(x):
    x = np.abs(x)
    return np.where(x < 1, 1 + x * x * (1.5 * x - 2.5), np.where(x < 2, 2 + x * (-4 + x * (2.5 - 0.5 * x)), 0))


def lanczos3(x):
    return np.where(np.abs(x) < 3, np.sinc(x) * np.sinc(x / 3), 0)


FILTERS = {"keys": (keys, 2), "lanczos3": (lanczos3, 3)}


def read(samples, places, name):
    """Values at places [..., axes], x first; beyond the ends the outermost samples continue."""
    kernel, reach = FILTERS[name]
    axes = samples.ndim
    taps, indices = [], []
    for axis in range(axes):
        n = samples.shape[axes - 1 - axis]
        p = np.clip(places[..., axis], 0, n - 1)
        at = np.floor(p).astype(int)[..., None] + np.arange(1 - reach, reach + 1)
        weights = kernel(p[..., None] - at)
        taps.append(weights / weights.sum(-1, keepdims=True))
        indices.append(np.clip(at, 0, n - 1))
    if axes == 2:
        got = samples[indices[1][..., :, None], indices[0][..., None, :]]
        return np.einsum("...ji,...j,...i->...", got, taps[1], taps[0])
    got = samples[indices[2][..., :, None, None], indices[1][..., None, :, None], indices[0][..., None, None, :]]
    return np.einsum("...kji,...k,...j,...i->...", got, taps[2], taps[1], taps[0])


def write_nrrd(path, samples):
    kind = {"uint8": "uint8", "int16": "int16", "float32": "float"}[samples.dtype.name]
    path.write_bytes((f"NRRD0004\ntype: {kind}\ndimension: {samples.ndim}\n"
                      f"sizes: {' '.join(map(str, samples.shape[::-1]))}\n"
                      f"spacings: {' '.join(['1'] * samples.ndim)}\nendian: little\nencoding: raw\n\n").encode()
                     + samples.tobytes())


def read_nrrd(path):
    head, data = path.read_bytes().split(b"\n\n", 1)
    sizes = next(line for line in head.decode().splitlines() if line.startswith("sizes:"))
    return np.frombuffer(data, "<f4").reshape([int(n) for n in sizes[6:].split()][::-1])


class Filters(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "c"), "XDG_CACHE_HOME": str(self.folder / "c")}

    def run_it(self, verb, samples, *words, code=0):
        source, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        write_nrrd(source, samples)
        done = subprocess.run([COMMAND, verb, source, "-o", out, "--bits", "32", "--quiet", "--json", "-",
                               *map(str, words)], capture_output=True, text=True, env=self.env, timeout=120)
        self.assertEqual(done.returncode, code, done.stderr)
        return (read_nrrd(out), json.loads(done.stdout)) if code == 0 else done.stderr

    def test_warps_are_the_filter(self):
        draw = np.random.default_rng(5)
        angle = np.deg2rad(20)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])  # output -> input
        for shape in ((31, 26), (13, 17, 22)):
            for kind in ("float32", "int16", "uint8"):
                samples = draw.uniform(0, 200, shape).astype(kind)
                index = np.stack(np.meshgrid(*[np.arange(n, dtype=float) for n in shape], indexing="ij")[::-1], -1)
                middle = (np.array(shape[::-1]) - 1) / 2
                places = index - middle
                places[..., :2] = places[..., :2] @ turn.T
                places += middle
                inside = np.all((places >= -0.5) & (places <= 2 * middle + 0.5), -1)
                words = ["--rotate", 20] if len(shape) == 2 else ["--rotate", "0,0,20"]
                for name in FILTERS:
                    got, _ = self.run_it("warp", samples, *words, "--via", f"warp.backward/filter={name}")
                    expected = read(samples.astype(float), places, name)
                    # f32 keeps 2^-23 of a place and of the result.
                    np.testing.assert_allclose(got[inside], expected[inside], atol=200 * 1e-5, err_msg=f"{name} {kind}")

    def test_casts_are_the_filter(self):
        draw = np.random.default_rng(6)
        for kind in ("float32", "int16", "uint8"):
            samples = draw.uniform(0, 200, (9, 14, 12)).astype(kind)
            x, y = np.meshgrid(np.arange(19), np.arange(21))
            across = (x - 9) / 1.5 + 5.5, (y - 10) / 1.5 + 6.5
            inside = (across[0] > -0.4) & (across[0] < 11.4) & (across[1] > -0.4) & (across[1] < 13.4)
            z = (np.arange(18) + 0.5) / 2 - 0.5
            places = np.stack([np.repeat(across[0][..., None], 18, -1), np.repeat(across[1][..., None], 18, -1),
                               np.broadcast_to(z, (21, 19, 18))], -1)
            for name in FILTERS:
                expected = read(samples.astype(float), places, name)
                for mode, answer in (("mip", expected.max(-1)), ("mean", expected.mean(-1)),
                                     ("xray", expected.sum(-1) / 2)):
                    got, _ = self.run_it("render", samples, "--mode", mode, "--scale", "1.5,1.5,1", "--size", "19x21",
                                         "--spacing", "1", "--via", f"ray_cast/filter={name}/step=0.5")
                    # Weights are polynomials within 2^-24, and places keep 2^-23 of 14 samples.
                    np.testing.assert_allclose(got[inside], answer[inside], atol=9 * 200 * 1e-5,
                                               err_msg=f"{name} {mode} {kind}")

    def test_errors_are_predicted(self):
        draw = np.random.default_rng(7)
        z, y, x = np.mgrid[:24, :26, :28]
        smooth = 100 + 60 * np.sin(x / 2.5) * np.cos(y / 3) * np.sin(z / 2.2)
        for samples in (smooth.astype("float32"), draw.uniform(0, 100, (18, 20, 22)).astype("float32")):
            for name in FILTERS:
                for verb, words in (("warp", ["--rotate", "10,20,30", "--via", f"backward/filter={name}"]),
                                    ("render", ["--mode", "mip", "--rotate", "10,20,30", "--size", "40x40", "--via",
                                                f"ray_cast/filter={name}/step=1"])):
                    _, report = self.run_it(verb, samples, *words, "--verify=all")
                    ratio = report["plan"]["predicted"]["error"] / report["measured"]["error"]["nrmse"]
                    self.assertTrue(2 / 3 < ratio < 3, f"{verb} {name}: {ratio}")

    def test_values_that_are_not_finite_are_refused(self):
        samples = np.ones((9, 9, 9), "float32")
        samples[4, 4, 4] = np.nan
        for name in FILTERS:
            message = self.run_it("warp", samples, "--rotate", "0,0,20", "--via", f"backward/filter={name}", code=3)
            self.assertIn("1 samples are not finite", message)


if __name__ == "__main__":
    unittest.main()
