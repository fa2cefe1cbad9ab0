"""Surfaces far from the origin keep their shape. Needs EDGEWISE."""

import json
import struct
import unittest

import numpy as np
from running import Running

FAR = {"metres": ((1e6, -2e6, 3e5), .5), "utm": ((4.5e8 + .25, 5.4e9 - .125, 321.5), 250.0), "stage": ((123456.789, 98765.4321, -5e4), .0005)}


def write_metaimage(path, a, origin, spacing, direction=(1, 0, 0, 0, 1, 0, 0, 0, 1)):
    head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nOffset = {' '.join(map(repr, origin))}\n"
            f"TransformMatrix = {' '.join(map(repr, direction))}\nElementSpacing = {' '.join(map(repr, spacing))}\n"
            f"DimSize = {' '.join(map(str, a.shape[::-1]))}\nElementType = MET_FLOAT\n{'AnatomicalOrientation = RAI' + chr(10) if direction[0] else ''}ElementDataFile = LOCAL\n")
    path.write_bytes(head.encode() + a.astype("<f4").tobytes())


def read_ply(path):
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    kind = "<f8" if "property double x" in lines else "<f4"
    fields = np.dtype([("place", kind, 3), ("normal", "<f4", 3)])
    return np.frombuffer(body, fields, count)["place"].astype(float), kind


def read_obj(path):
    return np.array([[float(x) for x in line.split()[1:]] for line in path.read_text().split("\n") if line.startswith("v ")])


def read_stl(path):
    data = path.read_bytes()
    count, = struct.unpack_from("<I", data, 80)
    one = np.dtype([("normal", "<f4", 3), ("places", "<f4", (3, 3)), ("rest", "<u2")])
    words = data[:80].rstrip(b"\0").decode().split()
    add = np.array([float(x) for x in words[2:]]) if len(words) > 2 else np.zeros(3)
    return np.frombuffer(data, one, count, 84)["places"].astype(float).reshape(-1, 3) + add, add


class FarMesh(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        z, y, x = np.mgrid[0:14, 0:16, 0:18].astype(float)
        cls.ball = 6 - np.sqrt((x - 8.3) ** 2 + (y - 7.6) ** 2 + (z - 6.9) ** 2)

    def mesh(self, origin, spacing, ending, *more, direction=(1, 0, 0, 0, 1, 0, 0, 0, 1)):
        source, out = self.folder / "ball.mha", self.folder / f"ball.{ending}"
        write_metaimage(source, self.ball, origin, (spacing,) * 3, direction)
        done = self.run_it("mesh", source, "-o", out, "--isovalue", "0", *more, "--json", "-")
        return out, json.loads(done.stdout)

    def test_all_formats_hold_the_shape(self):
        near, _ = self.mesh((0, 0, 0), 1, "ply")
        shape, kind = read_ply(near)
        self.assertEqual(kind, "<f4", "near the origin files are as they were")
        turned = (0, 1, 0, -1, 0, 0, 0, 0, 1)
        for name, (origin, spacing) in FAR.items():
            for direction in ((1, 0, 0, 0, 1, 0, 0, 0, 1), turned):
                with self.subTest(far=name, direction=direction):
                    # MetaImage lists where x, y and z point, one after another.
                    expected = (shape @ np.array(direction, float).reshape(3, 3)) * spacing + origin
                    # f64 at the origin's size, and f32 at the volume's.
                    enough = 1e-5 * spacing + 4e-16 * np.abs(origin).max() * 4
                    out, report = self.mesh(origin, spacing, "ply", direction=direction)
                    places, kind = read_ply(out)
                    self.assertEqual(kind, "<f8")
                    self.assertLess(np.abs(places - expected).max(), enough)
                    self.assertEqual(report["warnings"], [])
                    places = read_obj(self.mesh(origin, spacing, "obj", direction=direction)[0])
                    self.assertLess(np.abs(places - expected).max(), enough)
                    out, report = self.mesh(origin, spacing, "stl", direction=direction)
                    places, add = read_stl(out)
                    corners = np.unique(np.round((places - origin) / spacing, 3), axis=0)
                    self.assertEqual(len(corners), len(np.unique(np.round((expected - origin) / spacing, 3), axis=0)))
                    self.assertTrue(any("to be added" in w for w in report["warnings"]), report["warnings"])
                    self.assertGreater(np.abs(add).max(), 0)

    def test_area_and_volume_do_not_depend_on_the_place(self):
        _, near = self.mesh((0, 0, 0), 1, "ply")
        for name, (origin, spacing) in FAR.items():
            _, far = self.mesh(origin, spacing, "ply")
            # Vertices in f32, at most 18 samples from the local origin: 1e-6 of a sample each.
            self.assertAlmostEqual(far["volume"] / spacing ** 3 / near["volume"], 1, delta=1e-5, msg=name)
            self.assertAlmostEqual(far["area"] / spacing ** 2 / near["area"], 1, delta=1e-5, msg=name)
            self.assertTrue(far["closed"])

    def test_labels_likewise(self):
        source, out = self.folder / "labels.mha", self.folder / "labels.obj"
        for origin, spacing in ((0, 0, 0), 1.0), FAR["metres"]:
            write_metaimage(source, np.where(self.ball > 0, 3, 0), origin, (spacing,) * 3)
            self.run_it("mesh", source, "-o", out, "--labels")
            places = (read_obj(out) - origin) / spacing
            if origin[0] == 0:
                near = places
        self.assertLess(np.abs(places - near).max(), 1e-5)

    def test_scans_of_patients_are_written_as_they_were(self):
        for origin, spacing in (((-250.5, 120.25, -1800.0), .5), ((90.0, -126.0, -72.0), .01)):
            self.assertEqual(read_ply(self.mesh(origin, spacing, "ply")[0])[1], "<f4")
            out, report = self.mesh(origin, spacing, "stl")
            self.assertEqual((out.read_bytes()[:80].rstrip(b"\0"), report["warnings"]), (b"edgewise", []))

    def test_pictures_do_not_depend_on_the_place(self):
        pictures = []
        for origin, spacing in ((0, 0, 0), 1.0), ((1e6, -2e6, 3e5), 1.0):
            source, out = self.folder / "ball.mha", self.folder / "ball.png"
            write_metaimage(source, self.ball, origin, (spacing,) * 3)
            self.run_it("render", source, "-o", out, "--mode", "surface", "--isovalue", "0", "--size", "40x40")
            pictures.append(out.read_bytes())
        self.assertEqual(*pictures)


if __name__ == "__main__":
    unittest.main()
