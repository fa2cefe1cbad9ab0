"""Surfaces as the command writes them: PLY, OBJ and STL, where the file says that samples lie, the report and exit codes."""

import json
import struct
import unittest

import numpy as np

from running import Running


def read_ply(path):
    """Positions, normals, triangles and labels (or None) of a binary PLY."""
    data = path.read_bytes()
    head, rest = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    assert lines[1] == "format binary_little_endian 1.0"
    vertices = np.frombuffer(rest, "<f4", 6 * counts[0]).reshape(-1, 6)
    label = [line.split()[1] for line in lines if line.endswith(" label")]
    face = [("n", "u1"), ("v", "<i4", 3)] + [("label", {"int": "<i4", "double": "<f8"}[kind]) for kind in label]
    faces = np.frombuffer(rest, np.dtype(face), counts[1], 24 * counts[0])
    assert len(rest) == 24 * counts[0] + faces.nbytes
    assert (faces["n"] == 3).all()
    return vertices[:, :3], vertices[:, 3:], faces["v"], faces["label"] if label else None


def read_obj(path):
    rows = [line.split() for line in path.read_text().splitlines()]
    take = lambda kind: np.array([row[1:] for row in rows if row and row[0] == kind])
    faces = [[part.split("//") for part in row] for row in take("f")]
    for face in faces:
        for vertex, normal in face:
            assert vertex == normal
    return (take("v").astype("f4"), take("vn").astype("f4"), np.array([[int(p[0]) - 1 for p in face] for face in faces]),
            [row[1] for row in rows if row and row[0] == "g"])


def read_stl(path):
    data = path.read_bytes()
    assert not data.startswith(b"solid")
    count, = struct.unpack("<I", data[80:84])
    assert len(data) == 84 + 50 * count
    return np.frombuffer(data, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]), count, 84)


def is_closed(triangles):
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there, counts = np.unique(sides, axis=0, return_counts=True)
    back = np.unique(sides[:, ::-1], axis=0)
    return (counts == 1).all() and len(there) == len(back) and (there == back).all()


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]].astype(float) for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


