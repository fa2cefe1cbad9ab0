"""Files as programs of all kinds write them, read through the command: values, sizes, spacing, unit, channels, times. The files come
from format_writers.py, which follows the formats' descriptions and shares nothing with the readers. Needs EDGEWISE."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import format_writers as w  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
TYPES = {"uint8": "u1", "int8": "i1", "uint16": "<u2", "int16": "<i2", "uint32": "<u4", "int32": "<i4", "float": "<f4", "double": "<f8", "int64": "<i8"}


def nrrd_and_facts(path):
    """What the command writes: attached, raw, little endian. Values, lengths of the steps along x, y, z, their unit, and what else
    `info` calls by these names."""
    head, data = path.read_bytes().split(b"\n\n", 1)
    fields = dict(re.findall(r"^([a-z ]+): (.*)$", head.decode(), re.M))
    sizes = [int(n) for n in fields["sizes"].split()]
    if "space directions" in fields:
        steps = [[float(n) for n in step.split(",")] for step in re.findall(r"\(([^)]*)\)", fields["space directions"])]
        spacing = [np.linalg.norm(step) for step in steps]
    else:
        spacing = [float(n) for n in fields["spacings"].split() if n != "nan"]
    units = set(re.findall(r'"([^"]*)"', fields.get("space units", fields.get("units", "")))) - {""}
    assert len(units) < 2, units
    several = fields.get("kinds", "domain").split()[0] != "domain"
    extent = sizes[several:]
    more = {"extent": extent, "kind": "volume" if len(extent) == 3 else "image", "channels": sizes[0] if several else 1}
    return np.frombuffer(data, TYPES[fields["type"]]).reshape(sizes[::-1]), spacing, units.pop() if units else None, more


def read_nrrd(path):
    """The values alone."""
    return nrrd_and_facts(path)[0]


class Said:
    """What `info` says of a file, which is asked once somebody looks: a command takes longer to start than to read a small file."""

    def __init__(self, ask):
        self.ask, self.answer = ask, None

    def __getitem__(self, key):
        self.answer = self.answer or self.ask()
        return self.answer[key]


class Formats(unittest.TestCase):
    asked = set()

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.env = {**os.environ, "XDG_CONFIG_HOME": str(cls.folder / "c"), "XDG_CACHE_HOME": str(cls.folder / "k")}

    def put(self, name, data):
        path = self.folder / name
        path.write_bytes(data)
        return path

    def run_it(self, *words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=100, env=self.env)
        self.assertEqual(done.returncode, code, f"{words}: {done.stderr}")
        return done

    def info(self, path, *options):
        return json.loads(self.run_it("info", path, "--json", "-", *options).stdout)

    def values(self, path, *options):
        out = self.folder / "out.nrrd"
        self.run_it("warp", path, "-o", out, *options)
        return nrrd_and_facts(out)[0]

    def check(self, name, data, expected, spacing=None, unit="mm", options=(), **more):
        """expected: values, slowest axis first; these, spacing, unit, extent, kind and channels of what is written, which keeps them.
        more: keys of `info` and what they hold; those that the written file has as well are asked once for each ending in a test.
        Returns what `info` says, as long as the file is there."""
        path, out = self.put(name, data), self.folder / "out.nrrd"
        said = Said(lambda: self.info(path, *(o for o in options if o != "--labels")))
        self.run_it("warp", path, "-o", out, *options)
        got, steps, of, written = nrrd_and_facts(out)
        if "--channel" in options:
            del written["channels"]  # of which one was asked for
        np.testing.assert_array_equal(got, expected, err_msg=name)
        if spacing is not None:
            np.testing.assert_allclose(steps, spacing, rtol=1e-6, err_msg=name)
            self.assertEqual(of, unit, name)
        ending = (self.id(), name.split(".")[-1], *more)
        for key, value in more.items():
            if key in written:
                self.assertEqual(written[key], value, f"{name}: {key}")
            if key not in written or ending not in self.asked:
                self.assertEqual(said[key], value, f"{name}: {key}")
        self.asked.add(ending)
        return said

    def refused(self, name, data, *why, options=(), code=4):
        path = self.put(name, data)
        text = self.run_it("info", path, *options, code=code).stderr
        for word in why:
            self.assertIn(word, text, name)
        self.assertNotRegex(text, r"0x[0-9a-f]{6}", name)


class Integers64(Formats):
    """They are read as the smallest type that holds each of them, and a warning says so."""

    CASES = [  # values, type
        (w.ramp(3, 4, 5, dtype="i8"), "i16"),
        (w.ramp(3, 4, 5, dtype="i8") // 4, "u8"),
        (w.ramp(3, 4, 5, dtype="i8") * 120 + 5000, "u16"),
        (w.ramp(3, 4, 5, dtype="i8") - 400, "i16"),
        (w.ramp(3, 4, 5, dtype="i8") // 8 - 100, "i8"),
        (w.ramp(3, 4, 5, dtype="u8") * 16, "i16"),
    ]

    def test_every_format(self):
        for i, (v, kind) in enumerate(self.CASES):
            n = v.size
            if i > 1:  # the rest is one code for all formats
                self.check("a.nii", w.nifti(v), v, type=kind)
                self.check("a.nrrd", w.nrrd(v, order=">"), v, type=kind)
                continue
            files = {
                "a.nii": w.nifti(v), "b.nii": w.nifti(v, order=">"), "a.mha": w.metaimage(v), "b.mha": w.metaimage(v, packed=True),
                "a.nrrd": w.nrrd(v), "b.nrrd": w.nrrd(v, order=">"), "c.nrrd": w.nrrd(v, encoding="ascii"),
                "d.nrrd": w.nrrd(v, encoding="hex"), "e.nrrd": w.nrrd(v, encoding="bzip2"),
                "a.vtk": w.vtk(v.shape, [f"POINT_DATA {n}", w.vtk_array("SCALARS", "s", v)]),
                "b.vtk": w.vtk(v.shape, [f"POINT_DATA {n}", w.vtk_array("SCALARS", "s", v, False)], binary=False),
                "a.vti": w.vti(v.shape, v), "b.vti": w.vti(v.shape, v, form="raw", wide=True),
                "a.tif": w.tiff([w.tiff_page(p) for p in v]),
                "b.tif": w.tiff([w.tiff_page(p, ">", packed=True, tile=16) for p in v], ">", big=True),
                "c.vti": w.vti(v.shape, v, form="base64", packed=True, order=">"), "d.vti": w.vti(v.shape, v, form="binary"),
            }
            for name, data in files.items():
                with self.subTest(name, case=i):
                    said = self.check(name, data, v, type=kind)
                    self.assertTrue(any("64-bit" in text for text in said["warnings"]), said["warnings"])

    def test_json_of_a_raw_file(self):
        v = w.ramp(3, 4, 5, dtype="<i8")
        self.put("a.raw", v.tobytes())
        self.check("a.json", b'{"data": "a.raw", "dims": [5, 4, 3], "type": "int64", "spacing": [1, 2, 3]}', v, (1, 2, 3), None)

    def test_what_no_type_holds_is_said(self):
        v = np.zeros((3, 4, 5), "i8")
        v[1, 2, 3] = 2**40
        said = self.info(self.put("a.nii", w.nifti(v)))
        self.assertEqual(said["type"], "f64")
        self.assertFalse(any("rounds" in text for text in said["warnings"] if "64-bit" in text))
        v[1, 2, 3] = 2**53 + 1
        self.assertTrue(any("rounds" in text for text in self.info(self.put("b.nii", w.nifti(v)))["warnings"]))
        v[1, 2, 3] = -2**63
        self.info(self.put("c.nii", w.nifti(v)))
        self.info(self.put("d.nii", w.nifti(np.full((3, 4, 5), 2**64 - 1, "u8"))))
        # Labels are kept bit for bit.
        v[1, 2, 3] = 2**53 + 1
        kept = self.folder / "kept.nrrd"
        self.run_it("warp", self.put("e.nii", w.nifti(v, intent=1002)), "-o", kept, "--quiet")
        samples = kept.read_bytes().split(b"\n\n", 1)[1]
        np.testing.assert_array_equal(np.frombuffer(samples, "<i8").reshape(v.shape), v)
        v[1, 2, 3] = 2**53 - 1
        self.check("f.nii", w.nifti(v, intent=1002), v, type="f64")


class Nifti(Formats):
    def test_units_become_millimetres(self):
        v = w.ramp(3, 4, 5)
        for units, factor in ((0, 1), (1, 1000), (2, 1), (3, 1e-3), (3 + 8, 1e-3)):
            self.check("a.nii", w.nifti(v, (2, 3, 4), units=units), v, np.array((2, 3, 4)) * factor, None if units == 0 else "mm")

    def test_a_plane_of_a_volume(self):
        v = w.ramp(1, 4, 5)
        said = self.check("a.nii", w.nifti(v, (2, 3, 0)), v, (2, 3, 1), kind="volume")
        self.assertTrue(any("thick" in text for text in said["warnings"]))
        # The third column of its sform is empty: a perpendicular one stands for it.
        said = self.check("b.nii", w.nifti(v, (2, 3, 0), np.array([[2, 0, 0, 5], [0, 0, 0, 6], [0, 3, 0, 7]])), v, (2, 3, 1))
        np.testing.assert_allclose(said["origin"], (-5, -6, 7))
        np.testing.assert_allclose(np.abs(said["direction"][2]), (0, 1, 0), atol=1e-9)
        self.check("c.nii", w.nifti(v[0], (2, 3)), v[0], (2, 3), kind="image")

    def test_a_sheared_sform_is_kept(self):
        v = w.ramp(3, 4, 5)
        said = self.check("a.nii", w.nifti(v, (1, 1, 1.25**.5), np.array([[1, 0, 0, 0], [0, 1, .5, 0], [0, 0, 1, 0]])), v, (1, 1, 1.25**.5))
        np.testing.assert_allclose(said["direction"][2], np.array((0, -.5, 1)) / 1.25**.5, atol=1e-6)

    def test_refusals(self):
        v = np.zeros((3, 4, 5), "u1")
        for code, bits, word in ((32, 64, "complex"), (1792, 128, "complex"), (1536, 128, "128 bits"), (1, 1, "one bit")):
            self.refused("a.nii", w.nifti(v, code=code, bits=bits), "datatype", word)


class Nrrd(Formats):
    def test_encodings(self):
        for kind in ("<i2", "u1", "<f4"):
            v = w.ramp(3, 4, 5, dtype=kind)
            for encoding in ("raw", "ascii", "txt", "hex", "gz", "gzip", "bz2", "bzip2"):
                for order in "<>" if kind == "<i2" else ">":
                    with self.subTest(kind=kind, encoding=encoding, order=order):
                        self.check("a.nrrd", w.nrrd(v, encoding=encoding, order=order), v)
                        if kind != "<i2" or order == "<":
                            continue
                        head, data = w.nrrd(v, encoding=encoding, order=order, detached="b.dat")
                        self.put("b.dat", data)
                        self.check("b.nhdr", head, v)

    def test_skips(self):
        v = w.ramp(3, 4, 5)
        for encoding, before, inside, skip in (("raw", b"a\nb\nxyz", b"", 3), ("hex", b"a\nb\n###", b"", 3), ("ascii", b"a\nb\n###", b"", 3),
                                               ("gzip", b"a\nb\n", b"xyz", 3), ("bzip2", b"a\nb\n", b"xyz", 3)):
            head, data = w.nrrd(v, "line skip: 2", f"byte skip: {skip}", encoding=encoding, detached="c.dat")
            if inside:
                data = w.encoded(np.frombuffer(inside + v.tobytes(), "u1"), encoding)
            self.put("c.dat", before + data)
            with self.subTest(encoding):
                self.check("c.nhdr", head, v)

    def test_units(self):
        v, colours = w.ramp(3, 4, 5), w.ramp(3, 4, 5, 3, dtype="u1")
        directions = "space directions: (2,0,0) (0,3,0) (0,0,4)"
        for unit, factor in (("mm", 1), ("microns", 1e-3), ("micron", 1e-3), ("um", 1e-3), ("µm", 1e-3), ("μm", 1e-3), ("nm", 1e-6),
                             ("cm", 10), ("m", 1000), ("micrometers", 1e-3), ("Millimeters", 1)):
            size = np.array((2, 3, 4)) * factor
            with self.subTest(unit):
                self.check("a.nrrd", w.nrrd(v, "space: LPS", directions, f'space units: "{unit}" "{unit}" "{unit}"'), v, size)
                self.check("c.nrrd", w.nrrd(v, "spacings: 2 3 4", f'units: "{unit}" "{unit}" "{unit}"'), v, size)
                if unit != "um":
                    continue
                self.check("b.nrrd", w.nrrd(v, "space dimension: 3", directions, f'space units: "{unit}" "{unit}" "{unit}"'), v, size)
                self.check("d.nrrd", w.nrrd(colours, "spacings: nan 2 3 4", f'units: "" "{unit}" "{unit}" "{unit}"',
                                            "kinds: RGB-color domain domain domain"), colours, size, channels=3)
        # Each axis its own; of a space, each of its directions.
        self.check("a.nrrd", w.nrrd(v, "spacings: 2 3 4", 'units: "um" "um" "mm"'), v, (2e-3, 3e-3, 4))
        self.check("a.nrrd", w.nrrd(v, "space dimension: 3", "space directions: (0,0,2) (0,3,0) (4,0,0)", 'space units: "um" "um" "mm"'),
                   v, (2, 3e-3, 4e-3))

    def test_a_unit_that_is_not_known_is_none(self):
        v = w.ramp(3, 4, 5)
        for fields in (["space: LPS", "space directions: (2,0,0) (0,3,0) (0,0,4)", 'space units: "furlong" "furlong" "furlong"'],
                       ["spacings: 2 3 4", 'units: "furlong" "furlong" "furlong"'], ["spacings: 2 3 4", 'units: "mm" "mm" "s"']):
            said = self.check("a.nrrd", w.nrrd(v, *fields), v, (2, 3, 4), None)
            self.assertTrue(any("unit" in text for text in said["warnings"]))
            self.check("a.nrrd", w.nrrd(v, *fields), v, (2e-3, 3e-3, 4e-3), "mm", ("--input-unit", "um"))
        # A patient's space that says nothing is in millimetres; so are spacings without a unit in nothing.
        self.check("a.nrrd", w.nrrd(v, "space: RAS", "space directions: (2,0,0) (0,3,0) (0,0,4)"), v, (2, 3, 4), "mm")
        self.check("a.nrrd", w.nrrd(v, "spacings: 2 3 4"), v, (2, 3, 4), None)

    def test_axes(self):
        vectors = w.ramp(3, 4, 5, 3)
        rows = "(2,0,0) (0,3,0) (0,0,4)"
        for none in ("none", "(nan,nan,nan)"):
            self.check("a.nrrd", w.nrrd(vectors, "space: LPS", f"space directions: {none} {rows}", "kinds: vector domain domain domain"),
                       vectors, (2, 3, 4), channels=3)
        last = np.ascontiguousarray(np.moveaxis(vectors, -1, 0))
        self.check("a.nrrd", w.nrrd(last, "space: LPS", f"space directions: {rows} none", "kinds: domain domain domain list"),
                   vectors, (2, 3, 4), channels=3)
        times = w.ramp(2, 3, 4, 5)
        self.check("a.nrrd", w.nrrd(times, "kinds: domain domain domain time"), times[1], times=2, options=("--time", "1"))
        v = w.ramp(3, 4, 5)
        self.check("a.nrrd", w.nrrd(v, "axis mins: 0 0 0", "axis maxs: 10 9 8", "centers: cell node cell"), v, (2, 3, 8 / 3), None)
        self.refused("a.nrrd", w.nrrd(w.ramp(3, 4, 5, 2), "kinds: complex domain domain domain"), "complex")

    def test_refusals(self):
        v = w.ramp(3, 4, 5)
        self.refused("a.nrrd", w.nrrd(v, encoding="hex")[:-7], "short data")
        self.refused("a.nrrd", w.nrrd(v, encoding="hex")[:-7] + b"g" * 7, "hexadecimal data hold")
        whole = w.nrrd(v, encoding="bzip2")
        for cut in (1, 20, 60):
            self.refused("a.nrrd", whole[:-cut], "a.nrrd")
        self.refused("a.nrrd", whole[:-60] + b"\0" * 60, "damaged")
        self.refused("a.nrrd", whole.replace(b"sizes: 5 4 3", b"sizes: 90000 90000 3"), "do not fit")
        self.refused("a.nrrd", w.nrrd(v.astype("i8"), encoding="ascii").replace(b"\n7\n", b"\n99999999999999999999\n"), "64 bits")


class MetaImage(Formats):
    def test_kinds(self):
        for kind in META_TYPES:
            v = w.ramp(3, 4, 5, dtype=kind)
            for form in ({}, {"packed": True}, {"text": True}):
                with self.subTest(kind, **form):
                    self.check("a.mha", w.metaimage(v, "ElementSpacing = 1 2 3", **form), v, (1, 2, 3))
        v = w.ramp(3, 4, 5, dtype="i4")
        self.check("a.mha", w.metaimage(v).replace(b"MET_INT", b"MET_LONG"), v)
        c = w.ramp(3, 4, 5, 3, dtype="u1")
        self.check("a.mha", w.metaimage(c, channels=3), c, channels=3)

    def test_units(self):
        v = w.ramp(3, 4, 5)
        for unit, factor in (("mm", 1), ("um", 1e-3), ("cm", 10), ("?", 1)):
            self.check("a.mha", w.metaimage(v, "ElementSpacing = 1 2 3", f"DistanceUnits = {unit}"), v, np.array((1, 2, 3)) * factor)
        said = self.check("a.mha", w.metaimage(v, "DistanceUnits = ell"), v, (1, 1, 1), None)
        self.assertTrue(any("ell" in text for text in said["warnings"]))


META_TYPES = ["u1", "i1", "<u2", "<i2", "<f4"]


class Vtk(Formats):
    def test_scalars(self):
        for kind in META_TYPES:
            v = w.ramp(3, 4, 5, dtype=kind)
            for binary in (True, False):
                with self.subTest(kind, binary=binary):
                    data = w.vtk(v.shape, ["POINT_DATA 60", w.vtk_array("SCALARS", "s", v, binary)], (1, 2, 3), binary=binary)
                    self.check("a.vtk", data, v, (1, 2, 3), None)
        self.check("a.vtk", w.vtk((3, 4, 5), ["POINT_DATA 60", w.vtk_array("SCALARS", "s", w.ramp(3, 4, 5))]).replace(b"\nLOOKUP_TABLE default", b""),
                   w.ramp(3, 4, 5))

    def test_fields(self):
        v, other, long = w.ramp(3, 4, 5), w.ramp(3, 4, 5, dtype="f4", first=3), w.ramp(1, 1, 7, dtype="f8")
        colour = w.ramp(3, 4, 5, 3, dtype="u1")
        for binary in (True, False):
            field = lambda **arrays: w.vtk_field(arrays, binary)  # noqa: E731
            file = lambda *parts: w.vtk(v.shape, parts, binary=binary)  # noqa: E731
            with self.subTest(binary=binary):
                self.check("a.vtk", file("POINT_DATA 60", field(ct=v)), v)
                self.check("a.vtk", file("POINT_DATA 60", field(ct=v, other=other)), v)
                # Facts about the whole, before the points' data and among them.
                self.check("a.vtk", file(field(TIME=long), "POINT_DATA 60", field(few=long, ct=v)), v)
                # What is called scalars goes before fields.
                self.check("a.vtk", file("POINT_DATA 60", field(other=other), w.vtk_array("SCALARS", "s", v, binary)), v)
                self.check("a.vtk", file("POINT_DATA 60", w.vtk_array("VECTORS", "v", colour.astype("f4"), binary),
                                         w.vtk_array("SCALARS", "s", v, binary)), v)
                self.check("a.vtk", file("POINT_DATA 60", field(rgb=colour)), colour, channels=3)
                self.check("a.vtk", file("POINT_DATA 60", w.vtk_field({"a": long, "ct": v}, binary, meta=True)), v)
                self.check("a.vtk", file("POINT_DATA 60", w.vtk_array("VECTORS", "v", colour, binary)), colour, channels=3)

    def test_cells(self):
        cells, points = w.ramp(2, 3, 4), w.ramp(3, 4, 5, first=1)
        for binary in (True, False):
            in_cells = ["CELL_DATA 24", w.vtk_array("SCALARS", "c", cells, binary)]
            said = self.check("a.vtk", w.vtk((3, 4, 5), in_cells, (1, 2, 3), (10, 20, 30), binary), cells, (1, 2, 3), None)
            np.testing.assert_allclose(said["origin"], (10.5, 21, 31.5))
            self.check("a.vtk", w.vtk((3, 4, 5), ["CELL_DATA 24", w.vtk_field({"c": cells}, binary)], binary=binary), cells)
            both = in_cells + ["POINT_DATA 60", w.vtk_field({"p": points}, binary)]
            said = self.check("a.vtk", w.vtk((3, 4, 5), both, (1, 2, 3), (10, 20, 30), binary), points)
            np.testing.assert_allclose(said["origin"], (10, 20, 30))
        flat = w.ramp(1, 3, 4)
        said = self.check("a.vtk", w.vtk((1, 4, 5), ["CELL_DATA 12", w.vtk_array("SCALARS", "c", flat)], (1, 2, 3)), flat)
        np.testing.assert_allclose(said["origin"], (.5, 1, 0))

    def test_refusals(self):
        v = w.ramp(3, 4, 5)
        good = w.vtk(v.shape, ["POINT_DATA 60", w.vtk_field({"ct": v})])
        self.refused("a.vtk", good[:-20], "short data")
        self.refused("a.vtk", good.replace(b"ct 1 60 short", b"ct 1 4611686018427387904 short"), "a.vtk")
        self.refused("a.vtk", good.replace(b"ct 1 60 short", b"ct -1 60 short"), "a.vtk")
        self.refused("a.vtk", good.replace(b"ct 1 60 short", b"ct 1 60 string"), "string")
        self.refused("a.vtk", good.replace(b"POINT_DATA 60", b"POINT_DATA 61"), "POINT_DATA")
        self.refused("a.vtk", w.vtk(v.shape, []), "no array")
        for kind in (b"RECTILINEAR_GRID", b"STRUCTURED_GRID", b"POLYDATA"):
            self.refused("a.vtk", good.replace(b"STRUCTURED_POINTS", kind), kind.decode(), "STRUCTURED_POINTS")
        text = w.vtk(v.shape, ["POINT_DATA 60", w.vtk_field({"ct": v}, False)], binary=False)
        self.refused("a.vtk", text.replace(b"994 ", b"").replace(b"7 ", b""), "a.vtk")

    def test_vti(self):
        cells = w.ramp(2, 3, 4)
        for kind in META_TYPES:
            v = w.ramp(3, 4, 5, dtype=kind)
            for form in ("ascii", "binary", "raw", "base64"):
                for packed, order, wide in ((False, "<", False), (True, ">", True)):
                    if kind != "<i2" and form != "binary":
                        continue
                    with self.subTest(kind, form=form, packed=packed):
                        options = dict(form=form, packed=packed and form != "ascii", order=order, wide=wide)
                        self.check("a.vti", w.vti(v.shape, v, spacing="1 2 3", **options), v, (1, 2, 3), None)
                        self.check("b.vti", w.vti(v.shape, v, cells, **options), v)
                        said = self.check("c.vti", w.vti(v.shape, None, cells, spacing="1 2 3", origin="10 20 30", **options), cells)
                        np.testing.assert_allclose(said["origin"], (10.5, 21, 31.5))
        rgb = w.ramp(3, 4, 5, 3, dtype="u1")
        self.check("a.vti", w.vti((3, 4, 5), rgb, form="raw"), rgb, channels=3)
        self.refused("a.vti", w.vti((3, 4, 5)), "no DataArray")


class Mrc(Formats):
    def test_modes(self):
        for mode, kind in ((0, "i1"), (1, "<i2"), (2, "<f4"), (6, "<u2"), (12, "<f2")):
            v = (w.ramp(3, 4, 5, dtype="<i2") % 120).astype(kind)
            if kind == "i1":
                v -= 60
            for order in "<>":
                for stamp, extended in ((True, b""), (False, b"x" * 512)):
                    with self.subTest(mode=mode, order=order, stamp=stamp):
                        data = w.mrc(v, mode, order=order, stamp=stamp, extended=extended)
                        self.check("a.mrc", data, v.astype("<f4") if mode == 12 else v, (1e-7,) * 3)
        v = w.ramp(3, 4, 5, dtype="u1")
        said = self.check("a.mrc", w.mrc(v, 0), v)
        self.assertTrue(any("unsigned" in text for text in said["warnings"]))
        self.check("a.mrc", w.mrc(v, 0, imod=0, largest=100), v, type="u8")
        self.check("a.mrc", w.mrc(v, 0, imod=1, largest=255), v.astype("i1"), type="i8")
        rgb = w.ramp(3, 4, 5, 3, dtype="u1")
        self.check("a.mrc", w.mrc(rgb, 16), rgb, channels=3)

    def test_geometry(self):
        v = w.ramp(3, 4, 5)
        cell, parts = (100, 160, 270), (10, 8, 9)  # 10, 20 and 30 angstrom along X, Y and Z
        self.check("a.map", w.mrc(v, 1, cell, parts), v, (1e-6, 2e-6, 3e-6), extent=[5, 4, 3])
        for axes in ((1, 2, 3), (2, 1, 3), (3, 2, 1), (2, 3, 1)):
            said = self.check("a.ccp4", w.mrc(v, 1, cell, parts, axes, start=(1, 2, 3)), v, [(1e-6, 2e-6, 3e-6)[a - 1] for a in axes])
            for k, axis in enumerate(axes):
                np.testing.assert_allclose(said["direction"][k], np.eye(3)[axis - 1], atol=1e-9)
                self.assertAlmostEqual(said["origin"][axis - 1] * 1e6, (k + 1) * axis, places=9)
        said = self.check("a.mrc", w.mrc(v, 1, cell, parts, origin=(10, -20, 30), start=(1, 2, 3)), v)
        np.testing.assert_allclose(np.array(said["origin"]) * 1e7, (10, -20, 30))
        said = self.check("a.mrc", w.mrc(v, 1, (0, 0, 0)), v, (1, 1, 1), None)
        self.assertTrue(said["warnings"])
        said = self.check("a.mrc", w.mrc(v, 1, angles=(90, 90, 120)), v, (1e-7,) * 3)
        np.testing.assert_allclose(said["direction"][1], (-.5, .75**.5, 0), atol=1e-6)
        # A mark in the header is enough, whatever the name.
        self.check("a.volume", w.mrc(v, 1), v, kind="volume")
        self.check("a.mrcs", w.mrc(v[:1], 1, group=0), v[0], kind="image")
        self.check("a.mrc", w.mrc(w.ramp(6, 4, 5), 1, intervals=(5, 4, 3), group=401), w.ramp(6, 4, 5)[3:], times=2, options=("--time", 1))

    def test_refusals(self):
        v = w.ramp(3, 4, 5)
        for mode, word in ((3, "complex"), (4, "complex"), (101, "four bits"), (7, "MODE"), (-1, "MODE")):
            self.refused("a.mrc", w.mrc(v, mode), "MODE", word)
        self.refused("a.mrc", w.mrc(v, 1)[:-1], "short data")
        self.refused("a.mrc", w.mrc(v, 1)[:1000], "too short")
        for at, text, word in ((0, b"\0\0\0\0", "NX"), (8, b"\xff\xff\xff\xff", "NZ"), (0, b"\xff\xff\xff\x7f", "short data"),
                               (64, b"\2\0\0\0", "MAPC"), (64, b"\x09\0\0\0", "MAPC"), (92, b"\xff\xff\xff\x7f", "NSYMBT"),
                               (92, b"\xff\xff\xff\xff", "NSYMBT"), (52, b"\0\0\xc0\x7f", "CELLB"), (60, b"\0\0\x34\x43", "CELLB")):
            data = bytearray(w.mrc(v, 1))
            data[at:at + 4] = text
            self.refused("a.mrc", bytes(data), word)


class TiffSamples(Formats):
    def test_types(self):
        for kind in META_TYPES + ["<u4", "<i4", "<f2", "<f8"]:
            v = w.ramp(3, 37, 21, dtype=kind)
            for order in "<>":
                for big in (False, True):
                    if kind != "<u2" and big == (order == "<"):
                        continue
                    with self.subTest(kind, order=order, big=big):
                        self.check("a.tif", w.tiff([w.tiff_page(p, order) for p in v], order, big), v, extent=[21, 37, 3], kind="volume")
            for packed in (False, True):
                predictors = (1, 2) if np.dtype(kind).kind != "f" and packed else (1,)
                for predictor in predictors:
                    for form in ({"tile": 16}, {"rows": 5}, {}) if kind == "<u2" else ({"tile": 16},):
                        with self.subTest(kind, packed=packed, predictor=predictor, **form):
                            self.check("b.tif", w.tiff([w.tiff_page(p, packed=packed, predictor=predictor, **form) for p in v]), v)

    def test_few_bits(self):
        for bits in (1, 2, 4):
            v = w.ramp(5, 13, 11, dtype="u1") % 2**bits
            # Shades of fewer than 8 bits are stretched over 8, as in PNG.
            for photometric in (1, 0):
                for form in ({}, {"rows": 4}, {"tile": 16}, {"packed": True}) if photometric else ({},):
                    with self.subTest(bits=bits, photometric=photometric, **form):
                        pages = [w.tiff_page(p, bits=bits, photometric=photometric, **form) for p in v]
                        said = self.check("a.tif", w.tiff(pages), v * (255 // (2**bits - 1)), kind="volume", type="u8")
                        self.assertEqual(any("min is white" in text for text in said["warnings"]), photometric == 0)
                        self.check("b.tif", w.tiff(pages[:1]), v[0] * (255 // (2**bits - 1)), kind="image")
        for bits in (10, 12, 14):
            v = w.ramp(3, 13, 11, dtype="<u2")
            self.check("a.tif", w.tiff([w.tiff_page(p, bits=bits) for p in v]), v, type="u16")

    def test_palettes(self):
        rng = np.random.RandomState(1)
        for bits in (1, 4, 8):
            table = rng.randint(0, 256, (2**bits, 3))
            v = (w.ramp(3, 13, 11, dtype="<u2") % 2**bits).astype("u1")
            for scale in (257, 256, 1):  # old programs wrote colours of 8 bits
                stored = table * scale
                with self.subTest(bits=bits, scale=scale):
                    pages = [w.tiff_page(p, bits=bits, photometric=3, colours=stored) for p in v]
                    self.check("a.tif", w.tiff(pages), table[v], channels=3, kind="volume")
                    self.check("b.tif", w.tiff(pages[:1]), table[v[0]], channels=3, kind="image")
            grey = np.repeat(table[:, :1], 3, 1) * 257
            self.check("a.tif", w.tiff([w.tiff_page(p, bits=bits, photometric=3, colours=grey) for p in v]), table[:, 0][v], channels=1)
            # ImageJ shows values through a table: the values are the data.
            text = w.described("ImageJ=1.53t\nimages=3\nslices=3\n")
            pages = [w.tiff_page(p, bits=bits, photometric=3, colours=table * 257, more=text if i == 0 else None) for i, p in enumerate(v)]
            self.check("a.tif", w.tiff(pages), v, channels=1)

    def test_colours_apart_and_together(self):
        for samples in (2, 3, 4):
            for kind in ("u1", "<u2", "<f4"):
                v = w.ramp(3, 19, 18, samples, dtype=kind)
                forms = ({}, {"rows": 4}, {"tile": 16}, {"tile": 16, "packed": True}, {"rows": 7, "packed": True})
                for form in forms if kind == "<u2" else forms[3:4]:
                    for planar in (1, 2):
                        with self.subTest(samples=samples, kind=kind, planar=planar, **form):
                            extra = (0,) * (samples - 3 if samples > 3 else samples - 1 if samples == 2 else 0)
                            pages = [w.tiff_page(p, planar=planar, extra=extra, **form) for p in v]
                            self.check("a.tif", w.tiff(pages), v, channels=samples, kind="volume")
                            if not form:
                                self.check("b.tif", w.tiff(pages[:1]), v[0], channels=samples, kind="image")
        v = w.ramp(2, 5, 6, 7, dtype="<u2")
        pages = [w.tiff_page(p, planar=2, photometric=1, extra=(0,) * 6) for p in v]
        self.check("a.tif", w.tiff(pages), v[..., 5], channels=7, options=("--channel", 5))
        self.assertEqual(self.info(self.put("a.tif", w.tiff(pages)))["channels"], 7)
        self.run_it("warp", self.folder / "a.tif", "-o", "null:", code=2)

    def test_refusals(self):
        v = w.ramp(3, 13, 11)
        page = w.tiff_page(v[0])
        self.refused("a.tif", w.tiff([{**page, 339: (3, [6])}] * 2), "complex")
        self.refused("a.tif", w.tiff([w.tiff_page(v[0]), w.tiff_page(v[1, :5])]), "pages differ")
        self.refused("a.tif", w.tiff([w.tiff_page(p, bits=1) for p in v])[:-4], "beyond the end")
        self.refused("a.tif", w.tiff([w.tiff_page(v[0], photometric=3, bits=8, colours=np.zeros((4, 3)))] * 2), "photometric 3")


class TiffStacks(Formats):
    """Channels, slices and times of ImageJ and OME."""

    @staticmethod
    def pages(v, text, more=None):
        flat = v.reshape((-1,) + v.shape[-2:])
        return [w.tiff_page(p, more={**(more or {}), **(w.described(text) if i == 0 else {})}) for i, p in enumerate(flat)]

    def test_imagej(self):
        for c, z, t in ((2, 3, 1), (1, 3, 2), (2, 3, 4), (3, 1, 1), (1, 1, 4), (2, 1, 3), (6, 2, 1), (1, 5, 1)):
            v = w.ramp(t, z, c, 4, 6, dtype="<u2")
            text = f"ImageJ=1.53t\nimages={c * z * t}\n" + (f"channels={c}\n" if c > 1 else "")
            text += (f"slices={z}\n" if z > 1 else "") + (f"frames={t}\n" if t > 1 else "") + "hyperstack=true\nmode=grayscale\n"
            data = w.tiff(self.pages(v, text))
            one = w.tiff(self.pages(v, text)[:1], tail=v.reshape(-1, 4, 6)[1:].tobytes())  # one directory, as beyond 4 GB
            for name, file in (("a.tif", data), ("b.tif", one)) if c * z * t in (24, 6) else (("a.tif", data),):
                for time in range(t):
                    whole = np.moveaxis(v[time], 1, -1)  # z, y, x, c
                    if z == 1:
                        whole = whole[0]
                    options = ("--time", time) if t > 1 else ()
                    with self.subTest(name, c=c, z=z, t=t, time=time):
                        if c <= 4:
                            self.check(name, file, whole if c > 1 else whole[..., 0], options=options, channels=c, times=t,
                                       kind="volume" if z > 1 else "image", extent=[6, 4, z] if z > 1 else [6, 4])
                        for channel in range(c):
                            self.check(name, file, whole[..., channel], options=(*options, "--channel", channel))
        self.assertEqual(self.info(self.put("c.tif", w.tiff(self.pages(w.ramp(6, 4, 6), "ImageJ=1\nimages=6\nchannels=2\nslices=3\n"))))["channels"], 2)
        self.run_it("render", self.folder / "c.tif", "-o", "null:", code=2)
        self.run_it("render", self.folder / "c.tif", "-o", "null:", "--channel", 1)
        self.run_it("warp", self.folder / "c.tif", "-o", "null:", "--channel", 2, code=2)

    def test_labels_of_32_bits_keep_each_of_them(self):
        v = w.ramp(2, 3, 2, 4, 6, dtype="<u4") * 4000001  # beyond the 24 bits of f32
        data = w.tiff(self.pages(v, "ImageJ=1\nimages=12\nchannels=2\nslices=3\nframes=2\n"))
        self.check("a.tif", data, v[1, :, 1], options=("--labels", "--channel", 1, "--time", 1))
        self.check("b.tif", data, np.moveaxis(v[0], 1, -1), options=("--labels", "--time", 0))
        self.check("c.tif", w.tiff([w.tiff_page(p) for p in v[0, :, 0]]), v[0, :, 0], options=("--labels",))

    def test_a_description_that_pages_contradict(self):
        v = w.ramp(4, 4, 6, dtype="<u2")
        said = self.check("a.tif", w.tiff(self.pages(v, "ImageJ=1\nimages=6\nchannels=2\nslices=3\n")), v, channels=1)
        self.assertTrue(any("pages" in text for text in said["warnings"]))
        one = w.tiff(self.pages(v, "ImageJ=1\nimages=4\nslices=4\n")[:1], tail=v[1:-1].tobytes())
        self.refused("a.tif", one, "short data")

    def test_imagej_colour(self):
        v = w.ramp(3, 2, 4, 6, 3, dtype="u1")  # z, c, y, x, rgb
        flat = v.reshape(-1, 4, 6, 3)
        text = w.described("ImageJ=1\nimages=6\nchannels=2\nslices=3\n")
        data = w.tiff([w.tiff_page(p, more=text if i == 0 else None) for i, p in enumerate(flat)])
        for channel in range(6):
            self.check("a.tif", data, v[:, channel // 3, :, :, channel % 3], options=("--channel", channel), channels=6)

    def test_ome(self):
        sizes = {"C": 2, "Z": 3, "T": 2}
        for order in ("CZT", "ZCT", "TZC", "ZTC", "CTZ", "TCZ"):
            shape = [sizes[a] for a in reversed(order)]
            v = w.ramp(*shape, 4, 6, dtype="<u2")
            by_axis = np.moveaxis(v, [list(reversed(order)).index(a) for a in "TZC"], [0, 1, 2])  # t, z, c, y, x
            attributes = f'DimensionOrder="XY{order}" Type="uint16" SizeX="6" SizeY="4" SizeZ="3" SizeC="2" SizeT="2" BigEndian="false"'
            for data in ("", "<TiffData/>", '<TiffData IFD="0" PlaneCount="12"/>') if order == "CZT" else ("",):
                file = w.tiff(self.pages(v, w.ome(attributes, data=data)))
                for time in range(2):
                    with self.subTest(order, data=data, time=time):
                        self.check("a.ome.tif", file, np.moveaxis(by_axis[time], 1, -1), options=("--time", time), channels=2, times=2,
                                   kind="volume", extent=[6, 4, 3])
        # Planes in any order, each with an entry of its own.
        v = w.ramp(6, 4, 6, dtype="<u2")
        places = [(z, c) for c in (1, 0) for z in (2, 0, 1)]
        data = "".join(f'<TiffData IFD="{i}" FirstZ="{z}" FirstC="{c}" FirstT="0" PlaneCount="1"><UUID FileName="x.ome.tif">urn:1</UUID></TiffData>'
                       for i, (z, c) in enumerate(places))
        expected = np.zeros((3, 4, 6, 2), "<u2")
        for i, (z, c) in enumerate(places):
            expected[z, :, :, c] = v[i]
        attributes = 'DimensionOrder="XYZCT" SizeX="6" SizeY="4" SizeZ="3" SizeC="2" SizeT="1"'
        self.check("a.ome.tif", w.tiff(self.pages(v, w.ome(attributes, data=data)), big=True), expected)
        rgb = w.ramp(3, 4, 6, 3, dtype="u1")
        text = w.described(w.ome('DimensionOrder="XYCZT" SizeX="6" SizeY="4" SizeZ="3" SizeC="3" SizeT="1"',
                                 channels='<Channel ID="Channel:0:0" SamplesPerPixel="3"/>'))
        self.check("a.ome.tif", w.tiff([w.tiff_page(p, more=text if i == 0 else None) for i, p in enumerate(rgb)]), rgb, channels=3)

    def test_several_images_of_ome(self):
        v = w.ramp(4, 4, 6, dtype="<u2")
        body = "".join(f'<Image ID="Image:{i}" Name="part {i}"><Pixels DimensionOrder="XYZCT" SizeX="6" SizeY="4" SizeZ="2" SizeC="1" SizeT="1">'
                       f'<TiffData IFD="{2 * i}" PlaneCount="2"/></Pixels></Image>' for i in range(2))
        path = self.put("a.ome.tif", w.tiff(self.pages(v, f"<OME>{body}</OME>".encode() + b"\0")))
        self.assertEqual([s["text"] for s in self.info(path)["series"]], ["part 0", "part 1"])
        self.assertIn("part 1", self.run_it("warp", path, "-o", "null:", code=2).stderr)
        for series in range(2):
            np.testing.assert_array_equal(self.values(path, "--series", series), v[2 * series:2 * series + 2])
        self.run_it("warp", path, "-o", "null:", "--series", 2, code=2)

    def test_ome_refusals(self):
        v = w.ramp(6, 4, 6, dtype="<u2")
        good = 'DimensionOrder="XYZCT" SizeX="6" SizeY="4" SizeZ="3" SizeC="2" SizeT="1"'
        for bad in (good.replace('Z="3"', 'Z="4"'), good.replace('Z="3"', 'Z="0"'), good.replace('Z="3"', 'Z="-3"'),
                    good.replace('Z="3"', 'Z="99999999999"'), good.replace('Z="3"', 'Z="x"'), good.replace("XYZCT", "XYZZT"),
                    good.replace("XYZCT", ""), good.replace('X="6"', 'X="7"')):
            self.refused("a.ome.tif", w.tiff(self.pages(v, w.ome(bad))), "OME")
        for data in ('<TiffData IFD="9" PlaneCount="1"/>', '<TiffData IFD="0" PlaneCount="99"/>', '<TiffData FirstZ="3"/>',
                     '<TiffData IFD="-2"/>', '<TiffData IFD="0" PlaneCount="5"/>', '<TiffData IFD="9223372036854775807" PlaneCount="6"/>'):
            self.refused("a.ome.tif", w.tiff(self.pages(v, w.ome(good, data=data))), "OME")
        two = "".join(f'<TiffData FirstC="{i}" PlaneCount="3"><UUID FileName="{i}.ome.tif">u</UUID></TiffData>' for i in range(2))
        self.refused("a.ome.tif", w.tiff(self.pages(v, w.ome(good, data=two))), "set of 2 files")
        self.refused("a.ome.tif", w.tiff(self.pages(v, b"<OME><Image><Pixels " + good.encode() + b'><TiffData IFD="0\0')), "XML")


class TiffSpacing(Formats):
    def stack(self, text=None, more=None, count=5):
        v = w.ramp(count, 4, 6, dtype="<u2")
        return v, w.tiff([w.tiff_page(p, more={**(more or {}), **(w.described(text) if text and i == 0 else {})}) for i, p in enumerate(v)])

    def test_imagej(self):
        size = w.resolution((10, 1), (5, 1), 1)
        for unit, factor in (("micron", 1e-3), ("um", 1e-3), ("\\u00B5m", 1e-3), ("mm", 1), ("nm", 1e-6), ("cm", 10), ("inch", 25.4)):
            v, data = self.stack(f"ImageJ=1\nimages=5\nslices=5\nunit={unit}\nspacing=1.5\n", size)
            self.check("a.tif", data, v, np.array((.1, .2, 1.5)) * factor)
        # ImageJ leaves out a spacing of 1.
        v, data = self.stack("ImageJ=1\nimages=5\nslices=5\nunit=micron\n", size)
        self.check("a.tif", data, v, (1e-4, 2e-4, 1e-3))
        v, data = self.stack("ImageJ=1\nimages=5\nslices=5\nspacing=3\n", w.resolution((100, 1), (100, 1), 3))
        self.check("a.tif", data, v, (.1, .1, 30))
        v, data = self.stack("ImageJ=1\nimages=5\nslices=5\nunit=pixel\nspacing=3\n", w.resolution((1, 1), (1, 1), 1))
        self.check("a.tif", data, v, (1, 1, 3), None)
        v, data = self.stack("ImageJ=1\nimages=5\nslices=5\nunit=ell\nspacing=3\n", size)
        said = self.check("a.tif", data, v, (.1, .2, 3), None)
        self.assertTrue(any("ell" in text for text in said["warnings"]))
        v, data = self.stack("ImageJ=1\nimages=5\nslices=5\n", w.resolution((72, 1), (72, 1), 2))
        self.check("a.tif", data, v, (1, 1, 1), None)

    def test_ome(self):
        size = 'DimensionOrder="XYZCT" SizeX="6" SizeY="4" SizeZ="5" SizeC="1" SizeT="1" PhysicalSizeX="0.1" PhysicalSizeY="0.2" PhysicalSizeZ="1.5" '
        for unit, factor in ((None, 1e-3), ("µm", 1e-3), ("&#181;m", 1e-3), ("&#xB5;m", 1e-3), ("nm", 1e-6), ("mm", 1), ("Å", 1e-7)):
            units = "".join(f'PhysicalSize{a}Unit="{unit}" ' for a in "XYZ") if unit else ""
            v, data = self.stack(w.ome(size + units))
            self.check("a.ome.tif", data, v, np.array((.1, .2, 1.5)) * factor)
        v, data = self.stack(w.ome(size + 'PhysicalSizeZUnit="mm"'))
        self.check("a.ome.tif", data, v, (1e-4, 2e-4, 1.5))
        v, data = self.stack(w.ome(size + "".join(f'PhysicalSize{a}Unit="pixel" ' for a in "XYZ")))
        self.check("a.ome.tif", data, v, (.1, .2, 1.5), None)
        v, data = self.stack(w.ome(size.replace('PhysicalSizeZ="1.5"', "")))
        said = self.check("a.ome.tif", data, v, (1e-4, 2e-4, 1e-4))
        self.assertTrue(any("PhysicalSizeZ" in text for text in said["warnings"]))

    def test_plain(self):
        v, data = self.stack(None, w.resolution((1000, 10), (50, 1), 3))
        said = self.check("a.tif", data, v, (.1, .2, .1))
        self.assertTrue(any("--input-spacing" in text for text in said["warnings"]))
        v, data = self.stack(None, w.resolution((254, 1), (254, 1), 2))
        self.check("a.tif", data, v, (.1, .1, .1))
        v, data = self.stack(None, w.resolution((254, 1), (254, 1), 1))
        self.check("a.tif", data, v, (1, 1, 1), None)
        for bad in ((0, 1), (1, 0), (0, 0)):
            v, data = self.stack(None, w.resolution(bad, bad, 3))
            self.check("a.tif", data, v, (1, 1, 1), None)
        # A picture's resolution is how dense to print it, unless it is a scientist's.
        v, data = self.stack(None, w.resolution((300, 1), (300, 1), 2), 1)
        self.check("a.tif", data, v[0], (1, 1), None)
        v, data = self.stack(None, w.resolution((100, 1), (50, 1), 3), 1)
        self.check("a.tif", data, v[0], (.1, .2))
        (self.folder / "stack").mkdir()
        for i in range(3):
            self.put(f"stack/{i}.tif", data)
        said = self.info(self.folder / "stack")
        np.testing.assert_allclose(said["spacing"], (.1, .2, .1))
        self.assertTrue(any("--input-spacing" in text for text in said["warnings"]))


    def test_what_is_written_is_read_again(self):
        v = w.ramp(5, 4, 6, dtype="<u2")
        for spacing in ("0.1,0.2,1.5", "0.00038,0.00038,0.00112345", "0.78125,0.78125,7", "1.1e-7,1.2e-7,1e-6"):
            for unit in ((), ("--input-unit", "mm")):
                raw = f"raw:{self.put('a.raw', v.tobytes())}:6x4x5:u16"
                self.run_it("warp", raw, "-o", self.folder / "o.tif", "--input-spacing", spacing, *unit)
                said = self.info(self.folder / "o.tif")
                # Fractions of two 32-bit numbers hold nine digits, of which ours are all.
                np.testing.assert_allclose(said["spacing"], [float(s) for s in spacing.split(",")], rtol=1e-8)
                self.assertEqual(said["unit"], "mm" if unit else None)
                np.testing.assert_array_equal(self.values(self.folder / "o.tif"), v)


class InputSpacing(Formats):
    def test_where_a_file_is_silent(self):
        v = w.ramp(3, 4, 5)
        raw = f"raw:{self.put('a.raw', v.tobytes())}:5x4x3:i16"
        for options, spacing, unit in ((("--input-spacing", "1,2,3"), (1, 2, 3), None), (("--input-spacing", "2"), (2, 2, 2), None),
                                       (("--input-spacing", "1,2,3", "--input-unit", "um"), (1e-3, 2e-3, 3e-3), "mm"),
                                       (("--input-unit", "um"), (1e-3,) * 3, "mm"), (("--input-unit", "mm"), (1, 1, 1), "mm")):
            said = self.info(raw, *options)
            np.testing.assert_allclose(said["spacing"], spacing)
            self.assertEqual(said["unit"], unit)
            # The output's header says the same.
            self.run_it("warp", raw, "-o", self.folder / "o.nrrd", *options)
            said = self.info(self.folder / "o.nrrd")
            np.testing.assert_allclose(said["spacing"], spacing)
            self.assertEqual(said["unit"], unit)

    def test_where_a_file_is_wrong(self):
        v = w.ramp(3, 4, 5)
        path = self.put("a.nii", w.nifti(v, (2, 2, 2), np.array([[2, 0, 0, -10], [0, 2, 0, 0], [0, 0, 2, 0]]), units=2))
        said = self.info(path, "--input-unit", "um")
        np.testing.assert_allclose(said["spacing"], (2e-3,) * 3)
        np.testing.assert_allclose(said["origin"], (1e-2, 0, 0), atol=1e-12)
        path = self.put("a.nii", w.nifti(v, (2, 2, 2), units=3))
        np.testing.assert_allclose(self.info(path)["spacing"], (2e-3,) * 3)
        np.testing.assert_allclose(self.info(path, "--input-unit", "mm")["spacing"], (2,) * 3)
        np.testing.assert_allclose(self.info(path, "--input-spacing", "4,5,6")["spacing"], (4, 5, 6))  # in what info says: mm
        np.testing.assert_allclose(self.info(path, "--input-spacing", "4,5,6", "--input-unit", "nm")["spacing"], (4e-6, 5e-6, 6e-6))

    def test_it_changes_the_picture(self):
        v = np.zeros((10, 20, 20), "u1")
        path = f"raw:{self.put('b.raw', v.tobytes())}:20x20x10:u8"
        out = self.folder / "o.png"
        for options, size in (((), "20x10"), (("--input-spacing", "1,1,2"), "20x20")):
            done = json.loads(self.run_it("render", path, "--view", "y", "--size", "native", "-o", out, "--json", "-", *options).stdout)
            self.assertIn(size, done["plan"]["steps"][-1]["to"])

    def test_what_makes_no_sense(self):
        path = self.put("a.nii", w.nifti(w.ramp(3, 4, 5)))
        for options in (("--input-spacing", "0"), ("--input-spacing", "-1"), ("--input-spacing", "nan"), ("--input-spacing", "1,2"),
                        ("--input-spacing", "a"), ("--input-unit", "furlong"), ("--input-unit", "")):
            for verb in (("info",), ("warp",), ("plan", "render")):
                self.run_it(*verb, path, *(["-o", "null:"] if verb == ("warp",) else []), *options, code=2)
        self.run_it("info", "phantom:sphere:8", "--input-spacing", "2", code=2)


if __name__ == "__main__":
    unittest.main()
