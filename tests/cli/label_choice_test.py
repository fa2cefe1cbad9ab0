"""`--labels=12,13`: these labels alone, in meshes, pictures and warps, against the same file without the others. Needs EDGEWISE."""

import json
import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
from running import Running  # noqa: E402


class Chosen(Running):
    def put(self, name, volume):
        path = self.folder / name
        files.write_nrrd(path, volume)
        return path

    def test_the_others_are_not_there(self):
        volume = np.zeros((12, 14, 16), int)
        volume[2:5, 2:6, 2:9], volume[5:9, 2:6, 2:9], volume[2:9, 8:12, 3:13] = 12, 13, 200
        for dtype in ("u1", "<i2", "<u4", "<f4"):
            path = self.put(f"l_{dtype[-2:]}.nrrd", volume.astype(dtype))
            for ids in ((12,), (13, 200), (12, 13, 200)):
                alone = self.put("alone.nrrd", np.where(np.isin(volume, ids), volume, 0).astype(dtype))
                option = "--labels=" + ",".join(map(str, ids))
                for job, ending, more in (("mesh", "ply", []), ("render", "png", ["--mode", "surface", "--size", "40"]), ("warp", "nrrd", [])):
                    here, there = self.folder / f"here.{ending}", self.folder / f"there.{ending}"
                    self.run_it(job, path, "-o", here, option, *more)
                    self.run_it(job, alone, "-o", there, "--labels", *more)
                    self.assertEqual(here.read_bytes(), there.read_bytes(), (dtype, ids, job))

    def test_large_ids(self):
        volume = np.zeros((6, 6, 6), "<i8")
        big = 2 ** 60 + 1
        volume[1:3, 1:3, 1:3], volume[3:5, 1:3, 1:3] = big, big + 1
        path = self.folder / "big.nrrd"
        path.write_bytes(b"NRRD0004\ntype: int64\ndimension: 3\nsizes: 6 6 6\nendian: little\nencoding: raw\n\n" + volume.tobytes())
        done = self.run_it("mesh", path, "-o", "null:", f"--labels={big}", "--smooth", "0", "--json", "-")
        self.assertAlmostEqual(json.loads(done.stdout)["volume"], 8)

    def test_words(self):
        path = self.put("w.nrrd", np.repeat(np.arange(4, dtype="u1"), 64).reshape(4, 8, 8))
        self.assertIn(b"no sample of", self.run_it("mesh", path, "-o", "null:", "--labels=9", code=2).stderr)
        self.assertIn(b"no sample of", self.run_it("mesh", path, "-o", "null:", "--labels=9,2").stderr)
        self.assertIn(b"--labels", self.run_it("mesh", path, "-o", "null:", "--labels=a", code=2).stderr)
        self.run_it("mesh", path, "-o", "null:", "--labels", "--smooth", "0.5")


if __name__ == "__main__":
    unittest.main()
