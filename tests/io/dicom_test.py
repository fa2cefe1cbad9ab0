"""DICOM as hospitals write it: each kind of object and of encoding, written by dicom_writing.py (no line of which is shared
with the readers), read through the command, and compared with the numbers that were written. Needs EDGEWISE."""
import base64
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import dicom_writing as dw  # noqa: E402
from dicom_writing import CLASS, file_of, fragments, picture  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
TYPES = {"uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2", "uint32": "u4", "int32": "i4", "float": "f4", "double": "f8"}
# JPEG 2000 codestreams, written by OpenJPEG: of `ramp` minus 500 in 16 signed bits, 5 x 6; of `ramp` in 12 bits, 7 x 8; of
# `ramp` in 8 bits and three colours with their reversible transform, 8 x 6.
JPEG_2000 = {name: base64.b64decode(text) for name, text in {
    "signed": (
        "/0//UQApAAAAAAAFAAAABgAAAAAAAAAAAAAABQAAAAYAAAAAAAAAAAABjwEB/1IADAAAAAEAAQQEAAH/XAAHQICIiJD/ZAAlAAFDcmVh"
        "dGVkIGJ5IE9wZW5KUEVHIHZlcnNpb24gMi41LjD/kAAKAAAAAAAnAAH/k8A/MMAI7GjTlG3flbbkzC+gAfUCAAy86ej/2Q=="),
    "grey": (
        "/0//UQApAAAAAAAHAAAACAAAAAAAAAAAAAAABwAAAAgAAAAAAAAAAAABCwEB/1IADAAAAAEAAQQEAAH/XAAHQGBoaHD/ZAAlAAFDcmVh"
        "dGVkIGJ5IE9wZW5KUEVHIHZlcnNpb24gMi41LjD/kAAKAAAAAAAxAAH/k9/gXBIL019LCxPJwzse84BmuNIWvG1cvgB/oB9QKAN+lvB/"
        "/9k="),
    "colour": (
        "/0//UQAvAAAAAAAIAAAABgAAAAAAAAAAAAAACAAAAAYAAAAAAAAAAAADBwEBBwEBBwEB/1IADAAAAAEBAQQEAAH/XAAHQEBISFD/ZAAl"
        "AAFDcmVhdGVkIGJ5IE9wZW5KUEVHIHZlcnNpb24gMi41LjD/kAAKAAAAAACjAAH/k8fUGAZsJo+kHMLnF2Qp38+0MBtCP4fbBC3jeogM"
        "P8+0KBXdDFVtDTpxui/D6gyfgGw+0LAPYGMiAiKRUx30nFEEXzMWaPwZNz/61cj4C/Z8oZeRnuPI/3/H2hU/AKj8AkATCj2sWRuPKv9/"
        "DDH9oCMM5jvJhQtfk9NGM40VP8faDT8ASPwBABBW0WphnxXkQ9wQSN9n/9k=")}.items()}


def ramp(*shape, dtype="<i2", first=0):
    """Sample i is (7 i + first) mod 1000."""
    return ((np.arange(np.prod(shape)) * 7 + first) % 1000).reshape(shape).astype(dtype)


def nrrd(path):
    """Samples and header of what `warp` writes, slowest axis first."""
    head, data = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n") if ": " in line)
    sizes = [int(size) for size in fields["sizes"].split()]
    return np.frombuffer(data, "<" + TYPES[fields["type"]]).reshape(sizes[::-1]), fields


class Dicom(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.env = {**os.environ, "XDG_CONFIG_HOME": str(cls.folder / "config"), "XDG_CACHE_HOME": str(cls.folder / "cache")}
        Dicom.count = getattr(Dicom, "count", 0)

    def path(self, ending=""):
        Dicom.count += 1
        return self.folder / f"{Dicom.count}{ending}"

    def put(self, elements, syntax=dw.EXPLICIT, **coding):
        path = self.path(".dcm")
        path.write_bytes(file_of(elements, syntax, **coding))
        return path

    def put_folder(self, files):
        """@param files data sets, or bytes of files"""
        folder = self.path()
        folder.mkdir()
        for i, content in enumerate(files):
            (folder / f"i{i}.dcm").write_bytes(content if isinstance(content, bytes) else file_of(content))
        return folder

    def run_it(self, *words):
        return subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=60, env=self.env)

    def info(self, path, *options):
        done = self.run_it("info", path, "--json", "-", *options)
        self.assertEqual(done.returncode, 0, f"{path}: {done.stderr}")
        return json.loads(done.stdout)

    def values(self, path, *options):
        out = self.path(".nrrd")
        done = self.run_it("warp", path, "-o", out, "--quiet", *options)
        self.assertEqual(done.returncode, 0, f"{path}: {done.stderr}")
        return nrrd(out)[0]

    def refusal(self, path, *options):
        done = self.run_it("info", path, *options)
        self.assertIn(done.returncode, (2, 4), f"{path}: {done.stdout}")
        return done.stderr

    def expect(self, path, samples, *options, spacing=None, origin=None, direction=None, room=0, warning=None):
        found = self.info(path, *options)
        got = self.values(path, *options)
        self.assertEqual(got.shape, np.shape(samples))
        self.assertLessEqual(np.abs(got.astype(float) - samples).max(), room)
        for key, value in (("spacing", spacing), ("origin", origin), ("direction", direction)):
            if value is not None:
                np.testing.assert_allclose(found[key], value, atol=1e-6, err_msg=key)
        text = " ".join(found["warnings"])
        if warning is None:
            self.assertEqual(found["warnings"], [])
        else:
            self.assertIn(warning, text)
        return found


