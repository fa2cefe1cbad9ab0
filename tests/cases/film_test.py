"""A film over time shows each time point whole, wherever the first one has its content: what a plan crops, skips or narrows hangs on
the values of each time point. Needs EDGEWISE."""

import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from running import Running, png  # noqa: E402

N, TIMES = 40, 4


def moving(dtype, high):
    """A block of ones that is somewhere else in each time point, in nothing; the last one is nothing at all."""
    volume = np.zeros((TIMES, N, N, N), dtype)
    for time, (x, y, z) in enumerate([(8, 9, 10), (28, 30, 26), (3, 33, 5)]):
        volume[time, z:z + 5, y:y + 5, x:x + 5] = high
    return volume


def write(path, volume, kind):
    head = ("NRRD0004\ntype: %s\ndimension: 4\nsizes: %d %d %d %d\nencoding: raw\nendian: little\nkinds: space space space time\n"
            "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\nspace origin: (0,0,0)\n\n") % (kind, N, N, N, TIMES)
    path.write_bytes(head.encode() + volume.tobytes())


class FilmTest(Running):
    def expect_whole(self, mode, dtype, kind, high, *words):
        volume = moving(dtype, high)
        write(self.folder / "in.nrrd", volume, kind)
        self.run_it("render", self.folder / "in.nrrd", "--time", "all", "-o", self.folder / "t%d.png", "--mode", mode, "--size", "native",
                    "--window", f"0,{high if mode != 'xray' else 5 * high}", "--max-error", "0.3", *words, "--quiet")
        for time in range(TIMES):
            got = png((self.folder / f"t{time}.png").read_bytes())
            want = np.zeros((N, N), int) if not volume[time].any() else 255 * (volume[time].max(0) > 0)
            inner = want > 0
            # Interpolation blurs the edge of the block by a sample.
            self.assertTrue((got[inner] > 60).all(), f"{mode} {kind} {words}: time {time} lacks its block")
            far = ~np.pad(inner, 3)[3:-3, 3:-3]
            for shift in ((2, 0), (-2, 0), (0, 2), (0, -2)):
                far &= ~np.roll(inner, shift, (0, 1))
            self.assertLess(got[far].max(), 60, f"{mode} {kind} {words}: time {time} shows what is elsewhere")

    def test_blocks_that_move(self):
        for mode in ("mip", "xray"):
            self.expect_whole(mode, "u1", "uint8", 200)
            self.expect_whole(mode, "<f4", "float", 3)
            self.expect_whole(mode, "<i2", "int16", 900, "--via", "store.crop", "--max-error", "0.5")

    def test_other_paths(self):
        for via in ("project.ray_cast", "project.shear_warp", "filter.prefilter"):
            self.expect_whole("mip", "u1", "uint8", 200, "--via", via)


if __name__ == "__main__":
    unittest.main()
