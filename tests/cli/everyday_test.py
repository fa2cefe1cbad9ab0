"""Runs docs/everyday.md and compares what the command says with the page. Needs EDGEWISE and EDGEWISE_DATA; numpy."""

import gzip
import os
import pathlib
import re
import shlex
import shutil
import struct
import subprocess
import tempfile
import unittest

import numpy as np

import everyday_inputs

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("EDGEWISE_DATA", ROOT / "data"))
PAGE = ROOT / "docs" / "everyday.md"


def commands():
    """(command, expected output) of the page, in order."""
    for block in re.findall(r"```console\n(.*?)```", PAGE.read_text(), re.S):
        for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
            line, _, expected = part.partition("\n")
            yield line, expected


def fits(expected, said):
    """Whether a text is the expected one, where "..." stands for anything."""
    pattern = "".join(".*" if part == "..." else re.escape(part)
                      for part in re.split(r"(\.\.\.)", expected.strip()))
    return re.fullmatch(pattern, said.strip(), re.S) is not None


def png_size(path):
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n", path
    return struct.unpack(">II", head[16:24])


def nifti(path):
    raw = path.read_bytes()
    raw = gzip.decompress(raw) if path.suffix == ".gz" else raw
    extent = struct.unpack_from("<8h", raw, 40)[1:4]
    kind = {2: "u1", 4: "<i2", 8: "<i4", 16: "<f4", 512: "<u2", 768: "<u4"}
    datatype = kind[struct.unpack_from("<h", raw, 70)[0]]
    begin = int(struct.unpack_from("<f", raw, 108)[0])
    count = int(np.prod(extent))
    return np.frombuffer(raw, datatype, count, begin).reshape(extent[::-1])


class Everyday(unittest.TestCase):
    def test_the_page(self):
        folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, folder)
        shutil.copy(DATA / "ct_chest" / "chest.nrrd", folder)
        shutil.copy(DATA / "mr_brain" / "MR.nii.gz", folder / "brain.nii.gz")
        shutil.copy(DATA / "coffee" / "coffee.png", folder)
        everyday_inputs.hyperstack(folder / "cells.tif")
        everyday_inputs.atlas(folder / "atlas.nii")
        environment = {**os.environ, "XDG_CONFIG_HOME": str(folder / "config"),
                       "XDG_CACHE_HOME": str(folder / "cache")}
        ran = 0
        for line, expected in commands():
            exit_code = re.search(r"# exit (\d+)$", line)
            words = shlex.split(line, comments=True)
            self.assertEqual(words[0], "edgewise")
            done = subprocess.run([COMMAND, *words[1:]], cwd=folder, env=environment, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300,
                                  check=False)
            self.assertEqual(done.returncode, int(exit_code[1]) if exit_code else 0,
                             f"{line}\n{done.stdout}")
            self.assertTrue(fits(expected, done.stdout),
                            f"$ {line}\nsaid:\n{done.stdout}\nexpected:\n{expected}")
            for name, size in re.findall(r"^edgewise: (\S+\.png), (\d+x\d+)", done.stdout, re.M):
                self.assertEqual("%dx%d" % png_size(folder / name), size)
            ran += 1
        self.assertGreaterEqual(ran, 25)

        labels = nifti(folder / "atlas.nii")
        self.assertEqual(set(np.unique(nifti(folder / "turned.nii"))), set(np.unique(labels)))
        np.testing.assert_array_equal(nifti(folder / "half.nii"), labels[:, ::-1, ::-1])
        self.assertEqual(nifti(folder / "fine.nii.gz").shape, (48, 38, 43))


if __name__ == "__main__":
    unittest.main()
