"""Zarr as other programs write it: codecs and filters, shards, orders of axes, ZIP files, units, groups of several things.

Version 2 is written by Debian's python3-zarr and numcodecs; version 3 from the text of its specification, with numpy. Needs EDGEWISE."""
import itertools
import json
import lzma
import os
import pathlib
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile
import zlib

import numcodecs
import numpy as np
import zarr

TESTS = pathlib.Path(__file__).parent.parent
sys.path[:0] = [str(TESTS / "io"), str(TESTS / "cli")]
import files as read_back  # noqa: E402
from zarr_test import crc32c  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
EMPTY = 2**64 - 1
LITTLE = {"name": "bytes", "configuration": {"endian": "little"}}
BIG = {"name": "bytes", "configuration": {"endian": "big"}}
CRC = {"name": "crc32c"}
SPACE = [{"name": n, "type": "space", "unit": "micrometer"} for n in "zyx"]


def noise(*shape, dtype="<u2", seed=1):
    return np.random.default_rng(seed).integers(0, 200, shape).astype(dtype)


def summed(data):
    return data + struct.pack("<I", crc32c(data))


def blocks(volume, sides, fill=0):
    """(place, block) of all blocks; those at the end are filled up."""
    for at in np.ndindex(*(-(-n // c) for n, c in zip(volume.shape, sides))):
        block = np.full(sides, fill, volume.dtype)
        part = volume[tuple(slice(i * c, (i + 1) * c) for i, c in zip(at, sides))]
        block[tuple(slice(n) for n in part.shape)] = part
        yield at, block


def packed_by(codecs):
    """Encodes a block as codecs of version 3 say."""
    def pack(block):
        for codec in codecs:
            name, settings = codec["name"], codec.get("configuration", {})
            if name == "transpose":
                block = block.transpose(settings["order"])
            elif name == "bytes":
                block = block.astype(block.dtype.newbyteorder("<" if settings["endian"] == "little" else ">")).tobytes()
            elif name == "crc32c":
                block = summed(block)
            elif name in ("numcodecs.delta", "numcodecs.fixedscaleoffset"):
                shape = block.shape
                block = numcodecs.get_codec({"id": name[10:], **settings}).encode(np.ascontiguousarray(block)).reshape(shape)
            else:
                block = bytes(numcodecs.get_codec({"id": name.split(".")[-1], **settings}).encode(block))
        return block
    return pack


def shard_of(block, sides, codecs, at_start=False, index=(LITTLE, CRC), order=None, holes=()):
    """@param sides of its chunks; @param order in which chunks lie in the file; @param holes  chunks that are left out"""
    chunks = [packed_by(codecs)(chunk) for _, chunk in blocks(block, sides)]
    table = np.full((len(chunks), 2), EMPTY, "u8")
    size = 16 * len(chunks) + (4 if CRC in index else 0)
    data = b""
    for k in (order(len(chunks)) if order else range(len(chunks))):
        if k not in holes:
            table[k] = len(data) + (size if at_start else 0), len(chunks[k])
            data += chunks[k] + b"gap"
    raw = table.astype(">u8" if index[0] == BIG else "<u8").tobytes()
    raw = summed(raw) if CRC in index else raw
    return raw + data if at_start else data + raw


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "c"), "XDG_CACHE_HOME": str(self.folder / "k")}
        self.count = 0

    def path(self, ending=".zarr"):
        self.count += 1
        return self.folder / f"{self.count}{ending}"

    def run_it(self, *words, code=0, limit=None):
        lower = (lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit))) if limit else None
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, env=self.env, timeout=60, preexec_fn=lower)
        self.assertEqual(done.returncode, code, (words, done.stderr.decode()))
        return done

    def refused(self, path, *words, code=4, verb="info", **more):
        out = ("-o", "null:") if verb == "warp" else ()
        said = self.run_it(verb, path, *out, *words, code=code, **more).stderr.decode()
        self.assertIn(str(path), said)
        return said

    def info(self, path, *words):
        return json.loads(self.run_it("info", path, "--json", "-", *words).stdout)

    def samples(self, path, *words):
        out = self.folder / "out.nrrd"
        self.run_it("warp", path, "-o", out, "--quiet", *words)
        return read_back.read(out)

    def same(self, path, right, message=""):
        got = self.samples(path)
        np.testing.assert_array_equal(got.reshape(right.shape).astype(float), right.astype(float), message)

    def array3(self, volume, codecs, sides, pack=None, fill=0, path=None, **more):
        """A plain array of version 3."""
        path = path or self.path()
        path.mkdir(parents=True)
        (path / "zarr.json").write_text(json.dumps({
            "zarr_format": 3, "node_type": "array", "shape": volume.shape, "data_type": volume.dtype.name, "fill_value": fill,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": sides}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}}, "codecs": codecs, **more}))
        for at, block in blocks(volume, sides):
            data = (pack or packed_by(codecs))(block)
            if data is not None:
                file = path / "c" / "/".join(map(str, at))
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(data)
        return path

    def array2(self, volume, path=None, chunks=(4, 5, 6), **more):
        path = path or self.path()
        array = zarr.open(str(path), mode="w", shape=volume.shape, chunks=chunks[:volume.ndim], dtype=volume.dtype, **more)
        array[:] = volume
        return path


class Codecs(Case):
    def test_compressors_of_numcodecs(self):
        smooth = np.add.outer(np.arange(9), np.add.outer(np.arange(11), np.arange(13))).astype("<u2")
        zeros = np.zeros((9, 11, 13), "<i4")
        for codec in (numcodecs.LZ4(), numcodecs.LZ4(9), numcodecs.LZMA(), numcodecs.LZMA(format=lzma.FORMAT_ALONE), numcodecs.CRC32(),
                      numcodecs.Adler32(), numcodecs.Shuffle(2)):
            for volume in noise(9, 11, 13, dtype="<f4"), smooth, zeros:
                self.same(self.array2(volume, compressor=codec), volume, str(codec))

    def test_a_long_match_and_long_literals_of_lz4(self):
        rng = np.random.default_rng(5)
        rows = [np.tile(rng.integers(0, 256, period, "u1"), 90000 // period + 1)[:90000] for period in (1, 2, 3, 7, 15, 300, 65535)]
        for row in (*rows, rng.integers(0, 256, 90000, "u1"), np.concatenate([rows[4][:40000], rng.integers(0, 256, 50000, "u1")])):
            volume = row.reshape(3, 100, 300)
            self.same(self.array2(volume, chunks=(3, 100, 300), compressor=numcodecs.LZ4()), volume)

    def test_filters_of_numcodecs(self):
        ramp = (np.arange(7 * 9 * 11).reshape(7, 9, 11) * 37 % 60000)
        for dtype, filters in (
                ("<u2", [numcodecs.Delta("<u2")]), ("<i4", [numcodecs.Delta("<i4", "<i8")]), ("<i2", [numcodecs.Delta("<i2", "<i2")]),
                ("<u2", [numcodecs.Delta("<u2", "<i4")]), ("<f4", [numcodecs.Delta("<f4")]), ("<f8", [numcodecs.Delta("<f8")]),
                (">i2", [numcodecs.Delta(">i2")]), ("<u2", [numcodecs.Delta("<u2"), numcodecs.Shuffle(2)]),
                ("<i4", [numcodecs.AsType("<i8", "<i4")]), ("<f8", [numcodecs.AsType("<f4", "<f8")]),
                ("<f8", [numcodecs.Quantize(2, "<f8", "<f4")]), ("<f4", [numcodecs.BitRound(10)]),
                ("<f8", [numcodecs.FixedScaleOffset(-100, 0.5, "<f8", "<i4")]), ("<f4", [numcodecs.FixedScaleOffset(3, 2, "<f4", "<u4")]),
                ("<i4", [numcodecs.FixedScaleOffset(10, 1, "<i4", "<u2")]), ("|b1", [numcodecs.PackBits()])):
            for order, compressor in (("C", None), ("F", numcodecs.Zlib(1))):
                volume = (ramp > 30000) if dtype == "|b1" else (ramp % 30000).astype(dtype)
                path = self.array2(volume, filters=filters, order=order, compressor=compressor)
                # What the library itself reads back: some of them round.
                self.same(path, np.asarray(zarr.open(str(path), mode="r")), f"{filters} {order}")
        wrapping = np.random.default_rng(2).integers(0, 256, (5, 6, 7)).astype("u1")
        self.same(self.array2(wrapping, filters=[numcodecs.Delta("|u1")]), wrapping)

    def test_orders_of_axes_in_version_3(self):
        volume = noise(5, 7, 9)
        for order in itertools.permutations(range(3)):
            for last in LITTLE, BIG:
                codecs = [{"name": "transpose", "configuration": {"order": order}}, last]
                self.same(self.array3(volume, codecs, (2, 3, 4)), volume, str(order))
        twice = [{"name": "transpose", "configuration": {"order": order}} for order in ((1, 2, 0), (2, 1, 0))]
        self.same(self.array3(volume, [*twice, LITTLE, {"name": "gzip", "configuration": {"level": 1}}], (2, 3, 4)), volume)
        picture = noise(6, 8, dtype="<f4")
        self.same(self.array3(picture, [{"name": "transpose", "configuration": {"order": (1, 0)}}, LITTLE], (4, 3)), picture)
        for order in (0, 1), (0, 0, 1), (0, 1, 3), (0, 1, -1), "Q", None:
            codecs = [{"name": "transpose", "configuration": {"order": order}}, LITTLE]
            self.assertIn("transpose", self.refused(self.array3(volume, codecs, (2, 3, 4), pack=lambda block: b"")))

    def test_numcodecs_in_version_3(self):
        volume = noise(5, 7, 9, dtype="<i2")
        delta = {"name": "numcodecs.delta", "configuration": {"dtype": "<i2"}}
        turn = {"name": "transpose", "configuration": {"order": (2, 0, 1)}}
        offset = {"name": "numcodecs.fixedscaleoffset", "configuration": {"offset": 10, "scale": 1, "dtype": "<i2", "astype": "<i4"}}
        for codecs in ([LITTLE, {"name": "numcodecs.lz4"}], [LITTLE, {"name": "numcodecs.lzma"}], [LITTLE, {"name": "numcodecs.bz2"}],
                       [LITTLE, {"name": "numcodecs.shuffle", "configuration": {"elementsize": 2}}, {"name": "numcodecs.zlib"}],
                       [LITTLE, {"name": "numcodecs.crc32"}], [LITTLE, {"name": "numcodecs.zlib"}, {"name": "numcodecs.adler32"}],
                       [delta, LITTLE], [delta, BIG], [turn, delta, LITTLE], [delta, turn, BIG], [delta, turn, turn, LITTLE, {"name": "zstd"}],
                       [offset, LITTLE], [LITTLE, {"name": "gzip"}, {"name": "zstd"}]):
            self.same(self.array3(volume, codecs, (2, 3, 4)), volume, str(codecs))

    def test_an_unknown_codec_is_named(self):
        volume = noise(4, 4, 4)
        for name in "numcodecs.pcodec", "zfpy", "vlen-utf8", "q" * 5000:
            said = self.refused(self.array3(volume, [LITTLE, {"name": name}], (2, 2, 2), pack=lambda block: b""))
            self.assertIn(name[:20], said)
        for codecs, word in (([], "bytes"), ([{"name": "zstd"}, LITTLE], "before"), ([LITTLE, LITTLE], "twice"), ("bytes", "list"), ([5], "list"),
                             ([LITTLE, {"name": "numcodecs.delta", "configuration": {"dtype": "<u2"}}], "behind")):
            self.assertIn(word, self.refused(self.array3(volume, codecs, (2, 2, 2), pack=lambda block: b"")))
        path = self.array2(volume, compressor=None)
        good = json.loads((path / ".zarray").read_text())
        for field, value, word in (("compressor", {"id": "snappy"}, "snappy"), ("filters", [{"id": "categorize"}], "categorize"),
                                   ("filters", [{"id": "delta", "dtype": "<f4"}], "delta"), ("filters", [{"id": "packbits"}], "packbits"),
                                   ("filters", [{"id": "fixedscaleoffset", "dtype": "<u2", "scale": 0, "offset": 0}], "scale"),
                                   ("filters", [{"id": "shuffle", "elementsize": 0}], "elementsize"), ("filters", 3, "description")):
            (path / ".zarray").write_text(json.dumps({**good, field: value}))
            self.assertIn(word, self.refused(path))

    def test_damaged_chunks(self):
        volume = noise(4, 5, 6)
        for codec in numcodecs.LZ4(), numcodecs.LZMA(), numcodecs.CRC32(), numcodecs.Shuffle(2):
            path = self.array2(volume, compressor=codec)
            chunk = path / "0.0.0"
            data = chunk.read_bytes()
            rng = np.random.default_rng(9)
            broken = [b"", data[:3], data[:len(data) // 2], data + data, data[:-1]]
            if codec.codec_id != "shuffle":
                broken += [bytes(len(data)), b"\xff" * len(data)]
            for bad in broken:
                chunk.write_bytes(bad)
                self.refused(path, verb="warp")
            for _ in range(4):  # any byte changed: refused, or other samples, never a crash
                bad = bytearray(data)
                for place in rng.integers(0, len(bad), 3):
                    bad[place] ^= int(rng.integers(1, 256))
                chunk.write_bytes(bytes(bad))
                done = subprocess.run([COMMAND, "warp", path, "-o", "null:"], capture_output=True, env=self.env, timeout=60)
                self.assertIn(done.returncode, (0, 4))

    def test_fill_values(self):
        for dtype, fill, right in (("<f4", "0x7fc00000", np.nan), ("<f4", "0x3fc00000", 1.5), ("<f8", "0xc000000000000000", -2.0), ("<f2", "0x3e00", 1.5),
                                   ("<f4", "NaN", np.nan), ("<f4", "Infinity", np.inf), ("<f8", "-Infinity", -np.inf), ("<f4", 2, 2), ("<u2", 7, 7),
                                   ("<i4", -7, -7), ("<u2", "9", 9), ("<f4", "2.5", 2.5), ("<u8", 300, 300), ("<i8", -3.0, -3), ("bool", True, 1)):
            for endian in LITTLE, BIG:
                volume = np.zeros((4, 3, 6), dtype)
                path = self.array3(volume, [endian], (2, 3, 3), pack=lambda block: None, fill=fill)
                self.same(path, np.full(volume.shape, right), f"{dtype} {fill}")
        for dtype, fill in (("<f4", "0x7fc0"), ("<f4", "0x"), ("<f4", "0x7fc0000g"), ("<u2", "0x0007"), ("<u2", "x"), ("<u2", 1.5), ("<u2", -1), ("<f4", [])):
            path = self.array3(np.zeros((2, 2, 2), dtype), [LITTLE], (2, 2, 2), fill=fill)
            self.assertIn("fill_value", self.refused(path))


class Shards(Case):
    def sharded(self, volume, shard, chunk, codecs, before=(), index=(LITTLE, CRC), location=None, fill=0, path=None, pack=None, holes=(), order=None):
        settings = {"chunk_shape": chunk, "codecs": codecs, "index_codecs": index}
        if location:
            settings["index_location"] = location
        outer = [*before, {"name": "sharding_indexed", "configuration": settings}]

        def usual(block):
            for codec in before:
                block = block.transpose(codec["configuration"]["order"])
            return shard_of(block, chunk, codecs, location == "start", index, order, holes)
        return self.array3(volume, outer, shard, pack or usual, fill, path)

    def test_shards_of_all_kinds(self):
        zipped = {"name": "gzip", "configuration": {"level": 1}}
        blosc = {"name": "blosc", "configuration": {"cname": "lz4", "clevel": 5, "shuffle": 1}}
        backwards = lambda count: reversed(range(count))  # noqa: E731
        for dtype, shape, shard, chunk, codecs, more in (
                ("<u2", (5, 7, 9), (4, 4, 6), (2, 2, 3), [LITTLE], {}),
                (">i2", (5, 7, 9), (4, 4, 6), (2, 4, 3), [BIG, zipped], {"location": "start"}),
                ("<f4", (6, 6, 6), (6, 6, 6), (1, 2, 3), [LITTLE, {"name": "zstd"}, CRC], {"order": backwards}),
                ("u1", (9, 8, 3), (9, 8, 4), (3, 4, 2), [{"name": "transpose", "configuration": {"order": (2, 0, 1)}}, LITTLE, blosc], {"index": (BIG, CRC)}),
                ("<u4", (5, 6, 7), (2, 6, 4), (1, 3, 4), [LITTLE, CRC], {"index": (LITTLE,), "location": "end"}),
                ("<i8", (5, 6, 7), (4, 4, 4), (2, 2, 2), [LITTLE], {}),
                ("bool", (5, 6, 7), (4, 4, 4), (2, 2, 2), [LITTLE], {"location": "start", "order": backwards})):
            volume = noise(*shape, dtype=dtype) if dtype != "bool" else noise(*shape) > 100
            self.same(self.sharded(volume, shard, chunk, codecs, **more), volume, f"{dtype} {codecs} {more}")

    def test_a_transposed_shard(self):
        """Sides of chunks are those of the transposed shard."""
        volume = noise(6, 8, 10)
        for order in (2, 1, 0), (1, 2, 0), (0, 2, 1):
            turn = {"name": "transpose", "configuration": {"order": order}}
            shard = (4, 4, 8)
            chunk = tuple(np.array((2, 4, 4))[list(order)].tolist())
            for inner in ([LITTLE], [{"name": "transpose", "configuration": {"order": (1, 2, 0)}}, BIG]):
                self.same(self.sharded(volume, shard, chunk, inner, before=(turn,)), volume, str(order))

    def test_chunks_and_shards_that_are_missing_are_the_fill_value(self):
        volume = noise(4, 4, 6) + 1
        right = volume.copy()
        right[0:1, 0:2, 3:6] = right[3:4, 0:2, 0:3] = 9  # chunks 1 of the first and 4 of the second shard
        self.same(self.sharded(volume, (4, 2, 6), (1, 2, 3), [LITTLE], holes=(1,), fill=9,
                               pack=lambda block: shard_of(block, (1, 2, 3), [LITTLE], holes=(1, 6)) if (block == volume[:, :2]).all() else None),
                  np.where(np.arange(4)[None, :, None] < 2, right, 9))

    def test_an_image_of_several_axes_reads_what_is_asked(self):
        volume = noise(2, 3, 4, 5, 6)
        axes = [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"}, *SPACE]
        path = self.path()
        path.mkdir()
        ome = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": [
            {"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 3, 2, 1]}]}]}]}
        (path / "zarr.json").write_text(json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}}))
        self.sharded(volume, (1, 2, 4, 6, 6), (1, 1, 2, 3, 3), [LITTLE], path=path / "0")
        np.testing.assert_allclose(self.info(path, "--time", 0)["spacing"], [1e-3, 2e-3, 3e-3])
        for time, channel in ((0, 0), (1, 2)):
            np.testing.assert_array_equal(self.samples(path, "--time", time, "--channel", channel)[..., 0], volume[time, channel])
        np.testing.assert_array_equal(self.samples(path, "--time", 1), np.moveaxis(volume[1], 0, -1))

    def test_what_is_wrong_about_shards_is_said(self):
        volume = noise(4, 4, 6)
        settings = {"chunk_shape": (2, 2, 3), "codecs": [LITTLE], "index_codecs": [LITTLE, CRC]}
        nested = {"name": "sharding_indexed", "configuration": {**settings, "chunk_shape": (1, 1, 1)}}
        for field, value, word in (("chunk_shape", (3, 2, 3), "divide"), ("chunk_shape", (2, 2), "axes"), ("codecs", [nested], "within"),
                                   ("index_codecs", [LITTLE, {"name": "gzip"}], "gzip"), ("index_codecs", [], "bytes"), ("codecs", [], "bytes"),
                                   ("index_location", "middle", "index_location"), ("chunk_shape", (0, 2, 3), "chunk_shape")):
            codecs = [{"name": "sharding_indexed", "configuration": {**settings, field: value}}]
            self.assertIn(word, self.refused(self.array3(volume, codecs, (4, 4, 6), pack=lambda block: b"")))
        codecs = [{"name": "sharding_indexed", "configuration": settings}, {"name": "gzip"}]
        self.assertIn("behind sharding_indexed", self.refused(self.array3(volume, codecs, (4, 4, 6), pack=lambda block: b"")))

    def test_hostile_shards(self):
        volume = noise(4, 4, 6)
        path = self.sharded(volume, (4, 4, 6), (2, 2, 3), [LITTLE], index=(LITTLE,))
        file = path / "c/0/0/0"
        good = file.read_bytes()
        table = len(good) - 16 * 8
        for place, number in ((0, len(good)), (0, EMPTY), (8, EMPTY), (8, len(good)), (8, 23), (8, 25), (8, 0), (8, 1 << 40), (0, 1 << 63)):
            bad = bytearray(good)
            bad[table + place:table + place + 8] = struct.pack("<Q", number)
            file.write_bytes(bytes(bad))
            self.refused(path, verb="warp")
        for bad in b"", good[:50], good[table + 1:]:
            file.write_bytes(bad)
            self.refused(path, verb="warp")
        # A wrong sum of the index.
        path = self.sharded(volume, (4, 4, 6), (2, 2, 3), [LITTLE])
        file = path / "c/0/0/0"
        data = file.read_bytes()
        file.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
        self.assertIn("checksum", self.refused(path, verb="warp"))
        # Shards of a million million chunks, chunks that hold a gigabyte of nothing, a sparse file of a terabyte.
        huge = {"name": "sharding_indexed", "configuration": {"chunk_shape": (1, 1, 1), "codecs": [LITTLE], "index_codecs": [LITTLE]}}
        self.assertIn("chunks in a shard", self.refused(self.described(volume.shape, [huge], (10000, 10000, 10000))))
        path = self.described((4, 4, 6), [huge], (100, 100, 100))
        (path / "c/0/0").mkdir(parents=True)
        (path / "c/0/0/0").write_bytes(b"12")
        self.assertIn("too short", self.refused(path, verb="warp"))
        path = self.described((4, 4, 6), [LITTLE, {"name": "zstd"}], (4, 4, 6))
        (path / "c/0/0").mkdir(parents=True)
        with open(path / "c/0/0/0", "wb") as sparse:
            sparse.truncate(1 << 40)
        self.refused(path, verb="warp", limit=4 << 30)

    def described(self, shape, codecs, sides, dtype="uint16"):
        path = self.path()
        path.mkdir()
        (path / "zarr.json").write_text(json.dumps({
            "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": dtype, "fill_value": 0,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": sides}},
            "chunk_key_encoding": {"name": "default"}, "codecs": codecs}))
        return path

    def test_huge_shapes_of_tiny_chunks(self):
        path = self.described((1 << 20, 1 << 20, 1 << 20), [LITTLE], (1, 1, 1))
        self.run_it("warp", path, "-o", "null:", code=3, limit=4 << 30)
        path = self.described((1 << 19, 1 << 19, 1 << 19), [LITTLE], (1, 1, 1), "int64")
        self.assertIn("more than the limit", self.refused(path, limit=4 << 30))


class Zipped(Case):
    def packed(self, folder, method=zipfile.ZIP_STORED, inside="", ending=".zarr.zip", directories=True, front=b"", comment=b""):
        path = self.path(ending)
        path.write_bytes(front)
        with zipfile.ZipFile(path, "a" if front else "w", method) as out:
            out.comment = comment
            for file in sorted(folder.rglob("*")):
                if file.is_file() or directories:
                    out.write(file, inside + str(file.relative_to(folder)))
        return path

    def image(self, volume, **more):
        path = self.path()
        group = zarr.open_group(str(path), mode="w")
        group.create_dataset("0", data=volume, chunks=(3, 4, 5), **more)
        group.attrs["multiscales"] = [{"version": "0.4", "axes": SPACE, "datasets": [
            {"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [3, 2, 1]}]}]}]
        return path

    def test_one_file_is_read_as_the_folder(self):
        volume = noise(7, 9, 11)
        for codec in None, numcodecs.Zlib(1), numcodecs.Blosc("zstd"):
            folder = self.image(volume, compressor=codec)
            for method, inside, ending, front in ((zipfile.ZIP_STORED, "", ".zarr.zip", b""), (zipfile.ZIP_DEFLATED, "", ".zip", b""),
                                                  (zipfile.ZIP_STORED, "", ".ozx", b""), (zipfile.ZIP_DEFLATED, "image.zarr/", ".zip", b"#!/bin/sh\n"),
                                                  (zipfile.ZIP_STORED, "a/b/", ".odd", b"")):
                path = self.packed(folder, method, inside, ending, directories=inside == "", front=b"" if ending == ".odd" else b"", comment=b"c" * 300)
                self.same(path, volume)
                np.testing.assert_allclose(self.info(path)["spacing"], [1e-3, 2e-3, 3e-3])
        # What python3-zarr writes, with names that are there twice.
        path = self.path(".zip")
        store = zarr.ZipStore(str(path), mode="w")
        array = zarr.create(shape=volume.shape, chunks=(4, 5, 6), dtype=volume.dtype, store=store)
        array[:] = volume
        store.close()
        self.same(path, volume)

    def test_shards_in_a_zip_file(self):
        volume = noise(6, 8, 10)
        settings = {"chunk_shape": (2, 2, 5), "codecs": [LITTLE], "index_codecs": [LITTLE, CRC]}
        folder = self.array3(volume, [{"name": "sharding_indexed", "configuration": settings}], (4, 4, 10), lambda block: shard_of(block, (2, 2, 5), [LITTLE]))
        for method in zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED:
            self.same(self.packed(folder, method, ending=".ozx"), volume)

    def test_zip64(self):
        volume = noise(4, 5, 6)
        folder = self.array2(volume, compressor=None)
        path = self.path(".zip")
        with zipfile.ZipFile(path, "w") as out:
            for file in folder.rglob("*"):
                with out.open(file.name, "w", force_zip64=True) as to:
                    to.write(file.read_bytes())
        self.same(path, volume)
        # All numbers of the directory and of its end in their wide fields.
        entries, body = b"", b""
        files = sorted(folder.rglob("*"))
        for file in files:
            name, data = file.name.encode(), file.read_bytes()
            at, crc = len(body), zlib.crc32(data)
            body += struct.pack("<IHHHHHIIIHH", 0x04034b50, 45, 0, 0, 0, 0, crc, len(data), len(data), len(name), 0) + name + data
            extra = struct.pack("<HHQQQ", 1, 24, len(data), len(data), at)
            entries += struct.pack("<IHHHHHHIIIHHHHHII", 0x02014b50, 45, 45, 0, 0, 0, 0, crc, 0xffffffff, 0xffffffff, len(name), len(extra), 0, 0, 0, 0,
                                   0xffffffff) + name + extra
        end = len(body) + len(entries)
        wide = struct.pack("<IQHHIIQQQQ", 0x06064b50, 44, 45, 45, 0, 0, len(files), len(files), len(entries), len(body))
        wide += struct.pack("<IIQI", 0x07064b50, 0, end, 1) + struct.pack("<IHHHHIIH", 0x06054b50, 0, 0, 0xffff, 0xffff, 0xffffffff, 0xffffffff, 0)
        path = self.path(".ozx")
        path.write_bytes(body + entries + wide)
        self.same(path, volume)

    def test_paths_that_lead_into_a_zip_file(self):
        folder = self.image(noise(4, 5, 6))
        labels = zarr.open_group(str(folder / "labels"), mode="w")
        labels.attrs["labels"] = ["cells"]
        cells = labels.create_group("cells")
        cells.create_dataset("0", data=noise(4, 5, 6, seed=4), chunks=(4, 5, 6))
        cells.attrs.update({"multiscales": [{"version": "0.4", "axes": SPACE, "datasets": [{"path": "0"}]}], "image-label": {"version": "0.4"}})
        path = self.packed(folder)
        for inner in "labels", "labels/cells", "labels/cells/0", "labels/":
            self.same(f"{path}/{inner}", noise(4, 5, 6, seed=4))
        self.same(f"{path}/0", noise(4, 5, 6))
        self.assertIn("none", self.refused(f"{path}/none"))

    def test_hostile_zip_files(self):
        folder = self.array2(noise(4, 5, 6), compressor=None)
        for method in zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED:
            good = self.packed(folder, method).read_bytes()
            central, end = good.index(b"PK\1\2"), good.index(b"PK\5\6")
            path = self.path(".zip")

            def check(bad, codes=(4,)):
                path.write_bytes(bytes(bad))
                done = subprocess.run([COMMAND, "warp", path, "-o", "null:"], capture_output=True, env=self.env, timeout=60,
                                      preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)))
                self.assertIn(done.returncode, codes, done.stderr)
                if done.returncode:
                    self.assertIn(str(path), done.stderr.decode())
            for at in (central, end, 4, len(good) - 1):
                check(good[:at])
            # Each number of the first entry and of the end: small, large, larger than the file.
            for at, size in ((central + 10, 2), (central + 20, 4), (central + 24, 4), (central + 28, 2), (central + 30, 2), (central + 42, 4),
                             (end + 12, 4), (end + 16, 4)):
                for number in 1, (1 << 8 * size) - 2:
                    bad = bytearray(good)
                    bad[at:at + size] = number.to_bytes(size, "little")
                    check(bad, (0, 4))
            rng = np.random.default_rng(3)
            for _ in range(6):
                bad = bytearray(good)
                for place in rng.integers(0, len(bad), 4):
                    bad[place] = int(rng.integers(0, 256))
                check(bad, (0, 3, 4))
        # A chunk that unpacks to a gigabyte.
        path = self.path(".zip")
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as out:
            for file in folder.rglob("*"):
                if file.name != "0.0.0":
                    out.write(file, file.name)
            with out.open("0.0.0", "w") as to:
                for _ in range(256):
                    to.write(bytes(1 << 20))
        self.assertIn("expected at most", self.refused(path, verb="warp", limit=4 << 30))
        # No Zarr, several of it, a password.
        for names, word in ((["a.txt"], "holds no Zarr"), (["a.zarr/.zgroup", "b.zarr/.zgroup"], "several"), ([], "holds no Zarr")):
            path = self.path(".zip")
            with zipfile.ZipFile(path, "w") as out:
                for name in names:
                    out.writestr(name, "{}")
            self.assertIn(word, self.refused(path))
        path = self.packed(folder)
        data = bytearray(path.read_bytes())
        at = data.index(b"PK\1\2")
        while at >= 0:
            data[at + 8] |= 1
            at = data.find(b"PK\1\2", at + 1)
        path.write_bytes(bytes(data))
        self.assertIn("encrypted", self.refused(path))


class Groups(Case):
    def group(self, path, **attributes):
        group = zarr.open_group(str(path), mode="a")
        group.attrs.update(attributes)
        return path

    def image(self, path, volume, axes=SPACE, scale=(1, 1, 1), **more):
        group = zarr.open_group(str(path), mode="w")
        group.create_dataset("0", data=volume, chunks=volume.shape)
        group.attrs.update({"multiscales": [{"version": "0.4", "axes": axes, "datasets": [
            {"path": "0", "coordinateTransformations": [{"type": "scale", "scale": list(scale)}]}]}], **more})
        return path

    def test_units_of_some_axes(self):
        def axes(*units):
            return [{"name": n, "type": "space", **({"unit": u} if u else {})} for n, u in zip("zyx", units)]
        for units, spacing, unit, word in (
                ((None, "micrometer", "micrometer"), (3e-3, 2e-3, 1e-3), "mm", "z has no unit"), (("micrometer", None, None), (3e-3, 2e-3, 1e-3), "mm", "x has no unit"),
                (("micrometer", "nanometer", "nanometer"), (3e-3, 2e-6, 1e-6), "mm", None), (("millimeter", "micrometer", None), (3, 2e-3, 1e-3), "mm", "x has no unit"),
                (("pixel", "micrometer", "micrometer"), (3e-3, 2e-3, 1e-3), "mm", "'pixel' of z"), ((None, None, None), (3, 2, 1), None, None),
                (("pixel", "pixel", "pixel"), (3, 2, 1), None, "not known"), ((None, "nanometer", "angstrom"), (3e-7, 2e-6, 1e-7), "mm", "'angstrom'"),
                (("picometer", "picometer", "picometer"), (3e-9, 2e-9, 1e-9), "mm", None)):
            told = self.info(self.image(self.path(), noise(3, 4, 5), axes(*units), (3, 2, 1)))
            np.testing.assert_allclose(told["spacing"], spacing[::-1], rtol=1e-9, err_msg=str(units))
            self.assertEqual(told["unit"], unit)
            self.assertIn(word or "", " ".join(told["warnings"]))
            self.assertEqual(bool(told["warnings"]), word is not None)
        flat = [{"name": "y", "type": "space", "unit": "micrometer"}, {"name": "x", "type": "space"}]
        told = self.info(self.image(self.path(), noise(4, 5), flat, (2, 1)))
        np.testing.assert_allclose(told["spacing"][:2], (1e-3, 2e-3))

    def test_labels_beside_an_image(self):
        root = self.image(self.path(), noise(3, 4, 5))
        labels = self.group(root / "labels", labels=["cells"])
        self.image(labels / "cells", noise(3, 4, 5, dtype="<u4", seed=2), **{"image-label": {"version": "0.4"}})
        self.same(labels, noise(3, 4, 5, seed=2))
        self.assertEqual(self.info(root)["extent"], [5, 4, 3])
        self.group(labels, labels=["cells", "nuclei"])
        self.image(labels / "nuclei", noise(2, 2, 2, seed=3))
        said = self.refused(labels, code=2)
        self.assertIn("'cells', 'nuclei'", said)
        self.assertIn("--series 0 ... 1", said)
        for series in 1, "nuclei":
            self.assertEqual(self.info(labels, "--series", series)["extent"], [2, 2, 2])
        for series in "other", "2", "../0", "/etc":
            self.assertIn("'cells', 'nuclei'", self.refused(labels, "--series", series, code=2))
        self.group(labels, labels=["../0"])
        self.refused(labels)
        self.group(labels, labels=[])
        self.assertIn("no label images", self.refused(labels))

    def test_a_message_names_what_a_group_holds(self):
        path = self.group(self.path())
        self.assertIn("no image and no array", self.refused(path))
        self.array2(noise(3, 4, 5), path / "raw")
        self.same(path, noise(3, 4, 5))  # the only one
        self.same(path / "raw", noise(3, 4, 5))
        self.array2(noise(2, 2, 2), path / "mask")
        self.group(path / "tables")
        self.group(path / "labels", labels=["cells"])
        said = self.refused(path, code=2)
        for word in "arrays 'mask', 'raw'", "labels 'labels/cells'", "groups 'tables'", "--series 0 ... 1", f"{path}/mask":
            self.assertIn(word, said)
        self.assertEqual(self.info(path, "--series", "raw")["extent"], [5, 4, 3])
        self.assertEqual(self.info(path, "--series", 0)["extent"], [2, 2, 2])
        # An image among other things is what is meant.
        self.image(path / "image", noise(4, 4, 4))
        self.assertEqual(self.info(path)["extent"], [4, 4, 4])

    def test_version_3_groups(self):
        path = self.path()
        path.mkdir()
        (path / "zarr.json").write_text('{"zarr_format": 3, "node_type": "group"}')
        for name, side in ("b", 3), ("a10", 4), ("a2", 5):
            self.array3(noise(side, side, side), [LITTLE], (2, 2, 2), path=path / name)
        self.assertIn("'a2', 'a10', 'b'", self.refused(path, code=2))
        self.same(path / "a10", noise(4, 4, 4))

    def test_plates_name_their_wells(self):
        path = self.group(self.path(), plate={"wells": [{"path": "A/1"}, {"path": "B/12"}]})
        for well, fields in (("A/1", 1), ("B/12", 2)):
            self.group(path / well, well={"images": [{"path": str(i)} for i in range(fields)]})
            for i in range(fields):
                self.image(path / well / str(i), noise(2 + i, 4, 5))
        said = self.refused(path)
        self.assertIn("plate of 2 wells, 'A/1', 'B/12'", said)
        self.assertIn(f"{path}/A/1/0", said)
        self.assertEqual(self.info(path / "A/1")["extent"], [5, 4, 2])
        self.assertIn("'0', '1'", self.refused(path / "B/12", code=2))
        self.assertEqual(self.info(path / "B/12", "--series", 1)["extent"], [5, 4, 3])
        self.assertEqual(self.info(path, "--series", "B/12/1")["extent"], [5, 4, 3])
        self.assertEqual(self.info(path, "--series", 0)["extent"], [5, 4, 2])


if __name__ == "__main__":
    unittest.main()