def turned(degrees):
    """Rows and columns turned about x, and their normal."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    row, column = np.array([1, 0, 0.0]), np.array([0, c, s])
    return row, column, np.cross(row, column)


class Encodings(Dicom):
    """Transfer syntaxes, elements and sequences."""

    def test_every_plain_syntax_and_type(self):
        for syntax in (dw.IMPLICIT, dw.EXPLICIT, dw.BIG, dw.DEFLATED):
            for dtype in ("u1", "i1", "<u2", "<i2", "<u4", "<i4"):
                pixels = ramp(6, 5, dtype=dtype)
                with self.subTest(syntax=syntax, dtype=dtype):
                    self.expect(self.put(picture(pixels, syntax=syntax, position=(1, 2, 3)), syntax), pixels, origin=(1, 2))

    def test_single_bytes_in_big_endian_words_change_places(self):
        pixels = ramp(6, 5, dtype="u1")
        swapped = pixels.reshape(-1, 2)[:, ::-1].tobytes()
        self.expect(self.put(picture(pixels, more={0x7fe00010: ("OW", swapped)}), dw.BIG), pixels)

    def test_sequences_of_any_length_and_unknown_ones_are_passed(self):
        inside = {0x00080100: ("SH", "1234"), 0x0008010d: ("SQ", [{0x00080104: ("LO", "deep")}]), 0x00290010: ("LO", "x")}
        pixels = ramp(4, 6, 5)
        groups = {0x00289110: ("SQ", [{0x00280030: ("DS", (2, 3)), 0x00180050: ("DS", 9)}]),
                  0x00209116: ("SQ", [{0x00200037: ("DS", (1, 0, 0, 0, 1, 0))}])}
        frames = [{0x00209113: ("SQ", [{0x00200032: ("DS", (0, 0, 4 * k))}])} for k in range(4)]
        more = {0x00081032: ("SQ", [inside, inside]), 0x00290010: ("LO", "OWNER"), 0x00291001: ("SQ", [inside]),
                0x52009229: ("SQ", [groups]), 0x52009230: ("SQ", frames)}
        elements = picture(pixels, "enhanced CT", orientation=None, spacing=None, more=more)
        for syntax in (dw.EXPLICIT, dw.IMPLICIT, dw.BIG, dw.DEFLATED):
            e = dict(elements)
            if syntax == dw.BIG:
                e[0x7fe00010] = ("OW", pixels.astype(">i2").tobytes())
            for endless in (False, True):
                for unknown in (False, True):
                    with self.subTest(syntax=syntax, endless=endless, unknown=unknown):
                        self.expect(self.put(e, syntax, endless=endless, unknown=unknown and syntax != dw.IMPLICIT), pixels,
                                    spacing=(3, 2, 4))

    def test_old_files_without_a_marker(self):
        pixels = ramp(6, 5)
        for syntax in (dw.IMPLICIT, dw.EXPLICIT):
            body = dw.Coding(syntax != dw.IMPLICIT).data_set(picture(pixels, position=(1, 2, 3)))
            path = self.path(".dcm")
            path.write_bytes(body)
            self.expect(path, pixels, origin=(1, 2))
        path.write_bytes(b"\2\0\1\0OB, but the rest is text. " * 20)
        self.assertIn(path.name, self.refusal(path))

    def test_fragments_of_an_icon_are_no_elements(self):
        pixels = ramp(6, 5)
        icon = {0x00280010: ("US", 64), 0x7fe00010: fragments([b"\xfe\xff\0\xe0" * 9, b"\x08\0\x05\0SQ" * 5])}
        self.expect(self.put(picture(pixels, more={0x00880200: ("SQ", [icon])}), endless=True), pixels)

    def test_unused_bits(self):
        pixels = ramp(6, 5, dtype="<i2") - 500
        junk = (pixels & 0x0fff) | 0x3000
        self.expect(self.put(picture(junk.astype("<i2"), stored=12)), pixels)

    def test_unused_bits_on_both_sides(self):
        # 33 samples are no whole number of vectors; any bits may lie below and above those that count.
        noise = np.random.default_rng(3).integers(0, 2 ** 31, (3, 11))
        for dtype, stored, high in (("u1", 5, 6), ("i1", 6, 6), ("<u2", 12, 11), ("<u2", 10, 13), ("<i2", 9, 14), ("<u4", 13, 20),
                                    ("<i4", 15, 31)):
            with self.subTest(dtype=dtype, stored=stored, high=high):
                pixels = noise.astype(dtype)
                held = noise.astype(pixels.dtype.str.replace("i", "u")).astype(int) >> high + 1 - stored & (1 << stored) - 1
                wanted = np.where(held >> stored - 1 & (dtype[-2] == "i"), held - (1 << stored), held)
                e = picture(pixels, stored=stored, more={0x00280102: ("US", high)})
                self.expect(self.put(e), wanted)

    def test_floats(self):
        for kind, tag, vr in (("<f4", 0x7fe00008, "OF"), ("<f8", 0x7fe00009, "OD")):
            pixels = np.linspace(-1, 3, 30).astype(kind).reshape(6, 5)
            e = picture(np.zeros((6, 5), "<u4"), more={tag: (vr, pixels.tobytes())})
            del e[0x7fe00010]
            self.expect(self.put(e), pixels, room=2.0 ** -23,  # rounded to f32, up to 3
                        warning="f64" if kind == "<f8" else None)

    def test_run_lengths(self):
        flat = np.repeat(ramp(6, 1), 40, axis=1)
        for pixels in (ramp(7, 5, dtype="u1"), ramp(6, 5), flat, ramp(6, 5, dtype="<u4")):
            e = picture(pixels, more={0x7fe00010: fragments([dw.rle(pixels)])})
            self.expect(self.put(e, dw.RLE), pixels)

    def test_run_lengths_that_lie_are_refused(self):
        good = dw.rle(ramp(6, 5))
        for bad in (good[:40], good[:70], struct.pack("<I", 3) + good[4:], good[:4] + struct.pack("<I", 4000) + good[8:]):
            e = picture(ramp(6, 5), more={0x7fe00010: fragments([bad])})
            self.assertIn("run length", self.refusal(self.put(e, dw.RLE)))

    def test_jpeg_lossless_and_jpeg_ls(self):
        for pixels, stored in ((ramp(6, 5, dtype="u1"), 8), (ramp(8, 7, dtype="<u2"), 12), (ramp(6, 5) - 500, 16),
                               (ramp(6, 5, dtype="<u2", first=400), 16)):
            for name, encode in (("lossless", dw.jpeg_lossless), ("ls", dw.jpeg_ls)):
                with self.subTest(name=name, stored=stored):
                    e = picture(pixels, stored=stored, more={0x7fe00010: fragments([encode(pixels, stored)])})
                    self.expect(self.put(e, dw.JPEG[name]), pixels)
        flat = np.repeat(ramp(6, 1), 300, axis=1)
        self.expect(self.put(picture(flat, more={0x7fe00010: fragments([dw.jpeg_ls(flat)])}), dw.JPEG["ls"]), flat)

    def test_jpeg_2000(self):
        for name, pixels, more in (("signed", ramp(6, 5) - 500, {}), ("grey", ramp(8, 7, dtype="<u2"), {"stored": 12}),
                                   ("colour", ramp(6, 8, 3, dtype="u1"), {"colour": True, "photometric": "YBR_RCT"}),
                                   ("colour", ramp(6, 8, 3, dtype="u1"), {"colour": True, "photometric": "RGB"})):
            with self.subTest(name=name):
                e = picture(pixels, **more, more={0x7fe00010: fragments([JPEG_2000[name]])})
                self.expect(self.put(e, dw.JPEG["2000"]), pixels)

    def test_frames_in_several_fragments(self):
        """Where they begin is said by the table, by one fragment a frame, or by the streams."""
        pixels = ramp(3, 6, 5)
        packed = [dw.jpeg_lossless(frame) for frame in pixels]
        packed = [p + b"\0" * (len(p) % 2) for p in packed]
        e = picture(pixels, more={0x00180088: ("DS", 2)})
        e[0x7fe00010] = fragments(packed)
        self.expect(self.put(e, dw.JPEG["lossless"]), pixels, spacing=(1, 1, 2))
        halves, offsets, at = [], [], 0
        for p in packed:
            offsets.append(at)
            for part in (p[:40], p[40:]):
                halves.append(part)
                at += 8 + len(part)
        e[0x7fe00010] = fragments(halves, offsets)
        self.expect(self.put(e, dw.JPEG["lossless"]), pixels)
        e[0x7fe00010] = fragments(halves)  # streams say where they begin
        self.expect(self.put(e, dw.JPEG["lossless"]), pixels)
        e[0x7fe00010] = fragments(halves[:-2])
        self.assertIn("where 3 frames begin", self.refusal(self.put(e, dw.JPEG["lossless"])))

    def test_streams_of_another_size_are_refused_before_they_are_decoded(self):
        wide = dw.jpeg_lossless(ramp(6, 6))
        huge = wide.replace(struct.pack(">BHH", 16, 6, 6), struct.pack(">BHH", 16, 65000, 65000))
        for stream in (wide, huge, b"\xff\xd8\xff", b""):
            e = picture(ramp(6, 5), more={0x7fe00010: fragments([stream])})
            self.assertIn("compressed pixels are", self.refusal(self.put(e, dw.JPEG["lossless"])))

    def test_unknown_syntaxes_are_named(self):
        e = picture(ramp(6, 5), more={0x7fe00010: fragments([b"video"])})
        self.assertIn("1.2.840.10008.1.2.4.102", self.refusal(self.put(e, "1.2.840.10008.1.2.4.102")))


class Colour(Dicom):
    RED = (76, 85, 255)  # Y, Cb, Cr of (254, 0, 0)

    def test_layouts(self):
        rgb = ramp(6, 8, 3, dtype="u1")
        self.expect(self.put(picture(rgb, colour=True, photometric="RGB")), rgb)
        planes = np.ascontiguousarray(np.moveaxis(rgb, 2, 0))
        e = picture(rgb, colour=True, photometric="RGB", planar=1, more={0x7fe00010: ("OB", planes.tobytes())})
        self.expect(self.put(e), rgb)
        e = picture(rgb, colour=True, photometric="RGB", more={0x7fe00010: fragments([dw.rle(rgb)])})
        self.expect(self.put(e, dw.RLE), rgb)
        e = picture(rgb, colour=True, photometric="RGB", more={0x7fe00010: fragments([dw.jpeg_lossless(rgb)])})
        self.expect(self.put(e, dw.JPEG["lossless"]), rgb)

    def test_luminance_and_differences(self):
        """PS3.3 C.7.6.3.1.2, worked out here from its matrix."""
        ybr = np.empty((6, 8, 3), "u1")
        ybr[:, :4], ybr[:, 4:] = self.RED, (120, 200, 90)
        # A difference on both sides of 128 in every pair, so that a swapped order shows.
        y, b, r = np.moveaxis(ybr.astype(float), 2, 0) - np.array([0, 128, 128]).reshape(3, 1, 1)
        rgb = np.stack([y + 1.402 * r, y - 0.344136 * b - 0.714136 * r, y + 1.772 * b], 2).clip(0, 255)
        room = 1  # of rounding
        e = picture(ybr, colour=True, photometric="YBR_FULL")
        self.expect(self.put(e), rgb, room=room)
        self.expect(self.put({**e, 0x7fe00010: fragments([dw.rle(ybr)])}, dw.RLE), rgb, room=room)
        halved = np.stack([ybr[:, 0::2, 0], ybr[:, 1::2, 0], ybr[:, 0::2, 1], ybr[:, 0::2, 2]], 2)
        e = picture(ybr, colour=True, photometric="YBR_FULL_422", more={0x7fe00010: ("OB", halved.tobytes())})
        self.expect(self.put(e), rgb, room=room)

    def test_jpeg(self):
        """Flat blocks, which baseline JPEG keeps exactly, at full and at half the resolution of colour."""
        for photometric, sampling in (("YBR_FULL", ((1, 1),) * 3), ("YBR_FULL_422", ((2, 1), (1, 1), (1, 1)))):
            wide = sampling[0][0]
            blocks = [np.full((2, 2 * s[0]), v) for v, s in zip(self.RED, sampling)]
            stream = dw.jpeg_flat(blocks, sampling)
            shape = np.zeros((16, 16 * wide, 3), "u1")
            e = picture(shape, colour=True, photometric=photometric, more={0x7fe00010: fragments([stream])})
            red = np.zeros(shape.shape)
            red[..., 0] = 254
            with self.subTest(photometric=photometric):
                self.expect(self.put(e, dw.JPEG["baseline"]), red, room=2)

    def test_grey_jpeg(self):
        blocks = np.array([[10, 200, 77], [128, 0, 255]])
        e = picture(np.zeros((16, 24), "u1"), more={0x7fe00010: fragments([dw.jpeg_flat([blocks])])})
        self.expect(self.put(e, dw.JPEG["baseline"]), np.kron(blocks, np.ones((8, 8))))

    def test_palettes(self):
        index = (np.arange(30).reshape(6, 5) % 7 + 3).astype("u1")
        table = np.arange(21).reshape(7, 3) * 11
        for bits, first in ((8, 3), (16, 3), (8, 5)):
            more = {}
            for c in range(3):
                more[0x00281101 + c] = ("US", (7, first, bits))
                words = table[:, c].astype("<u2") if bits == 16 else table[:, c].astype("u1")
                more[0x00281201 + c] = ("OW", words.tobytes())
            e = picture(index, photometric="PALETTE COLOR", more=more)
            self.expect(self.put(e), table[np.clip(index.astype(int) - first, 0, 6)])
        packed = fragments([dw.rle(index)])
        self.expect(self.put({**e, 0x7fe00010: packed}, dw.RLE), table[np.clip(index.astype(int) - first, 0, 6)])
        # Segmented: seven values in a row, then a line to the last of them again.
        for c in range(3):
            del e[0x00281201 + c]
            e[0x00281221 + c] = ("OW", struct.pack("<5H", 0, 1, table[0, c], 1, 6) + struct.pack("<H", table[6, c]))
        self.expect(self.put(e), table[np.clip(index.astype(int) - first, 0, 6)])

    def test_bright_zero_is_kept_as_stored_in_every_encoding(self):
        pixels = ramp(6, 5, dtype="u1")
        for syntax, packed in ((dw.EXPLICIT, None), (dw.RLE, dw.rle(pixels)), (dw.JPEG["lossless"], dw.jpeg_lossless(pixels)),
                               (dw.JPEG["ls"], dw.jpeg_ls(pixels))):
            more = {0x7fe00010: fragments([packed])} if packed else {}
            self.expect(self.put(picture(pixels, photometric="MONOCHROME1", more=more), syntax), pixels, warning="MONOCHROME1")

    def test_modality_tables(self):
        index = (np.arange(30).reshape(6, 5) % 5).astype("u1")
        table = np.array([900, 20, 333, 4000, 65535])
        item = {0x00283002: ("US", (5, 0, 16)), 0x00283004: ("LO", "OD"), 0x00283006: ("OW", table.astype("<u2").tobytes())}
        self.expect(self.put(picture(index, more={0x00283000: ("SQ", [item])})), table[index])


class Places(Dicom):
    """Order and geometry."""

    def stack(self, pixels, places, step=(0, 0, 1), **more):
        return [picture(p, position=tuple(np.multiply(step, z)), number=i + 1, **more)
                for i, (p, z) in enumerate(zip(pixels, places))]

    def test_enhanced(self):
        """Frames in any order, oblique, with what is said once and what is said a frame; each with values of its own."""
        row, column, normal = turned(30)
        for kind, slopes in (("enhanced CT", [1] * 5), ("enhanced MR", [1, 0.5, 2, 3, 0.25]), ("enhanced PET", [2] * 5), ("3D XA", [1] * 5)):
            pixels, order = ramp(5, 6, 7), [3, 0, 4, 2, 1]
            pixel = {0x00289110: ("SQ", [{0x00180050: ("DS", 9), 0x00280030: ("DS", (0.5, 0.75))}])}
            plane = {0x00209116: ("SQ", [{0x00200037: ("DS", [*row, *column])}])}
            frames = []
            for at, k in enumerate(order):
                frame = {0x00209113: ("SQ", [{0x00200032: ("DS", list(np.array([-10, -20, 30]) + 2.5 * k * normal))}]),
                         0x00289145: ("SQ", [{0x00281052: ("DS", -3), 0x00281053: ("DS", slopes[k]), 0x00281054: ("LO", "US")}]),
                         0x00209111: ("SQ", [{0x00209157: ("UL", [1, k + 1])}])}
                frame.update(plane if kind == "enhanced MR" else {})
                frames.append(frame)
            shared = {**pixel, **({} if kind == "enhanced MR" else plane)}
            e = picture(pixels[order], kind, orientation=None, spacing=None,
                        more={0x52009229: ("SQ", [shared]), 0x52009230: ("SQ", frames)})
            values = pixels * np.reshape(slopes, (5, 1, 1)) - 3.0
            with self.subTest(kind=kind):
                found = self.expect(self.put(e), values, spacing=(0.75, 0.5, 2.5), origin=(-10, -20, 30), direction=[row, column, normal])
                self.assertEqual(found["range"][0], -3)
                self.assertEqual(found["orientation"], "LPS")

    def test_times_in_one_file(self):
        """Frames at the same places: by TemporalPositionIndex, else by the other indices."""
        pixels = ramp(6, 6, 5)
        for indices in ({0x00209128: "UL"}, {}):
            frames = []
            for k in range(6):
                place, time = k % 3, k // 3
                content = {tag: (vr, time + 1) for tag, vr in indices.items()}
                content[0x00209157] = ("UL", [1, place + 1, time + 1])
                frames.append({0x00209113: ("SQ", [{0x00200032: ("DS", (0, 0, 4 * place))}]), 0x00209111: ("SQ", [content])})
            order = [5, 0, 3, 1, 4, 2]
            e = picture(pixels[order], "enhanced MR", more={0x52009230: ("SQ", [frames[k] for k in order])})
            path = self.put(e)
            self.assertEqual(self.info(path)["times"], 2)
            for time in range(2):
                self.expect(path, pixels[3 * time:3 * time + 3], "--time", time, spacing=(1, 1, 4))

    def test_classic_series_in_any_order(self):
        row, column, normal = turned(-25)
        pixels = ramp(5, 6, 7)
        for syntax in (dw.EXPLICIT, dw.RLE, dw.JPEG["lossless"]):
            files = self.stack(pixels, [0, -3, -6, -9, -12], normal, orientation=[*row, *column], spacing=(2, 1.5))
            encode = {dw.RLE: dw.rle, dw.JPEG["lossless"]: dw.jpeg_lossless}.get(syntax)
            if encode:
                for e, p in zip(files, pixels):
                    e[0x7fe00010] = fragments([encode(p)])
            folder = self.put_folder([file_of(files[i], syntax) for i in (2, 0, 3, 1, 4)])
            self.expect(folder, pixels[::-1], spacing=(1.5, 2, 3), origin=-12 * normal, direction=[row, column, normal])

    def test_slopes_of_their_own(self):
        pixels, slopes = ramp(3, 6, 5), [1, 0.5, 2.25]
        for syntax in (dw.EXPLICIT, dw.RLE, dw.JPEG["ls"]):
            files = self.stack(pixels, [0, 2, 4])
            for e, p, slope in zip(files, pixels, slopes):
                e.update({0x00281052: ("DS", 1), 0x00281053: ("DS", slope)})
                encode = {dw.RLE: dw.rle, dw.JPEG["ls"]: dw.jpeg_ls}.get(syntax)
                if encode:
                    e[0x7fe00010] = fragments([encode(p)])
            folder = self.put_folder([file_of(e, syntax) for e in files])
            self.expect(folder, pixels * np.reshape(slopes, (3, 1, 1)) + 1)

    def test_doses(self):
        pixels = ramp(4, 6, 5, dtype="<u4")
        for offsets, base in (([0, 3, 6, 9], -7), ([-7, -4, -1, 2], -7), ([0, -3, -6, -9], 5), ([4, 1, -2, -5], 4)):
            e = picture(pixels, "dose", "RTDOSE", position=(1, 2, base), spacing=(2.5, 2),
                        more={0x3004000c: ("DS", offsets), 0x3004000e: ("DS", 0.25)})
            del e[0x00280034 if 0x00280034 in e else 0x00200013]
            order = slice(None, None, 1 if offsets[0] < offsets[-1] else -1)
            low = base + min(0, offsets[-1] - offsets[0])
            with self.subTest(offsets=offsets):
                found = self.info(self.put(e))
                self.assertEqual(found["range"], [0, pixels.max() * 0.25])
                np.testing.assert_allclose(found["origin"], [1, 2, low])
                np.testing.assert_allclose(found["spacing"], [2, 2.5, 3])
                np.testing.assert_array_equal(self.values(self.put(e)), pixels[order] * 0.25)

    def test_nuclear_medicine(self):
        """Frames have no positions; the distance is signed, or not said."""
        pixels = ramp(4, 6, 5, dtype="<u2")
        e = picture(pixels, "NM", position=(1, 2, 10), spacing=(4, 4), more={0x00180050: ("DS", 5), 0x00180088: ("DS", -5)})
        self.expect(self.put(e), pixels[::-1], spacing=(4, 4, 5), origin=(1, 2, -5))
        e[0x00180088] = ("DS", 5)
        self.expect(self.put(e), pixels, spacing=(4, 4, 5), origin=(1, 2, 10))
        del e[0x00180088]
        self.expect(self.put(e), pixels, spacing=(4, 4, 5), origin=(1, 2, 10), warning="SliceThickness")
        del e[0x00180050]
        self.expect(self.put(e), pixels, spacing=(4, 4, 1), warning="taken as 1")
        # Where they lie may be said with the detector; which slice a frame is by a vector.
        e = picture(pixels, "NM", orientation=None, spacing=(4, 4), more={
            0x00180088: ("DS", 5), 0x00540080: ("US", [2, 1, 4, 3]),
            0x00540022: ("SQ", [{0x00200032: ("DS", (1, 2, 3)), 0x00200037: ("DS", (1, 0, 0, 0, 1, 0))}])})
        self.expect(self.put(e), pixels[[1, 0, 3, 2]], spacing=(4, 4, 5), origin=(1, 2, 3))

    def test_micrometres(self):
        pixels = ramp(4, 6, 5, dtype="<u2")
        files = self.stack(pixels, [0, 0.0004, 0.0008, 0.0012], spacing=(0.00025, 0.0005))
        self.expect(self.put_folder(files), pixels, spacing=(0.0005, 0.00025, 0.0004))

    def test_slides_in_tiles(self):
        whole = ramp(7, 13, 3, dtype="u1")
        tiles = np.zeros((6, 4, 5, 3), "u1")
        for k in range(6):
            part = whole[k // 3 * 4:][:4, k % 3 * 5:][:, :5]
            tiles[k, :part.shape[0], :part.shape[1]] = part
        pixel = {0x00289110: ("SQ", [{0x00280030: ("DS", (0.00025, 0.00025))}])}
        full = {0x00480006: ("UL", 13), 0x00480007: ("UL", 7), 0x52009229: ("SQ", [pixel])}
        e = picture(tiles, "slide", colour=True, photometric="RGB", orientation=None, spacing=None, more=full)
        self.expect(self.put(e), whole, spacing=(0.00025, 0.00025))
        order = [4, 0, 5, 2, 1, 3]
        frames = [{0x0048021a: ("SQ", [{0x0048021e: ("SL", k % 3 * 5 + 1), 0x0048021f: ("SL", k // 3 * 4 + 1)}])} for k in order]
        e = picture(tiles[order], "slide", colour=True, photometric="RGB", orientation=None, spacing=None,
                    more={**full, 0x52009230: ("SQ", frames)})
        self.expect(self.put(e), whole, spacing=(0.00025, 0.00025))

    def test_tilted_gantries(self):
        """Slices are upright, and each lies farther down than the one before."""
        row, column, normal = turned(20)
        pixels = ramp(4, 6, 5)
        step = np.array([0, 0, 5.0])
        files = self.stack(pixels, [0, 1, 2, 3], step, orientation=[*row, *column])
        found = self.expect(self.put_folder(files), pixels, spacing=(1, 1, 5), warning="leans")
        np.testing.assert_allclose(found["direction"], [row, column, [0, 0, 1]], atol=1e-9)

    def test_a_ball_in_a_tilted_gantry_is_round(self):
        row, column, _ = turned(25)
        n, at = 32, np.arange(32)
        centre = (row + column) * (n - 1) / 2 + (0, 0, (n - 1) / 2)
        files = []
        for k in at:
            places = np.array([0, 0, k]) + at[None, :, None] * row + at[:, None, None] * column
            inside = np.linalg.norm(places - centre, axis=-1) < 8
            files.append(picture(inside.astype("<i2") * 1000, position=(0, 0, k), orientation=[*row, *column], number=k))
        folder, out = self.put_folder(files), self.path(".nrrd")
        for view in ("left", "top", "front"):
            done = self.run_it("render", folder, "-o", out, "--view", view, "--spacing", "1", "--quiet")
            self.assertEqual(done.returncode, 0, done.stderr)
            disc = np.argwhere(np.squeeze(nrrd(out)[0]) > 500)
            spread = np.sqrt(np.linalg.eigvalsh(np.cov(disc.T)))
            # A disc of radius 8 on pixels of 1 mm; leaning by tan 25 degrees it would be 1.5.
            self.assertLess(spread[1] / spread[0], 1.06, view)

    def test_frames_of_which_some_say_nothing_are_refused(self):
        frames = [{0x00209113: ("SQ", [{0x00200032: ("DS", (0, 0, 2 * k))}])} for k in range(2)]
        e = picture(ramp(3, 6, 5), "enhanced MR", position=(0, 0, 0), more={0x52009230: ("SQ", frames)})
        self.assertIn("(0020,0032) is missing", self.refusal(self.put(e)))

    def test_slices_beside_the_line_are_refused(self):
        files = [picture(p, position=(3 * (k == 2), 0, 2 * k), number=k) for k, p in enumerate(ramp(4, 6, 5))]
        self.assertIn("one line", self.refusal(self.put_folder(files)))

    def test_no_positions(self):
        pixels = ramp(4, 6, 5)
        for more, step in (({0x00180088: ("DS", 2.5), 0x00180050: ("DS", 2)}, 2.5), ({0x00180050: ("DS", 2)}, 2), ({}, 1)):
            files = [{**picture(pixels[k], number=k + 1), **more} for k in (2, 0, 3, 1)]
            self.expect(self.put_folder(files), pixels, spacing=(1, 1, step), warning="InstanceNumber")

    def test_one_slice_of_a_folder(self):
        e = picture(ramp(6, 5), position=(1, 2, 3), more={0x00180050: ("DS", 4)})
        self.expect(self.put_folder([e]), ramp(1, 6, 5), spacing=(1, 1, 4), origin=(1, 2, 3))
        del e[0x00180050]
        self.expect(self.put_folder([e]), ramp(1, 6, 5), spacing=(1, 1, 1), warning="how thick")

    def test_mosaics(self):
        """Tiles are slices; the position is that of a slice as large as the mosaic."""
        row, column, normal = turned(15)
        for count, by in ((4, "element"), (7, "element"), (7, "csa")):
            side = int(np.ceil(np.sqrt(count)))
            slices = ramp(count, 6, 5, dtype="<u2")
            tiles = np.zeros((side * 6, side * 5), "<u2")
            for k in range(count):
                tiles[k // side * 6:, k % side * 5:][:6, :5] = slices[k]
            corner = np.array([3.0, 4, 5])
            base = corner - row * (side - 1) * 5 / 2 * 2 - column * (side - 1) * 6 / 2 * 3
            more = {0x00080008: ("CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC"), 0x00180088: ("DS", 4)}
            if by == "element":
                more.update({0x00190010: ("LO", "SIEMENS MR HEADER"), 0x0019100a: ("US", count)})
            else:
                more.update({0x00290010: ("LO", "SIEMENS CSA HEADER"), 0x00291010: ("OB", csa(count, -normal))})
            e = picture(tiles, "MR", position=tuple(base), orientation=[*row, *column], spacing=(3, 2), more=more)
            down = by == "csa"
            with self.subTest(count=count, by=by):
                self.expect(self.put(e), slices[::-1] if down else slices, spacing=(2, 3, 4),
                            origin=corner - (count - 1) * 4 * normal if down else corner, direction=[row, column, normal])
        files = []
        for time in range(3):
            f = picture(tiles + np.uint16(time), "MR", position=(0, 0, 0), number=time + 1, more={
                **more, 0x00290010: ("LO", "OTHER"), 0x00190011: ("LO", "SIEMENS MR HEADER"), 0x0019110a: ("US", count)})
            files.append(f)
        folder = self.put_folder(files)
        self.assertEqual(self.info(folder)["times"], 3)
        self.expect(folder, slices + 2, "--time", 2, spacing=(1, 1, 4))

    def test_dynamic_series(self):
        pixels = ramp(7, 6, 5)
        places = [0, 2, 4, 0, 2, 4, 0]
        folder = self.put_folder(self.stack(pixels[:6], places[:6]))
        self.assertEqual(self.info(folder)["times"], 2)
        self.expect(folder, pixels[3:6], "--time", 1)
        stopped = self.put_folder(self.stack(pixels, places))
        found = self.info(stopped)
        self.assertEqual((found["times"], found["extent"]), (2, [5, 6, 3]))
        self.assertIn("1 of 3", found["warnings"][0])
        self.expect(stopped, pixels[3:6], "--time", 1, warning="left out")
        # Numbered times: which one lacks slices does not matter.
        numbered = self.stack(pixels, [0, 2, 4, 0, 0, 2, 4])
        for e, time in zip(numbered, [1, 1, 1, 2, 3, 3, 3]):
            e[0x00200100] = ("IS", time)
        folder = self.put_folder(numbered)
        self.assertIn("1 of 3", self.info(folder)["warnings"][0])
        self.expect(folder, pixels[4:7], "--time", 1, warning="time point 2")
        for e in numbered:
            e[0x00200012] = e.pop(0x00200100)
        self.expect(self.put_folder(numbered), pixels[4:7], "--time", 1, warning="time point 2")
        # Numbered place after place.
        by_place = self.stack(ramp(8, 6, 5), [0, 0, 0, 2, 2, 2, 4, 4])
        self.expect(self.put_folder(by_place), ramp(8, 6, 5)[[1, 4, 7]], "--time", 1, warning="2 of 3")
        # The same slice twice is no time.
        self.assertIn("same position", self.refusal(self.put_folder(self.stack(pixels[:4], [0, 2, 2, 4]))))
        self.assertIn("same position", self.refusal(self.put_folder(self.stack(pixels[:4], [0, 2, 4, 4]))))

    def test_frames_over_time(self):
        pixels = ramp(4, 6, 5, dtype="u1")
        e = picture(pixels, "XA", orientation=None, spacing=None, more={
            0x00181063: ("DS", 33), 0x00280009: ("AT", struct.pack("<HH", 0x0018, 0x1063)), 0x00181164: ("DS", (0.3, 0.2))})
        path = self.put(e)
        found = self.info(path)
        self.assertEqual((found["kind"], found["times"], found["extent"]), ("image", 4, [5, 6]))
        self.expect(path, pixels[2], "--time", 2, spacing=(0.2, 0.3), warning="detector")

    def test_segments(self):
        """One bit a sample, frames in any order, empty places left out; together they are labels."""
        rows, columns = 5, 7  # 35 bits: frames begin inside of bytes
        rng = np.random.default_rng(3)
        labels = rng.integers(0, 3, (5, rows, columns))
        labels[1] = 0
        frames, bits = [], []
        for segment in (2, 1):
            for k in (4, 0, 3, 2):
                frames.append({0x00209113: ("SQ", [{0x00200032: ("DS", (0, 0, 2 * k))}]),
                               0x0062000a: ("SQ", [{0x0062000b: ("US", segment)}])})
                bits.append(labels[k] == segment)
        packed = np.packbits(np.array(bits).ravel(), bitorder="little").tobytes()
        pixel = {0x00289110: ("SQ", [{0x00280030: ("DS", (1, 1)), 0x00180088: ("DS", 2)}])}
        e = picture(np.zeros((8, rows, columns), "u1"), "segmentation", "SEG", spacing=None, more={
            0x00280100: ("US", 1), 0x00280101: ("US", 1), 0x00280102: ("US", 0), 0x00620001: ("CS", "BINARY"),
            0x7fe00010: ("OB", packed), 0x52009229: ("SQ", [pixel]), 0x52009230: ("SQ", frames)})
        self.expect(self.put(e), labels, spacing=(1, 1, 2))

    def test_names_and_colours_of_segments(self):
        """A mesh has them, whether segments come as bits or as a map of labels."""
        labels = np.zeros((4, 6, 8), "u1")
        labels[1:3, 1:3, 1:3], labels[1:3, 3:5, 5:7] = 1, 2
        colours = {1: (1.0, 0.0, 0.0), 2: (0.2, 0.6, 0.4)}

        def segments(names):
            return [{0x00620003: ("SQ", [{0x00080104: ("LO", "Tissue")}]), 0x00620004: ("US", n), 0x00620005: ("LO", name),
                     0x0062000d: ("US", tuple(lab_of(colours[n])))} for n, name in names.items()]

        place = [{0x00209113: ("SQ", [{0x00200032: ("DS", (0, 0, 2 * k))}])} for k in range(4)]
        pixel = {0x00289110: ("SQ", [{0x00280030: ("DS", (1, 1)), 0x00180088: ("DS", 2)}])}
        bits = {0x00280100: ("US", 1), 0x00280101: ("US", 1), 0x00280102: ("US", 0), 0x00620001: ("CS", "BINARY"),
                0x7fe00010: ("OB", np.packbits(np.array([labels == 1, labels == 2]).ravel(), bitorder="little").tobytes()),
                0x52009229: ("SQ", [pixel]),
                0x52009230: ("SQ", [{**at, 0x0062000a: ("SQ", [{0x0062000b: ("US", n)}])} for n in (1, 2) for at in place])}
        map_of = {0x00080016: ("UI", "1.2.840.10008.5.1.4.1.1.66.7"), 0x52009229: ("SQ", [pixel]), 0x52009230: ("SQ", place)}
        for more, frames, names, characters in (
                (bits, 8, {1: "Liver", 2: "Tumor \u00e9 1"}, "ISO_IR 100"), (map_of, 4, {2: "Niere", 1: "Leber"}, "ISO_IR 192"),
                (bits, 8, {2: "b", 1: "a"}, None)):
            e = picture(np.resize(labels, (frames, 6, 8)), "segmentation", "SEG", spacing=None,
                        more={**more, 0x00620002: ("SQ", segments(names))})
            if characters:
                e[0x00080005] = ("CS", characters)
            out = self.path(".ply")
            found = self.run_it("mesh", self.put(dict(sorted(e.items()))), "-o", out, "--labels")
            self.assertEqual(found.returncode, 0, found.stderr)
            head, body = out.read_bytes().split(b"end_header\n", 1)
            lines = head.decode().splitlines()
            self.assertEqual([line for line in lines if line.startswith("comment label")],
                             [f"comment label {n} {names[n]}" for n in (1, 2)])
            vertices, faces = (int(line.split()[2]) for line in lines if line.startswith("element"))
            body = np.frombuffer(body[24 * vertices:], [("n", "u1"), ("at", "<i4", 3), ("label", "<i4"), ("rgb", "u1", 3)])
            self.assertEqual(len(body), faces)
            for n in (1, 2):
                rgb = np.unique(body["rgb"][body["label"] == n], axis=0)
                # a* and b* have 65535 steps for 255; a level of 255 is far more.
                np.testing.assert_array_equal(rgb, [np.rint(255 * np.array(colours[n]))])


def lab_of(rgb):
    """sRGB as RecommendedDisplayCIELabValue, through the matrix of ICC's profile for sRGB, which is adapted to D50."""
    rgb = np.array(rgb)
    light = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4360747, 0.3850649, 0.1430804], [0.2225045, 0.7168786, 0.0606169], [0.0139322, 0.0971045, 0.7141733]]) @ light
    t = xyz / [0.9642, 1, 0.8249]
    f = np.where(t > 216 / 24389, np.cbrt(t), (24389 / 27 * t + 16) / 116)
    lab = 116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])
    return [round(lab[0] / 100 * 65535), round((lab[1] + 128) / 255 * 65535), round((lab[2] + 128) / 255 * 65535)]


