"""Drives the command from outside, for the tests of this folder. Needs EDGEWISE."""

import itertools
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy as np

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
DATA = os.environ.get("EDGEWISE_DATA", "data")
# Preparations that would stand between a test and the edge that it looks at.
ALONE = ["--without", "store.crop", "--without", "store.precision"]
NUMBERS = {"u1": "uint8", "i2": "int16", "u2": "uint16", "f4": "float"}


def write_nrrd(path, array, spacing=None):
    spacing = spacing or (1,) * array.ndim
    head = (f"NRRD0004\ntype: {NUMBERS[array.dtype.str[1:]]}\ndimension: {array.ndim}\n"
            f"sizes: {' '.join(map(str, array.shape[::-1]))}\n"
            f"spacings: {' '.join(map(str, spacing))}\nendian: little\nencoding: raw\n\n")
    pathlib.Path(path).write_bytes(head.encode() + np.ascontiguousarray(array).tobytes())


def read_nrrd(path):
    head, data = pathlib.Path(path).read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines()[1:]
                  if ": " in line and not line.startswith("#"))
    number = {"uint8": "u1", "unsigned char": "u1", "uchar": "u1", "int16": "i2", "short": "i2",
              "signed short": "i2", "uint16": "u2", "unsigned short": "u2", "ushort": "u2",
              "float": "f4"}[fields["type"]]
    sizes = [int(size) for size in fields["sizes"].split()]
    return np.frombuffer(data, "<" + number).reshape(sizes[::-1]).copy()


class Driven(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        # A home of its own: a profile of whoever runs the tests must not change their plans.
        cls.env = {**os.environ, "XDG_CONFIG_HOME": str(cls.folder / "config"),
                   "XDG_CACHE_HOME": str(cls.folder / "cache")}

    def run_it(self, *words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=120,
                              text=True, env=self.env, check=False)
        if code is not None:
            self.assertEqual(done.returncode, code, f"{words}: {done.stderr}")
        return done

    def report(self, *words, code=0):
        if "render" in words[:2] and not {"--size", "--spacing"} & set(words):
            words = (*words, "--size", "native")
        return json.loads(self.run_it(*words, "--json", "-", "--quiet", code=code).stdout)

    def run_on(self, verb, samples, words, code, spacing):
        source, made = self.folder / "in.nrrd", self.folder / "out.nrrd"
        made.unlink(missing_ok=True)
        if isinstance(samples, np.ndarray):
            write_nrrd(source, samples, spacing)
        else:
            source = samples
        done = self.run_it(verb, source, "-o", made, *words, code=code)
        if code is None:
            return (read_nrrd(made) if done.returncode == 0 else None), done
        if code != 0:
            self.assertFalse(made.exists(), words)
            return done.stderr
        return read_nrrd(made)

    def warp(self, samples, *words, code=0, spacing=None):
        """The warped samples, or what a refusal says; with code=None both (samples or None)."""
        return self.run_on("warp", samples, words, code, spacing)

    def render(self, samples, *words, code=0, spacing=None):
        """The picture's values [height, width] or [height, width, 3]; else as warp."""
        if not {"--size", "--spacing"} & set(words):
            words = (*words, "--size", "native")
        return self.run_on("render", samples, words, code, spacing)

    def edges(self):
        return json.loads(self.run_it("list", "edges", "--json", "-").stdout)["edges"]

    def paths(self, target):
        """--via words of every edge that competes for a target and of every value of its words, so
        that an edge that is added later is swept as well. Those on demand have tests of their own."""
        found = []
        for edge in self.edges():
            if edge["on_demand"] or not any(join["to"] == target for join in edge["joins"]):
                continue
            # Edges to several vertices have the space's name as a parameter.
            words = {key: [word for word in domain["words"]
                           if key != "to" or target.startswith(word)]
                     for key, domain in edge["parameters"].items() if "words" in domain}
            for values in itertools.product(*words.values()):
                keys = "".join(f"/{key}={value}" for key, value in zip(words, values))
                found.append(edge["name"] + keys)
        self.assertTrue(found)
        return found

    def warps(self):
        return self.paths("screen/scalar")


def via(path):
    return ["--via", path, *ALONE]


def turn(degrees):
    """Rows of what --rotate does to an image."""
    a = np.deg2rad(degrees)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])


def turn3(x, y, z):
    """EQ 37: about x first, then y, then z [degree]."""
    def about(axis, degrees):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        m = np.eye(3)
        m[np.ix_([i, j], [i, j])] = turn(degrees)
        return m
    return about(2, z) @ about(1, y) @ about(0, x)


def grid(shape):
    """Centred indices (x first) of an array's samples, [axes, ...]."""
    return np.stack([index - (size - 1) / 2 for index, size in
                     zip(np.indices(shape)[::-1], shape[::-1])])


def seen_at(shape, linear):
    """Where a warp about the centre reads, in centred indices of the input, [axes, ...]."""
    return np.einsum("ij,j...->i...", np.linalg.inv(linear), grid(shape))


def numbered(shape):
    """Samples that are their own numbers, from 1 on: what a warp sent where can be read off."""
    assert np.prod(shape) < 1 << 24  # f32 holds them all
    return np.arange(1, np.prod(shape) + 1, dtype="<f4").reshape(shape)


def sites(values, shape):
    """Centred indices (x first) of the samples whose numbers these are."""
    at = np.unravel_index(values.astype(np.int64) - 1, shape)
    return np.stack([index - (size - 1) / 2 for index, size in zip(at[::-1], shape[::-1])])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values, dtype="f8"))))


def main():
    unittest.main()
