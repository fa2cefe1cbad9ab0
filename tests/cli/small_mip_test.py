"""The MIP of a volume in a picture that is smaller than it: rays pass between samples, and a word says so. Needs EDGEWISE."""

import json
import re
import unittest

import files
import numpy as np
from running import Running


class SmallMip(Running):
    def warnings(self, source, *words):
        done = self.run_it("render", source, "-o", "null:", *words, "--json", "-")
        return [w for w in json.loads(done.stdout)["warnings"] if "rays are" in w]

    def volume(self, name, shape, at=(), low=0, high=255, spacing=(1, 1, 1)):
        a = np.full(shape, low, "u1")
        for place in at:
            a[place] = high
        path = self.folder / f"{name}.nii"
        files.write_nifti(path, a, spacing=spacing)
        return path

    def test_small_pictures_say_it_with_the_size_that_loses_nothing(self):
        rng = np.random.default_rng(5)
        places = [tuple(int(i) for i in rng.integers(2, 30, 3)) for _ in range(12)]
        for mode, low, high in (("mip", 0, 255), ("minip", 255, 0), ("top2", 0, 255)):
            source = self.volume(mode, (32, 32, 32), places, low, high)
            for view in (("--view", "z"), ("--view", "x"), ("--rotate", "0,0,30")):
                with self.subTest(mode=mode, view=view):
                    words = ("--mode", mode, *view)
                    said = self.warnings(source, *words, "--size", "8x8")
                    self.assertEqual(len(said), 1)
                    self.assertIn("dark" if mode == "minip" else "bright", said[0])
                    # The picture of a turned cube shows cos 30 + sin 30 as much of the scene.
                    apart = 4 * (1 if view[0] == "--view" else np.cos(np.pi / 6) + .5)
                    self.assertAlmostEqual(float(re.search(r"([\d.]+) samples apart", said[0])[1]), apart, delta=.05)
                    size = re.search(r"--size (\d+x\d+)", said[0])[1]
                    self.assertEqual(self.warnings(source, *words, "--size", size), [])
                    if view[0] == "--rotate":
                        continue
                    # At that size rays run through the samples: every one is met.
                    out = self.folder / "met.nrrd"
                    self.run_it("render", source, "-o", out, *words, "--size", size)
                    picture = files.read(out)[0]
                    self.assertEqual(np.sum(picture == picture.flat[0]) > 0, True)
                    met = np.sum(picture > 200) if mode != "minip" else np.sum(picture < 50)
                    axes = (0, 1) if view[1] == "x" else (1, 2)
                    self.assertEqual(met, len({tuple(p[i] for i in axes) for p in places}))

    def test_default_sizes_say_nothing(self):
        for name, spacing in (("cubes", (1, 1, 1)), ("flat", (.5, .5, 3)), ("tall", (2, 1, 1))):
            source = self.volume(name, (12, 20, 24), [(5, 5, 5)], spacing=spacing)
            for view in ((), ("--view", "left"), ("--view", "y"), ("--rotate", "20,30,40"), ("--turntable", "5"), ("--zoom", "2"),
                         ("--perspective", "30")):
                self.assertEqual(self.warnings(source, *view), [], (name, view))

    def test_other_modes_say_nothing(self):
        for mode in ("xray", "mean", "stddev", "composite"):
            self.assertEqual(self.warnings("phantom:gaussians:32", "--mode", mode, "--size", "8x8"), [])

    def test_with_a_spacing_the_way_out_has_one(self):
        said = self.warnings("phantom:gaussians:32", "--spacing", "4")
        size = re.search(r"(--spacing [\d.]+ --size \d+x\d+)", said[0])[1].split()
        self.assertEqual(self.warnings("phantom:gaussians:32", *size), [])


if __name__ == "__main__":
    unittest.main()