def csa(tiles, normal):
    """The private header of Siemens scanners, with two of its entries."""
    entries = [("NumberOfImagesInMosaic", ["%d" % tiles]), ("SliceNormalVector", ["%.8f" % v for v in normal])]
    out = b"SV10\4\3\2\1" + struct.pack("<II", len(entries), 77)
    for name, values in entries:
        out += name.encode().ljust(64, b"\0") + struct.pack("<i", len(values)) + b"US\0\0" + struct.pack("<iii", 0, len(values), 77)
        for value in values:
            text = value.encode() + b"\0"
            out += struct.pack("<4i", len(text), len(text), 77, len(text)) + text + b"\0" * (-len(text) % 4)
    return out


class Folders(Dicom):
    """What lies beside pictures."""

    def other(self, kind, modality, series):
        return {0x00080016: ("UI", CLASS[kind]), 0x00080018: ("UI", "1.2.3.6." + series), 0x00080060: ("CS", modality),
                0x0020000d: ("UI", "1.2.3.8"), 0x0020000e: ("UI", series)}

    def test_study(self):
        ct = [picture(p, position=(0, 0, 3 * k), number=k + 1) for k, p in enumerate(ramp(5, 6, 5))]
        mr = [picture(p, "MR", position=(0, 0, 2 * k), number=k + 20, series="1.2.3.11") for k, p in enumerate(ramp(3, 6, 5))]
        directory = {0x00080016: ("UI", "1.2.840.10008.1.3.10"), 0x00080018: ("UI", "1.2.3.6"), 0x00041130: ("CS", "STUDY")}
        others = [self.other("structures", "RTSTRUCT", "1.2.3.12"), self.other("plan", "RTPLAN", "1.2.3.13"),
                  self.other("report", "SR", "1.2.3.9"), directory]
        folder = self.put_folder(ct + others)
        self.expect(folder, ramp(5, 6, 5), spacing=(1, 1, 3), warning="RTSTRUCT")
        self.assertIn("holds no pictures, but RTSTRUCT", self.refusal(folder, "--series", "1.2.3.12"))
        folder = self.put_folder(ct + others + mr)
        found = self.info(folder)
        self.assertEqual([(s["uid"], s["files"]) for s in found["series"]], [("1.2.3.9", 5), ("1.2.3.11", 3)])
        text = " ".join(found["warnings"])
        for kind in ("RTSTRUCT", "RTPLAN", "SR", "DICOMDIR"):
            self.assertIn(kind, text)
        self.expect(folder, ramp(3, 6, 5), "--series", "1.2.3.11", spacing=(1, 1, 2), warning="skipped")
        done = self.run_it("warp", folder, "-o", self.path(".nrrd"))
        self.assertEqual(done.returncode, 2)
        self.assertIn("1.2.3.11", done.stderr)
        self.assertIn("no picture", self.refusal(self.put(others[0])))
        self.assertIn("RTPLAN", self.refusal(self.put_folder(others)))

    def test_medium(self):
        """With a directory at the top, the pictures are in folders below."""
        directory = {0x00080016: ("UI", "1.2.840.10008.1.3.10"), 0x00080018: ("UI", "1.2.3.6")}
        top = self.put_folder([directory])
        for k, p in enumerate(ramp(3, 6, 5)):
            below = top / "IMAGES" / str(k)
            below.mkdir(parents=True)
            (below / "IM").write_bytes(file_of(picture(p, position=(0, 0, 2 * k), number=k)))
        self.expect(top, ramp(3, 6, 5), spacing=(1, 1, 2), warning="DICOMDIR")

    def test_a_series_that_cannot_be_read_does_not_hide_the_others(self):
        ct = [picture(p, position=(0, 0, k), number=k) for k, p in enumerate(ramp(3, 6, 5))]
        scouts = [picture(ramp(6, 5), orientation=o, position=(0, 0, 0), number=k + 9, series="1.2.3.4") for k, o in enumerate(
            ((1, 0, 0, 0, 1, 0), (0, 1, 0, 0, 0, -1), (1, 0, 0, 0, 0, -1)))]
        video = picture(ramp(6, 5), number=30, series="1.2.3.5", more={0x7fe00010: fragments([b"video"])})
        folder = self.put_folder(ct + scouts + [file_of(video, "1.2.840.10008.1.2.4.102")])
        found = self.info(folder)
        self.assertEqual(found["extent"], [5, 6, 3])
        self.assertEqual(len(found["series"]), 3)
        self.assertIn("1.2.3.4", " ".join(found["warnings"]))
        self.expect(folder, ramp(3, 6, 5), "--series", "1.2.3.9")
        self.assertIn("1.2.840.10008.1.2.4.102", self.refusal(folder, "--series", "1.2.3.5"))

    def test_damaged_slices_are_not_left_out(self):
        ct = [file_of(picture(p, position=(0, 0, k), number=k)) for k, p in enumerate(ramp(4, 6, 5))]
        ct[2] = ct[2][:-20]
        self.assertIn("i2.dcm", self.refusal(self.put_folder(ct)))
        other = file_of(picture(ramp(6, 5), series="1.2.3.10", number=50))[:-20]
        good = [ct[0], ct[1], ct[3], other]
        right = ramp(4, 6, 5)
        right[2] = 0  # the file of this place is not there
        self.expect(self.put_folder(good), right, warning="i3.dcm")


