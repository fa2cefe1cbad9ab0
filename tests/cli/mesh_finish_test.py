"""`mesh --close`, `--largest`, `--decimate` and `--smooth` of isosurfaces: volumes, areas and counts against formulas. Needs EDGEWISE."""

import json
import math
import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
from running import Running  # noqa: E402


def distances(n, centre):
    z, y, x = np.meshgrid(*map(np.arange, n), indexing="ij")
    return np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)


class Finished(Running):
    def put(self, name, volume):
        path = self.folder / name
        files.write_nrrd(path, volume)
        return path

    def mesh(self, path, *options):
        out = self.folder / "m.stl"
        done = self.run_it("mesh", path, "-o", out, *options, "--json", "-")
        report = json.loads(done.stdout)
        triangles = np.frombuffer(out.read_bytes(), [("n", "<f4", 3), ("at", "<f4", (3, 3)), ("", "<u2")], offset=84)["at"]
        self.assertEqual(len(triangles), report["triangles"])
        return report, triangles.astype(float)

    def test_lids_are_flat_and_close_it(self):
        radius = 9.0
        for dtype, scale, offset in (("<f4", 1, 0), ("u1", 10, 20), ("<i2", 100, -500)):
            # A ball of which two faces of the volume cut off a piece.
            inside = radius - distances((20, 24, 24), (4, 12, 12))
            values = np.rint(np.clip(inside, -5, 15) * scale + 60).astype(dtype) if dtype != "<f4" else inside.astype(dtype)
            level = 60 if dtype != "<f4" else 0
            path = self.put(f"ball{dtype[-1]}.nrrd", values)
            open_one, _ = self.mesh(path, "--isovalue", level + 0.01)
            self.assertFalse(open_one["closed"])
            report, triangles = self.mesh(path, "--isovalue", level + 0.01, "--close")
            self.assertTrue(report["closed"])
            # A ball without what lies beyond x = 0 and beyond z = 19.
            volume = 4 / 3 * math.pi * radius ** 3 - sum(math.pi * cap ** 2 * (3 * radius - cap) / 3 for cap in (radius - 4, radius + 12 - 19))
            self.assertAlmostEqual(report["volume"] / volume, 1, delta=0.015)
            self.assertGreaterEqual(triangles.min(), -1e-6)  # in the outermost samples' plane, not beyond
            self.assertTrue((np.abs(triangles[..., 0]) < 1e-6).all(axis=1).any())
        # What is inside everywhere becomes the box between the outermost samples.
        report, _ = self.mesh(self.put("all.nrrd", np.full((5, 6, 7), 9, "u1")), "--isovalue", "3", "--close")
        self.assertTrue(report["closed"])
        self.assertAlmostEqual(report["volume"], 4 * 5 * 6, places=3)

    def test_the_largest_part_stays(self):
        values = np.maximum(8 - distances((24, 24, 48), (12, 12, 12)), np.maximum(5 - distances((24, 24, 48), (32, 12, 12)), 1.5 - distances((24, 24, 48), (42, 4, 4))))
        path = self.put("three.nrrd", values.astype("<f4"))
        both, _ = self.mesh(path, "--isovalue", "0")
        report, triangles = self.mesh(path, "--isovalue", "0", "--largest")
        self.assertTrue(report["closed"])
        self.assertAlmostEqual(report["volume"] / (4 / 3 * math.pi * 8 ** 3), 1, delta=0.03)
        self.assertLess(triangles[..., 0].max(), 21)
        self.assertGreater(both["volume"], report["volume"] * 1.2)
        labels = np.zeros((10, 10, 30), "u1")
        labels[1:3, 1:3, 1:3], labels[5:9, 5:9, 3:8], labels[1:5, 1:5, 20:28], labels[8, 8, 20] = 1, 1, 2, 2
        report, _ = self.mesh(self.put("labels.nrrd", labels), "--labels", "--smooth", "0", "--largest")
        self.assertAlmostEqual(report["volume"], 4 * 4 * 5 + 4 * 4 * 8)

    def test_fewer_triangles_keep_the_shape(self):
        path = self.put("one.nrrd", (12 - distances((30, 31, 32), (15, 15, 15))).astype("<f4"))
        whole, _ = self.mesh(path, "--isovalue", "0")
        for share in (0, 0.5, 0.9):
            report, triangles = self.mesh(path, "--isovalue", "0", "--decimate", share)
            self.assertLessEqual(report["triangles"], (1 - share) * whole["triangles"] * 1.01 + 4)
            self.assertGreaterEqual(report["triangles"], (1 - share) * whole["triangles"] * 0.9 - 4)
            self.assertTrue(report["closed"])
            # N equal triangles with corners on a sphere miss 6 pi / (sqrt(3) N) of its volume; these are not quite equal.
            missed = 6 * math.pi / math.sqrt(3) / report["triangles"]
            self.assertAlmostEqual(report["volume"] / whole["volume"], 1, delta=1.5 * missed + 0.002)
            away = np.linalg.norm(triangles.reshape(-1, 3) - 15, axis=1)
            self.assertLess(np.abs(away - 12).max(), 0.2)  # vertices stay on the sphere
        labels = np.zeros((20, 20, 40), "u1")
        labels[4:16, 4:16, 4:16], labels[4:16, 4:16, 22:36] = 5, 9
        report, _ = self.mesh(self.put("two.nrrd", labels), "--labels", "--smooth", "0", "--decimate", "0.95")
        self.assertTrue(report["closed"])
        self.assertAlmostEqual(report["volume"] / (12 ** 3 + 12 * 12 * 14), 1, delta=0.02)

    def test_fewer_triangles_leave_no_side_with_more_than_two(self):
        draw = np.random.default_rng(7)
        sponge = draw.standard_normal((22, 24, 26))
        for axis in range(3):
            sponge = sponge + np.roll(sponge, 1, axis)
        wall = np.full((20, 20, 20), -1.0)
        wall[3:17, 3:17, 9:11] = 1  # thin: its sides come to touch
        wall += 0.05 * draw.standard_normal(wall.shape)
        values = 40 * draw.random((16, 18, 20)) ** 2
        for name, volume, level in (("sponge", sponge.astype("<f4"), "0.3"), ("wall", wall.astype("<f4"), "0"), ("grains", values.astype("u1"), "9.5")):
            path = self.put(name + ".nrrd", volume)
            for share in ("0.3", "0.7", "0.95"):
                with self.subTest(name, share=share):
                    report, triangles = self.mesh(path, "--isovalue", level, "--close", "--decimate", share)
                    self.assertTrue(report["closed"])
                    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
                    del corners
                    uses = {}
                    for t in index.reshape(-1, 3):
                        for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0])):
                            uses[a, b] = uses.get((a, b), 0) + 1
                    self.assertEqual(set(uses.values()), {1})
                    self.assertTrue(all((b, a) in uses for a, b in uses))
                    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
                    self.assertAlmostEqual(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 / report["volume"], 1, places=3)

    def test_smoothing_takes_steps_and_keeps_the_volume(self):
        ball = (distances((30, 30, 30), (15, 15, 15)) < 10).astype("u1")
        path = self.put("steps.nrrd", ball)
        rough, _ = self.mesh(path, "--isovalue", "0.5")
        smooth, triangles = self.mesh(path, "--isovalue", "0.5", "--smooth", "1")
        self.assertTrue(smooth["closed"])
        self.assertEqual(smooth["triangles"], rough["triangles"])
        self.assertAlmostEqual(smooth["volume"] / rough["volume"], 1, delta=0.02)
        sphere = math.pi ** (1 / 3) * (6 * smooth["volume"]) ** (2 / 3)  # the least area for its volume
        self.assertLess(smooth["area"], 1.02 * sphere)
        self.assertGreater(rough["area"], 1.05 * sphere)
        same, _ = self.mesh(path, "--isovalue", "0.5", "--smooth", "0")
        self.assertEqual(same["area"], rough["area"])
        one = self.folder / "m.stl"
        bytes_of = []
        for threads in (1, 2):
            self.run_it("mesh", path, "-o", one, "--isovalue", "0.5", "--smooth", "1", "--close", "--largest", "--decimate", "0.5", "--threads", threads)
            bytes_of.append(one.read_bytes())
        self.assertEqual(*bytes_of)

    def test_refusals(self):
        path = self.put("r.nrrd", np.zeros((4, 4, 4), "u1"))
        for option, value in (("--decimate", "2"), ("--smooth", "-1"), ("--decimate", "x")):
            self.assertIn(option.encode(), self.run_it("mesh", path, "-o", "null:", "--isovalue", "1", f"{option}={value}", code=2).stderr)


if __name__ == "__main__":
    unittest.main()
