"""How large sheets are of which nobody said it, and what the last line says of them. Needs EDGEWISE."""

import unittest

import files
import numpy as np
from running import Running


class Sheets(Running):
    def volume(self, shape, name, spacing=(1, 1, 1)):
        files.write_nifti(self.folder / name, (np.arange(np.prod(shape)).reshape(shape) % 251).astype("u1"), spacing=spacing)
        return self.folder / name

    def made(self, *words):
        """@return  width and height of the file, and the last line"""
        out = self.folder / "o.png"
        done = self.run_it(*words, "-o", out)
        return files.read(out).shape[1:3][::-1], done.stderr.decode().strip().split("\n")[-1]

    def test_three_planes_fill_512_pixels(self):
        for i, (shape, spacing) in enumerate((((8, 20, 30), (1, 1, 1)), ((40, 9, 12), (1, 1, 1)), ((7, 30, 31), (0.7, 0.9, 4)), ((93, 138, 138), (2, 2, 2)))):
            source = self.volume(shape, f"v{i}.nii", spacing)
            size, said = self.made("render", source, "--mpr", "1,1,1")
            z, y, x = (n * s for n, s in zip(shape, spacing[::-1]))
            wide, high = x + y, z + y
            self.assertGreaterEqual(max(size), 512, said)
            self.assertLessEqual(max(size), 518)
            self.assertAlmostEqual((size[0] - 2) / (size[1] - 2), wide / high, delta=0.02 * wide / high)
            self.assertIn(f"{size[0]}x{size[1]}", said)
        # What is larger is shown sample by sample; what is asked for holds.
        large = self.volume((4, 300, 290), "l.nii")
        self.assertEqual(self.made("render", large, "--mpr", "1,1,1")[0], (290 + 2 + 300, 4 + 2 + 300))
        small = self.volume((8, 20, 30), "s.nii")
        self.assertEqual(self.made("render", small, "--mpr", "1,1,1", "--spacing", "1")[0], (52, 30))
        self.assertEqual(self.made("render", small, "--mpr", "1,1,1", "--size", "native")[0], (52, 30))

    def test_the_last_line_says_the_size_of_a_montage(self):
        for i, shape in enumerate(((8, 20, 30), (3, 17, 12), (30, 9, 8))):
            source = self.volume(shape, f"m{i}.nii")
            for columns, rows in ((2, 2), (3, 1), (4, 3)):
                size, said = self.made("warp", source, "--montage", f"{columns}x{rows}")
                self.assertEqual(size, (columns * (shape[2] + 2) - 2, rows * (shape[1] + 2) - 2))
                self.assertIn(f", {size[0]}x{size[1]},", said)
            size, said = self.made("render", source, "--turntable", "4", "--size", "24x20", "--montage", "2x2")
            self.assertEqual(size, (50, 42))
            self.assertIn(", 50x42,", said)
        # Slices without a sheet are a volume still.
        done = self.run_it("warp", source, "-o", self.folder / "w.nrrd")
        self.assertIn("8x9x30", done.stderr.decode())

    def test_channels_side_by_side(self):
        path = self.folder / "c.nrrd"
        files.write_nrrd(path, np.arange(3 * 4 * 5 * 2).reshape(3, 4, 5, 2).astype("<u2"))
        size, said = self.made("render", path, "--channel", "all", "--view", "z", "--spacing", "1", "--montage", "2x1")
        self.assertEqual(size, (12, 4))
        self.assertIn(", 12x4,", said)


class Threshold(Running):
    def test_the_line_that_is_offered_does_it(self):
        for i, (dtype, level) in enumerate((("u1", 100), ("<i2", -5), ("<u2", 3000))):
            volume = np.random.default_rng(i).integers(level - 60, level + 60, (5, 6, 7)).astype(dtype)
            path = self.folder / f"t{i}.nrrd"
            files.write_nrrd(path, volume)
            for word in ("threshold", "Threshold", "binarize"):
                said = self.run_it("filter", path, "-o", "null:", "--op", word, "--kernel", level, code=2).stderr.decode()
                offered = said.split("`")[1].replace("FILE", str(path)).replace("OUT", str(self.folder / "o.nrrd")).split()
                self.assertEqual(offered[0], "edgewise")
                self.run_it(*offered[1:])
                np.testing.assert_array_equal(files.read(self.folder / "o.nrrd")[..., 0], np.where(volume >= level, 255, 0))
        for words in ((), ("--kernel", "100.5"), ("--kernel", "box:1")):
            self.assertIn("--window T-1,T", self.run_it("filter", path, "-o", "null:", "--op", "threshold", *words, code=2).stderr.decode())


if __name__ == "__main__":
    unittest.main()