class PaddingValues(Dicom):
    """PS3.3 C.7.5.1.1.2: padding is no measurement."""
    PAD = -2000

    def series(self, slopes=(1, 1, 1, 1), limit=None):
        stored = np.full((4, 8, 8), 24, "<i2")
        stored[:, :2], stored[:, 4:6, 3:5] = self.PAD, 1064
        more = {0x00280120: ("SS", self.PAD)}
        if limit is not None:
            stored[:, 0] = limit
            more[0x00280121] = ("SS", limit)
        return self.put_folder([picture(s, position=(0, 0, k), number=k, more={
            **more, 0x00281052: ("DS", -1024), 0x00281053: ("DS", slope)}) for k, (s, slope) in enumerate(zip(stored, slopes))])

    def xray(self, path, *options):
        out = self.path(".nrrd")
        done = self.run_it("render", path, "-o", out, "--mode", "xray", "--view", "z", "--size", "native", "--quiet", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return np.squeeze(nrrd(out)[0])

    def test_rays_take_it_for_nothing(self):
        for path in (self.series(), self.series(limit=-1500)):
            picture_of = self.xray(path)
            np.testing.assert_allclose(picture_of[:4], 0, atol=1e-2)
            np.testing.assert_allclose(picture_of[4:6, 3:5], 4160, rtol=1e-5)
            block = self.xray(path, "--zero", "-500")
            np.testing.assert_allclose(block[:2], 0, atol=1e-2)
            np.testing.assert_allclose(block[3], -2000, rtol=1e-5)

    def test_range_is_that_of_measurements(self):
        for path, low in ((self.series(), -1000), (self.series((1, 2, 1, 1)), -1000)):
            found = self.info(path)
            self.assertEqual(found["range"][0], low)
            self.assertIn("padding", " ".join(found["warnings"]))

    def test_a_warp_keeps_it(self):
        self.assertEqual(self.values(self.series())[0, 0, 0], self.PAD - 1024)


if __name__ == "__main__":
    unittest.main()
