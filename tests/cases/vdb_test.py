"""OpenVDB, in files that its own library wrote (data/vdb), beside the formulas they are made of. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import pathlib
import sys
import unittest

import numpy as np

root = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(root / "cli")]
import files
from running import DATA, Running


class VdbTest(Running):
    def info(self, path):
        return json.loads(self.run_it("info", path, "--json", "-", "--quiet").stdout)

    def index(self, shape, first):
        k, j, i = np.indices(shape)
        return i + first[0], j + first[1], k + first[2]

    def expect(self, name, shape, value, steps, origin):
        path = DATA / "vdb" / name
        said = self.info(path)
        self.assertEqual(said["extent"], list(shape[::-1]))
        np.testing.assert_allclose(said["origin"], origin, atol=1e-12)
        np.testing.assert_allclose(np.array(said["direction"]).T * said["spacing"], steps, atol=1e-12)
        self.run_it("warp", path, "-o", self.folder / "out.nrrd", "--quiet")
        np.testing.assert_allclose(files.read(self.folder / "out.nrrd")[..., 0], value, atol=1e-6)

    def test_fog(self):
        i, j, k = self.index((11, 11, 11), (5, 7, 9))
        value = np.clip(1 - np.sqrt((i - 10) ** 2 + (j - 12) ** 2 + (k - 14) ** 2) / 6, 0, 1)
        self.expect("fog.vdb", value.shape, value, np.eye(3) / 2, np.array((1, -2, 3)) + np.array((5, 7, 9)) / 2)
        steps = np.array([[0, -0.75, 0], [0.5, 0, 0], [0, 0, 1.25]])
        self.expect("turned.vdb", value.shape, value, steps, steps @ (5, 7, 9))

    def test_level_set(self):
        i, j, k = self.index((21, 21, 21), (0, 2, 4))
        distance = np.sqrt((i / 2 - 5) ** 2 + (j / 2 - 6) ** 2 + (k / 2 - 7) ** 2) - 4
        self.expect("ball.vdb", distance.shape, np.clip(distance, -1.5, 1.5), np.eye(3) / 2, (0, 1, 2))

    def test_a_cut_file_is_refused(self):
        whole = (DATA / "vdb" / "fog.vdb").read_bytes()
        for part in (4, 300, len(whole) // 2):
            (self.folder / "cut.vdb").write_bytes(whole[:part])
            self.run_it("info", self.folder / "cut.vdb", code=4)


if __name__ == "__main__":
    unittest.main()
