"""How large pictures are of which nobody said it: at least 512 samples on the longer side, of the same field of view. Needs EDGEWISE."""

import json
import math
import unittest

import files
import numpy as np
from running import Running


class DefaultSize(Running):
    def volume(self, shape, name="v.nii", spacing=(1, 1, 1)):
        a = np.zeros(shape, "u1")
        a[tuple(slice(n // 4, n - n // 3) for n in shape)] = 100
        files.write_nifti(self.folder / name, a, spacing=spacing)
        return self.folder / name

    def render(self, source, *words, name="p.nrrd"):
        self.run_it("render", source, "-o", self.folder / name, "--quiet", *words)
        return files.read(self.folder / name)[0, ..., 0]

    def test_small_volumes_fill_512_samples(self):
        for shape, spacing, words, size in (((8, 20, 30), (1, 1, 1), ("--view", "z"), (512, 342)), ((8, 20, 30), (1, 1, 4), ("--view", "x"), (320, 512)),
                                            ((9, 9, 9), (0.5, 0.5, 0.5), ("--view", "y"), (512, 512)), ((1, 1, 1), (1, 1, 1), ("--view", "z"), (512, 512)),
                                            ((16, 12, 24), (2, 1, 1), ("--view", "z"), (512, 128))):
            source = self.volume(shape, spacing=spacing)
            got = self.render(source, *words)
            self.assertEqual(got.shape[::-1], size, (shape, spacing))
            self.assertTrue(np.array_equal(self.render(source, *words, "--size", "512"), got))

    def test_the_field_of_view_stays(self):
        # The integral over the picture is that over the volume, however many samples show it.
        for shape, spacing in (((10, 20, 30), (1, 1, 1)), ((14, 16, 12), (2, 0.5, 1.5))):
            source = self.volume(shape, spacing=spacing)
            whole = 100 * np.prod([n - n // 3 - n // 4 for n in shape]) * np.prod(spacing)
            for view, field in (("z", (0, 1)), ("y", (0, 2)), ("x", (1, 2))):
                got = self.render(source, "--mode", "xray", "--view", view)
                width, height = (shape[::-1][axis] * spacing[axis] for axis in field)
                self.assertEqual(max(got.shape), 512)
                pixel = max(width, height) / 512
                self.assertAlmostEqual(got.astype(float).sum() * pixel**2 / whole, 1, delta=0.01)

    def test_sizes_and_spacings_that_are_given_hold(self):
        source = self.volume((8, 20, 30))
        for words, size in ((("--size", "30"), (30, 20)), (("--size", "31x9"), (31, 9)), (("--spacing", "1"), (30, 20)), (("--spacing", "0.5"), (60, 40)),
                            (("--spacing", "2", "--size", "7x5"), (7, 5)), (("--size", "native"), (30, 20)), (("--size", "Native"), (30, 20))):
            self.assertEqual(self.render(source, "--view", "z", *words).shape[::-1], size)

    def test_native_is_of_pictures(self):
        source = self.volume((8, 20, 30), spacing=(0.5, 1, 2))
        self.assertEqual(self.render(source, "--view", "z", "--size", "native").shape[::-1], (30, 40))
        for words in (("warp", source, "--size", "native"), ("render", source, "--size", "native", "--spacing", "1"), ("render", source, "--size", "natve")):
            self.assertIn("--size", self.run_it(*words, "-o", "null:", code=2).stderr.decode())

    def test_large_volumes_are_shown_sample_by_sample(self):
        for n, size in (((700, 300, 40), (700, 300)), ((512, 100, 20), (512, 100)), ((511, 100, 20), (512, 101)), ((40, 600, 7), (40, 600))):
            report = json.loads(self.run_it("plan", "render", f"describe:{n[0]}x{n[1]}x{n[2]}:u8", "--view", "z", "--json", "-").stdout)
            self.assertTrue(report["plan"]["steps"][-1]["to"].endswith(f"/{size[0]}x{size[1]}"), report["plan"]["steps"][-1]["to"])

    def test_samples_along_rays_are_those_of_the_data(self):
        # A step is in units of the smallest spacing of the data, whatever pixels are.
        values = np.random.default_rng(3).integers(0, 255, (9, 11, 13)).astype("u1")
        files.write_nifti(self.folder / "n.nii", values)
        cast = ("--view", "z", "--mode", "mean", "--via", "project.ray_cast/filter=zoh/step=1", "--max-error", "9")
        got = self.render(self.folder / "n.nii", *cast)
        for y, x in ((0, 0), (200, 300), (431, 511)):
            of = values[:, min(10, int((y + 0.5) * 13 / 512 + (11 - got.shape[0] * 13 / 512) / 2)), int((x + 0.5) * 13 / 512)]
            self.assertAlmostEqual(got[y, x], of.mean(), places=3)
        self.assertEqual(got.shape, (math.ceil(512 * 11 / 13), 512))

    def test_turntables_and_eyes(self):
        source = self.volume((8, 20, 30))
        for words in (("--turntable", "3"), ("--perspective", "30"), ("--zoom", "2"), ("--rotate", "20,30,0")):
            self.run_it("render", source, "-o", self.folder / "t_%d.nrrd", "--view", "z", *words, "--quiet")
            self.assertEqual(max(files.read(self.folder / "t_0.nrrd").shape[1:3]), 512, words)


if __name__ == "__main__":
    unittest.main()
