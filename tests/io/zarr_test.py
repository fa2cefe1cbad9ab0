"""OME-Zarr and plain Zarr arrays as Debian's python3-zarr writes them, and what version 3 says, read through the command.
Needs EDGEWISE."""

import itertools
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import numcodecs
import numpy as np
import zarr

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from formats_test import read_nrrd  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
CODECS = {"none": None, "zlib": numcodecs.Zlib(1), "gzip": numcodecs.GZip(1), "bz2": numcodecs.BZ2(1), "zstd": numcodecs.Zstd(1),
          **{f"blosc {name}": numcodecs.Blosc(name, 5, shuffle) for name, shuffle in (("lz4", 1), ("blosclz", 0), ("zlib", 2), ("zstd", 1))}}


def noise(*shape, dtype="<u2", seed=1):
    return (np.random.default_rng(seed).integers(0, 200, shape)).astype(dtype)


def crc32c(data):
    crc = 0xffffffff
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82f63b78 if crc & 1 else 0)
    return crc ^ 0xffffffff


class Zarr(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)
        self.env = {**os.environ, "XDG_CONFIG_HOME": str(self.folder / "c"), "XDG_CACHE_HOME": str(self.folder / "k")}

    def run_it(self, *words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, env=self.env, timeout=60)
        self.assertEqual(done.returncode, code, (words, done.stderr.decode()))
        return done

    def refused(self, path, *words, code=4):
        said = self.run_it("info", path, *words, code=code).stderr.decode()
        self.assertIn(str(path), said)
        return said

    def info(self, path, *words):
        return json.loads(self.run_it("info", path, "--json", "-", *words).stdout)

    def samples(self, path, *words):
        out = self.folder / "out.nrrd"
        self.run_it("warp", path, "-o", out, "--quiet", *words)
        return read_nrrd(out)

    def array(self, volume, name="a.zarr", chunks=(4, 5, 6), codec=None, **more):
        array = zarr.open(str(self.folder / name), mode="w", shape=volume.shape, chunks=chunks, dtype=volume.dtype, compressor=codec, **more)
        array[:] = volume
        return self.folder / name

    def image(self, levels, axes, scales, name="i.zarr", move=None, separator="/", codec=None, whole=None, **more):
        """An OME-Zarr 0.4 image."""
        path = self.folder / name
        group = zarr.open_group(str(path), mode="w")
        datasets = []
        for i, (volume, scale) in enumerate(zip(levels, scales)):
            group.create_dataset(str(i), data=volume, chunks=tuple(min(5, n) for n in volume.shape), compressor=codec,
                                 dimension_separator=separator)
            transforms = [{"type": "scale", "scale": scale}]
            if move:
                transforms.append({"type": "translation", "translation": move})
            datasets.append({"path": str(i), "coordinateTransformations": transforms})
        multiscales = {"version": "0.4", "axes": axes, "datasets": datasets}
        if whole:
            multiscales["coordinateTransformations"] = [{"type": "scale", "scale": whole}]
        group.attrs.update({"multiscales": [multiscales], **more})
        return path

    SPACE = [{"name": n, "type": "space", "unit": "micrometer"} for n in "zyx"]

    def test_every_codec_order_and_edge_of_chunks(self):
        volume = noise(9, 11, 13)
        for (name, codec), order, separator in zip(CODECS.items(), itertools.cycle("CFC"), itertools.cycle("./")):
            path = self.array(volume, codec=codec, order=order, dimension_separator=separator)
            np.testing.assert_array_equal(self.samples(path), volume, f"{name} {order} {separator}")

    def test_every_type_and_byte_order(self):
        for dtype in ("|u1", "|i1", "<u2", ">u2", "<i2", ">i2", "<u4", ">i4", "<f2", ">f4", "<f4", "<f8", ">f8", "<i8", ">u8", "|b1"):
            volume = noise(3, 4, 5, dtype=dtype)
            path = self.array(volume, codec=numcodecs.Zstd(1))
            np.testing.assert_array_equal(self.samples(path).astype(float), volume.astype(float), dtype)
        self.assertEqual(self.info(self.array(noise(3, 4, 5, dtype="<i8")))["type"], "u8")
        self.assertEqual(self.info(self.array(noise(3, 4, 5, dtype="<i8") + 5000))["type"], "i16")

    def test_missing_chunks_are_the_fill_value(self):
        for dtype, fill in (("<i2", -7), (">f4", 2.5), ("<f4", "NaN"), ("<i8", -3)):
            path = self.folder / "f.zarr"
            array = zarr.open(str(path), mode="w", shape=(6, 6, 6), chunks=(3, 3, 3), dtype=dtype, fill_value=float(fill) if fill == "NaN" else fill)
            array[:3, :3, :3] = 5
            expected = np.full((6, 6, 6), float(fill))
            expected[:3, :3, :3] = 5
            np.testing.assert_array_equal(self.samples(path).astype(float), expected, dtype)

    def test_levels_have_their_own_extent_spacing_and_origin(self):
        levels = [noise(8, 16, 12), noise(8, 8, 6, seed=2), noise(4, 4, 3, seed=3)]
        scales = [[2, 0.5, 0.25], [2, 1, 0.5], [4, 2, 1]]
        path = self.image(levels, self.SPACE, scales, move=[10, 20, 30])
        for level, (volume, scale) in enumerate(zip(levels, scales)):
            facts = self.info(path, "--level", level)
            self.assertEqual(facts["extent"], list(volume.shape[::-1]))
            np.testing.assert_allclose(facts["spacing"], np.array(scale[::-1]) * 1e-3)
            np.testing.assert_allclose(facts["origin"], [0.03, 0.02, 0.01])
            self.assertEqual((facts["unit"], facts["format"], facts["level"]), ("mm", "OME-Zarr", level))
            self.assertEqual(facts["levels"], [list(v.shape[::-1]) for v in levels])
            np.testing.assert_array_equal(self.samples(path, "--level", level), volume)
        self.assertIn("resolutions 0 to 2", self.refused(path, "--level", 3, code=2))
        self.assertIn("holds one resolution", self.refused(self.array(noise(3, 3, 3)), "--level", 1, code=2))
        self.assertIn("--level is about files", self.run_it("info", "phantom:gaussians:8", "--level", "1", code=2).stderr.decode())

    def test_a_coarse_picture_reads_a_coarse_level_alone(self):
        fine, coarse = noise(32, 32, 32), noise(8, 8, 8, seed=2)
        path = self.image([fine, coarse], self.SPACE, [[1, 1, 1], [4, 4, 4]])
        words = ("render", path, "-o", self.folder / "p.nrrd", "--size", 8, "--view", "z", "--mode", "mip", "--log", "info")
        self.assertIn("--level 1 is as fine", self.run_it(*words).stderr.decode())
        for chunk in (path / "0").rglob("*"):
            if chunk.is_file() and not chunk.name.startswith("."):
                chunk.unlink()
        for level in 1, "auto":
            self.assertNotIn("is as fine", self.run_it(*words, "--level", level).stderr.decode())
            np.testing.assert_array_equal(read_nrrd(self.folder / "p.nrrd").squeeze(), coarse.max(0))

    def test_the_level_follows_the_result(self):
        levels = [noise(32, 32, 32), noise(16, 16, 16, seed=2), noise(8, 8, 8, seed=3)]
        path = self.image(levels, self.SPACE, [[1, 1, 1], [2, 2, 2], [4, 4, 4]])
        for size, level in (None, 0), (32, 0), (17, 0), (16, 1), (9, 1), (8, 2), (3, 2):
            words = ("render", path, "--view", "z", "--mode", "mip", *(("--size", size) if size else ()))
            self.run_it(*words, "-o", self.folder / "auto.nrrd", "--level", "auto")
            self.run_it(*words, "-o", self.folder / "named.nrrd", "--level", level)
            self.assertEqual((self.folder / "auto.nrrd").read_bytes(), (self.folder / "named.nrrd").read_bytes(), size)
        for words, said in ((("--clip", "0,0,0,5,5,5"), "--clip counts samples"), (("--perspective", 30, "--eye", "1,2,3"), "--eye counts samples"),
                            (("--matrix", "1,0,0,0,1,0,0,0,1"), "--matrix counts samples")):
            self.assertIn(said, self.run_it("render", path, "-o", "null:", "--level", "auto", *words, code=2).stderr.decode())
        self.assertIn("name a number", self.run_it("info", path, "--level", "auto", code=2).stderr.decode())
        one = self.array(noise(6, 6, 6))
        self.run_it("render", one, "-o", self.folder / "p.nrrd", "--level", "auto", "--size", 3)

    def test_the_same_place_is_seen_at_every_level(self):
        z, y, x = np.meshgrid(*[np.arange(n) for n in (24, 24, 24)], indexing="ij")
        fine = (100 * np.exp(-((x - 15) ** 2 + (y - 9) ** 2 + (z - 11) ** 2) / 16)).astype("<f4")
        coarse = fine.reshape(12, 2, 12, 2, 12, 2).mean((1, 3, 5))
        path = self.image([fine, coarse], self.SPACE, [[1, 1, 1], [2, 2, 2]])
        centres = []
        for level in 0, 1:
            self.run_it("render", path, "--level", level, "-o", self.folder / "p.nrrd", "--size", "24x24", "--spacing", "0.001", "--mode", "xray", "--rotate", "20,30,0")
            picture = read_nrrd(self.folder / "p.nrrd").squeeze()
            v, u = np.indices(picture.shape)
            centres.append([(picture * u).sum() / picture.sum(), (picture * v).sum() / picture.sum()])
        np.testing.assert_allclose(*centres, atol=0.02)

    def test_channels_and_times(self):
        volume = noise(2, 3, 4, 5, 6)
        axes = [{"name": "t", "type": "time", "unit": "second"}, {"name": "c", "type": "channel"}, *self.SPACE]
        path = self.image([volume], axes, [[1, 1, 2, 1, 1]], whole=[0.1, 1, 1, 1, 3], codec=numcodecs.Blosc("lz4"))
        facts = self.info(path, "--time", 0)
        self.assertEqual((facts["channels"], facts["times"], facts["extent"]), (3, 2, [6, 5, 4]))
        np.testing.assert_allclose(facts["spacing"], [0.003, 0.001, 0.002])
        for time in 0, 1:
            for channel in 0, 2:
                np.testing.assert_array_equal(self.samples(path, "--time", time, "--channel", channel), volume[time, channel])
        np.testing.assert_array_equal(self.samples(path, "--time", 1), np.moveaxis(volume[1], 0, -1))
        self.run_it("warp", path, "-o", self.folder / "x.nrrd", code=2)

    def test_channels_are_merged_in_their_own_colours(self):
        axes = [{"name": "c", "type": "channel"}, *self.SPACE]
        path = self.image([noise(3, 4, 5, 6)], axes, [[1] * 4], omero={"channels": [{"color": "00FF80"}, {"color": "x"}, {}]})
        done = self.run_it("render", path, "--channel", "0,1,2", "-o", self.folder / "m.png", "--mode", "mip")
        self.assertIn("0 in #00ff80 and 1 in #00ff00 and 2 in #0000ff", done.stderr.decode())

    def test_a_picture_has_two_axes(self):
        for volume, axes in ((noise(7, 9), self.SPACE[1:]), (noise(1, 7, 9), self.SPACE)):
            facts = self.info(self.image([volume], axes, [[1] * volume.ndim]))
            self.assertEqual((facts["kind"], facts["extent"]), ("image", [9, 7]))

    def test_old_versions_name_no_axes(self):
        path = self.image([noise(1, 2, 3, 4, 5)], "tczyx", [[1] * 5])
        attributes = json.loads((path / ".zattrs").read_text())
        attributes["multiscales"][0]["axes"] = list("tczyx")
        (path / ".zattrs").write_text(json.dumps(attributes))
        self.assertEqual(self.info(path)["extent"], [5, 4, 3])
        del attributes["multiscales"][0]["axes"]
        del attributes["multiscales"][0]["datasets"][0]["coordinateTransformations"]
        (path / ".zattrs").write_text(json.dumps(attributes))
        facts = self.info(path)
        self.assertEqual((facts["extent"], facts["channels"], facts["unit"]), ([5, 4, 3], 2, None))

    def test_several_images_and_labels(self):
        root = self.folder / "s.zarr"
        zarr.open_group(str(root), mode="w").attrs["bioformats2raw.layout"] = 3
        for i in 0, 1:
            self.image([noise(3, 4, 5 + i)], self.SPACE, [[1, 1, 1]], name=f"s.zarr/{i}")
        self.assertIn("--series 0 ... 1", self.refused(root, code=2))
        self.assertEqual(self.info(root, "--series", 1)["extent"], [6, 4, 3])
        labels = self.image([noise(3, 4, 5, dtype="<i8")], self.SPACE, [[1, 1, 1]], name="l.zarr", **{"image-label": {"version": "0.4"}})
        np.testing.assert_array_equal(self.samples(labels), noise(3, 4, 5))
        plate = self.image([noise(3, 4, 5)], self.SPACE, [[1, 1, 1]], name="p.zarr", plate={})
        self.assertIn("plate", self.refused(plate))

    def version3(self, volume, codecs, pack, name="v.zarr", chunks=(2, 3, 4), encoding=None, **more):
        """An OME-Zarr 0.5 image of one level, from the text of the specification."""
        path = self.folder / name
        (path / "0").mkdir(parents=True)
        ome = {"version": "0.5", "multiscales": [{"axes": self.SPACE, "datasets": [
            {"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 2, 3]}]}]}]}
        (path / "zarr.json").write_text(json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {"ome": ome}}))
        array = {"zarr_format": 3, "node_type": "array", "shape": volume.shape, "data_type": volume.dtype.name, "fill_value": 0,
                 "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunks}},
                 "chunk_key_encoding": encoding or {"name": "default", "configuration": {"separator": "/"}}, "codecs": codecs, **more}
        (path / "0" / "zarr.json").write_text(json.dumps(array))
        for at in np.ndindex(*(-(-n // c) for n, c in zip(volume.shape, chunks))):
            chunk = np.zeros(chunks, volume.dtype)
            part = volume[tuple(slice(i * c, (i + 1) * c) for i, c in zip(at, chunks))]
            chunk[tuple(slice(n) for n in part.shape)] = part
            file = path / "0" / ("c/" + "/".join(map(str, at)) if encoding is None else ".".join(map(str, at)))
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(pack(chunk.tobytes()))
        return path

    def test_version_three(self):
        little, big = {"name": "bytes", "configuration": {"endian": "little"}}, {"name": "bytes", "configuration": {"endian": "big"}}
        gzip, sum_of = numcodecs.GZip(1).encode, {"name": "crc32c"}
        summed = lambda data: data + struct.pack("<I", crc32c(data))  # noqa: E731
        for i, (codecs, dtype, pack) in enumerate((
                ([little], "<u2", bytes), ([big], ">i2", bytes), ([little, {"name": "gzip"}], "<f4", gzip),
                ([little, {"name": "blosc"}], "<u2", numcodecs.Blosc("zstd").encode), ([little, {"name": "zstd"}], "<u2", numcodecs.Zstd(1).encode),
                ([little, sum_of], "<u2", summed), ([little, {"name": "zstd"}, sum_of], "<u2", lambda data: summed(numcodecs.Zstd(1).encode(data))))):
            volume = noise(5, 7, 9, dtype=dtype)
            path = self.version3(volume, codecs, pack, name=f"v{i}.zarr")
            np.testing.assert_array_equal(self.samples(path), volume, str(codecs))
            np.testing.assert_allclose(self.info(path)["spacing"], [3e-3, 2e-3, 1e-3])
        path = self.version3(volume, [little], bytes, name="old.zarr", encoding={"name": "v2"})
        np.testing.assert_array_equal(self.samples(path), volume)
        path = self.version3(volume, [{"name": "sharding_indexed"}], bytes, name="shard.zarr")
        self.assertIn("chunk_shape", self.refused(path))
        path = self.version3(volume, [little, sum_of], lambda data: data + b"1234", name="sum.zarr")
        self.assertIn("checksum", self.run_it("warp", path, "-o", "null:", code=4).stderr.decode())

    def test_damage_is_refused_with_its_place(self):
        for codec in (None, numcodecs.Zlib(1), numcodecs.Blosc("lz4"), numcodecs.Zstd(1), numcodecs.BZ2(1)):
            path = self.array(noise(4, 5, 6), codec=codec)
            chunk = path / "0.0.0"
            data = chunk.read_bytes()
            for broken in (b"", data[:3], data[:len(data) // 2], data[:-1], data + data, bytes(len(data))):
                if codec is not None and broken == data + data and codec.codec_id in ("zstd", "bz2", "zlib"):
                    continue  # what follows the last sample is passed over, as in all formats
                chunk.write_bytes(broken)
                if codec is None and broken == bytes(len(data)):
                    continue  # zeros are samples
                done = subprocess.run([COMMAND, "warp", path, "-o", "null:"], capture_output=True, env=self.env)
                self.assertEqual((done.returncode, str(path) in done.stderr.decode()), (4, True), (codec, len(broken), len(data), done.stderr))
        path = self.array(noise(4, 5, 6))
        good = json.loads((path / ".zarray").read_text())
        for field, value in (("shape", [4, 5]), ("shape", "x"), ("shape", [0, 5, 6]), ("shape", [-4, 5, 6]), ("shape", [1] * 6), ("chunks", [0, 5, 6]),
                             ("chunks", [1 << 40, 1 << 40, 1]), ("dtype", "<c16"), ("dtype", 7), ("dtype", [["a", "<u2"]]), ("order", "Q"),
                             ("filters", [{"id": "vlen-utf8"}]), ("compressor", {"id": "zfpy"}), ("compressor", 3), ("fill_value", "x"), ("fill_value", 1e9),
                             ("zarr_format", 1), ("dimension_separator", "../")):
            (path / ".zarray").write_text(json.dumps({**good, field: value}))
            self.refused(path)
        for text in ("", "[", "[]", "null", "{}", "\xff"):
            (path / ".zarray").write_text(text)
            self.refused(path)
        # A small file that says it is huge, and a chunk that does.
        (path / ".zarray").write_text(json.dumps({**good, "shape": [100000, 100000, 100000]}))
        self.run_it("warp", path, "-o", "null:", code=3)
        (path / ".zarray").write_text(json.dumps({**good, "chunks": [1000, 1000, 1000], "compressor": {"id": "zlib"}}))
        (path / "0.0.0").write_bytes(zlib.compress(b"1234"))
        self.run_it("warp", path, "-o", "null:", code=4)

    def test_paths_stay_inside(self):
        path = self.image([noise(3, 4, 5)], self.SPACE, [[1, 1, 1]])
        attributes = json.loads((path / ".zattrs").read_text())
        for name in ("../i.zarr/0", "/etc", "", "missing", 7):
            attributes["multiscales"][0]["datasets"][0]["path"] = name
            (path / ".zattrs").write_text(json.dumps(attributes))
            self.refused(path)
        for field, value in (("axes", [{"name": "q"}] * 3), ("axes", [{"name": "x"}] * 3), ("datasets", []), ("datasets", 5), ("axes", 5)):
            attributes = json.loads((path / ".zattrs").read_text())
            attributes["multiscales"][0]["datasets"][0]["path"] = "0"
            attributes["multiscales"][0][field] = value
            (path / ".zattrs").write_text(json.dumps(attributes))
            self.refused(path)
            attributes["multiscales"][0].update({"axes": self.SPACE, "datasets": [{"path": "0"}]})
            (path / ".zattrs").write_text(json.dumps(attributes))
        self.info(path)
        for transforms in ([{"type": "scale", "scale": [1, 1]}], [{"type": "scale", "scale": [0, 1, 1]}], [{"type": "affine"}], [{"type": "scale", "scale": "x"}]):
            attributes["multiscales"][0]["datasets"] = [{"path": "0", "coordinateTransformations": transforms}]
            (path / ".zattrs").write_text(json.dumps(attributes))
            self.refused(path)


if __name__ == "__main__":
    unittest.main()