class Mesh(Running):
    def nrrd(self, name, samples, space="left-posterior-superior", directions="(1,0,0) (0,1,0) (0,0,1)", origin="(0,0,0)"):
        kinds = {"uint8": "uint8", "int16": "int16", "float32": "float", "uint32": "uint32"}
        head = (f"NRRD0004\ntype: {kinds[str(samples.dtype)]}\ndimension: 3\nspace: {space}\n"
                f"sizes: {' '.join(map(str, samples.shape[::-1]))}\nspace directions: {directions}\n"
                f"space origin: {origin}\nencoding: raw\nendian: little\n\n")
        path = self.folder / name
        path.write_bytes(head.encode() + samples.tobytes())
        return path

    def mesh(self, source, *words, out="null:"):
        done = self.run_it("mesh", source, "-o", out, "--json", "-", "--quiet", *words)
        return json.loads(done.stdout)

    def test_a_sphere_has_its_area_and_volume(self):
        out = self.folder / "sphere.ply"
        report = self.mesh("phantom:sphere:160", "--isovalue", "0.5", out=out)
        points, normals, triangles, labels = read_ply(out)
        self.assertIsNone(labels)
        self.assertEqual((report["vertices"], report["triangles"]), (len(points), len(triangles)))
        self.assertEqual(report["outputs"], [str(out)])
        self.assertTrue(report["closed"])
        self.assertTrue(is_closed(triangles))
        self.assertEqual(len(points) - len(triangles) * 3 // 2 + len(triangles), 2)
        self.assertAlmostEqual(report["volume"], volume(points, triangles), delta=1e-5 * report["volume"])
        # All of it is inside one radius, that of both area and volume: chords of a sample on a sphere of 19 samples and
        # more lose 3 / (8 r^2) at most, 0.1 %, and twice and three times that of area and volume.
        radii = np.linalg.norm(points - points.mean(0), axis=1)
        radius = radii.mean()
        self.assertGreater(radius, 15)
        self.assertAlmostEqual(report["area"], 4 * np.pi * radius ** 2, delta=0.02 * report["area"])
        self.assertAlmostEqual(report["volume"], 4 / 3 * np.pi * radius ** 3, delta=0.02 * report["volume"])
        outwards = np.einsum("ij,ij->i", points - points.mean(0), normals)
        self.assertGreater(outwards.min(), 0)
        self.assertEqual([step["transition"] for step in report["plan"]["steps"]], ["surface.flying_edges"])
        self.assertEqual(report["request"]["job"], "mesh")

    def test_vertices_lie_where_the_file_says(self):
        # A ball about sample (8, 9, 10) of an oblique, mirrored grid in RAS.
        z, y, x = np.mgrid[:22, :20, :18].astype("f4")
        ball = (6 - np.sqrt((x - 8) ** 2 + (y - 9) ** 2 + (z - 10) ** 2)).astype("f4")
        steps = np.array([[0.8, 0.6, 0], [1.2, -1.6, 0], [0, 0, 3.0]])  # rows: x, y, z, in RAS
        text = " ".join("(" + ",".join(map(str, row)) + ")" for row in steps)
        path = self.nrrd("ball.nrrd", ball, "right-anterior-superior", text, "(10,20,-30)")
        out = self.folder / "ball.ply"
        report = self.mesh(path, "--isovalue", "0", out=out)
        points, normals, triangles, _ = read_ply(out)
        to_lps = np.diag([-1, -1, 1])
        centre = to_lps @ (np.array([10, 20, -30]) + np.array([8, 9, 10]) @ steps)
        info = json.loads(self.run_it("info", path, "--json", "-").stdout)
        again = np.array(info["origin"]) + sum(i * s * np.array(d) for i, s, d in
                                               zip((8, 9, 10), info["spacing"], info["direction"]))
        np.testing.assert_allclose(centre, again, atol=1e-9)
        np.testing.assert_allclose((points.min(0) + points.max(0)) / 2, centre, atol=0.05)
        # Back among the samples it is a sphere.
        index = (points - centre) @ np.linalg.inv(to_lps @ steps.T).T
        np.testing.assert_allclose(np.linalg.norm(index, axis=1), 6, atol=1 / (8 * 6) + 1e-4)
        size = abs(np.linalg.det(steps))
        self.assertAlmostEqual(report["volume"], size * 4 / 3 * np.pi * 6 ** 3, delta=0.04 * report["volume"])
        self.assertGreater(volume(points - points.mean(0), triangles), 0)
        # The gradient of the ball in LPS.
        expected = index @ np.linalg.inv(to_lps @ steps.T)
        expected /= np.linalg.norm(expected, axis=1)[:, None]
        self.assertGreater(np.einsum("ij,ij->i", expected, normals).min(), 0.98)

    def test_all_formats_hold_the_same(self):
        out = {end: self.folder / f"same.{end}" for end in ("ply", "obj", "stl")}
        for file in out.values():
            self.mesh("phantom:marschner-lobb:24", "--isovalue", "0.5", out=file)
        points, normals, triangles, _ = read_ply(out["ply"])
        again, normals_again, triangles_again, groups = read_obj(out["obj"])
        np.testing.assert_array_equal(points, again)
        np.testing.assert_array_equal(normals, normals_again)
        np.testing.assert_array_equal(triangles, triangles_again)
        self.assertEqual(groups, [])
        solid = read_stl(out["stl"])
        np.testing.assert_array_equal(solid["corners"], points[triangles])
        self.assertEqual(list(self.folder.glob(".*.part")), [])

    def test_random_integers_give_closed_surfaces_at_their_own_values(self):
        random = np.random.default_rng(5)
        for kind in ("uint8", "int16", "float32"):
            samples = np.zeros((9, 10, 70), kind)
            samples[1:-1, 1:-1, 1:-1] = random.integers(0, 4, (7, 8, 68))
            path = self.nrrd(f"random_{kind}.nrrd", samples)
            for isovalue in ("1", "2", "2.5"):
                out = self.folder / "random.ply"
                report = self.mesh(path, "--isovalue", isovalue, out=out)
                self.assertTrue(report["closed"])
                self.assertTrue(is_closed(read_ply(out)[2]))

    def test_labels_have_a_closed_surface_each(self):
        samples = np.zeros((20, 20, 30), "u1")
        samples[5:15, 5:15, 5:12] = 7
        samples[5:15, 5:15, 12:20] = 3
        samples[8:11, 8:11, 24:27] = 7
        path = self.nrrd("labels.nrrd", samples)
        out = self.folder / "labels.ply"
        report = self.mesh(path, "--labels", out=out)
        self.assertEqual([step["transition"] for step in report["plan"]["steps"]], ["surface.nets"])
        self.assertTrue(report["closed"])
        points, _, triangles, labels = read_ply(out)
        self.assertEqual(set(labels), {3, 7})
        # 10 x 10 x 8, and 10 x 10 x 7 with 3 x 3 x 3.
        for label, samples in ((3, 800), (7, 727)):
            own = triangles[labels == label]
            self.assertTrue(is_closed(own))
            self.assertAlmostEqual(volume(points, own), samples, delta=0.05 * samples)
        self.mesh(path, "--labels", out=self.folder / "labels.obj")
        self.assertEqual(read_obj(self.folder / "labels.obj")[3], ["label_3", "label_7"])
        rough = self.mesh(path, "--labels", "--via", "surface.nets/smooth=0")
        self.assertGreater(rough["area"], report["area"])

    def test_labels_that_f32_cannot_hold_stay_apart(self):
        samples = np.zeros((8, 8, 12), "u4")
        samples[2:6, 2:6, 2:5] = 2 ** 24 + 1
        samples[2:6, 2:6, 5:9] = 2 ** 24
        path = self.nrrd("wide.nrrd", samples)
        out = self.folder / "wide.ply"
        self.assertTrue(self.mesh(path, "--labels", out=out)["closed"])
        self.assertEqual(set(read_ply(out)[3]), {2 ** 24, 2 ** 24 + 1})

    def test_surfaces_end_at_the_faces_of_the_volume(self):
        samples = np.broadcast_to(np.arange(9, dtype="u1"), (5, 6, 9)).copy()
        path = self.nrrd("ramp.nrrd", samples)
        report = self.mesh(path, "--isovalue", "4")
        self.assertEqual((report["vertices"], report["triangles"]), (30, 40))
        self.assertFalse(report["closed"])
        self.assertIsNone(report["volume"])
        self.assertAlmostEqual(report["area"], 20)

    def test_what_is_not_finite_makes_no_triangle(self):
        z, y, x = np.mgrid[:20, :20, :20].astype("f4")
        samples = (6 - np.sqrt((x - 9) ** 2 + (y - 9) ** 2 + (z - 9) ** 2)).astype("f4")
        whole = self.mesh(self.nrrd("whole.nrrd", samples), "--isovalue", "0.25")
        samples[9, 9, 15] = np.nan
        report = self.mesh(self.nrrd("nan.nrrd", samples), "--isovalue", "0.25")
        self.assertFalse(report["closed"])
        self.assertLess(report["triangles"], whole["triangles"])
        self.assertGreater(report["triangles"], whole["triangles"] - 60)

    def test_small_volumes_have_empty_surfaces(self):
        for shape in ((1, 1, 1), (1, 4, 5), (4, 1, 5), (4, 5, 1)):
            path = self.nrrd("small.nrrd", np.arange(np.prod(shape), dtype="u1").reshape(shape))
            for end in ("ply", "obj", "stl"):
                report = self.mesh(path, "--isovalue", "2", out=self.folder / f"small.{end}")
                self.assertEqual((report["vertices"], report["triangles"]), (0, 0))
                self.assertTrue(report["closed"])
                self.assertEqual((report["area"], report["volume"]), (0, 0))
                # Of labels every sample but the 0 has a volume.
                report = self.mesh(path, "--labels", out=self.folder / f"small.{end}")
                self.assertTrue(report["closed"])
                self.assertAlmostEqual(report["volume"], np.prod(shape) - 1, delta=0.05 * np.prod(shape))

    def test_threads_and_repetitions_change_no_byte(self):
        files = []
        for threads in (1, 2, 7):
            for words in (("--isovalue", "0.4"), ("--labels",)):
                out = self.folder / f"threads_{threads}_{len(words)}.ply"
                report = self.mesh("phantom:shepp-logan:40", *words, "--threads", threads, "--repeat", "2", out=out)
                self.assertEqual(len(report["measured"]["seconds"]), 2)
                files.append(out.read_bytes())
        self.assertEqual(files[0::2], files[:1] * 3)
        self.assertEqual(files[1::2], files[1:2] * 3)

    def test_what_makes_no_sense_is_refused(self):
        volume_file = self.nrrd("volume.nrrd", np.zeros((4, 4, 4), "u1"))
        iso = ("--isovalue", "1")
        cases = [
            ((volume_file, "-o", "null:"), 2, "expected --isovalue v, or --labels"),
            ((volume_file, "-o", "null:", *iso, "--labels"), 2, "leave out one"),
            ((volume_file, "-o", "null:", "--isovalue", "nan"), 2, "--isovalue"),
            ((volume_file, "-o", "null:", "--isovalue", "many"), 2, "--isovalue"),
            ((volume_file, "-o", self.folder / "a.png", *iso), 2, ".ply, .obj or .stl"),
            ((volume_file, "-o", "-", *iso), 2, ".ply, .obj or .stl"),
            ((volume_file, "-o", self.folder / "none" / "a.ply", *iso), 2, "there is no folder"),
            ((volume_file, *iso), 2, "-o"),
            ((volume_file, "-o", "null:", *iso, "--rotate", "1,2,3"), 2, "--rotate"),
            (("phantom:checker:8", "-o", "null:", *iso), 2, "is an image"),
            (("describe:8x8x8:u8", "-o", "null:", *iso), 2, "no samples"),
            ((self.folder / "missing.nrrd", "-o", "null:", *iso), 4, "missing.nrrd"),
            ((volume_file, "-o", "null:", *iso, "--via", "surface.nets"), 3, "surface.nets"),
        ]
        for words, code, message in cases:
            with self.subTest(words=words):
                done = self.run_it("mesh", *words, code=code)
                self.assertIn(message, done.stderr.decode().lower())
        done = self.run_it("render", volume_file, "-o", self.folder / "a.ply", code=2)
        self.assertIn("edgewise mesh", done.stderr.decode())

    def test_a_failure_has_a_report(self):
        done = self.run_it("mesh", self.folder / "missing.nrrd", "-o", "null:", "--isovalue", "1", "--json", "-", code=4)
        self.assertEqual(json.loads(done.stdout)["error"]["code"], 4)

    def test_an_older_file_is_replaced_and_kept_where_writing_fails(self):
        out = self.folder / "old.ply"
        out.write_text("old")
        self.run_it("mesh", self.folder / "missing.nrrd", "-o", out, "--isovalue", "1", code=4)
        self.assertEqual(out.read_text(), "old")
        self.mesh("phantom:sphere:16", "--isovalue", "0.5", out=out)
        self.assertTrue(out.read_bytes().startswith(b"ply\n"))


if __name__ == "__main__":
    unittest.main()
