"""Runs the command as a user does, for the tests of this folder whose runs share a folder. Needs EDGEWISE and EDGEWISE_DATA."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
DATA = pathlib.Path(os.environ.get("EDGEWISE_DATA", "data"))


class Running(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        # A home of its own: a profile of whoever runs the tests must not change their plans.
        cls.env = {**os.environ, "XDG_CONFIG_HOME": str(cls.folder / "config"), "XDG_CACHE_HOME": str(cls.folder / "cache")}

    def run_it(self, *words, code=0, env=None):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=200, env=env or self.env)
        self.assertEqual(done.returncode, code, f"{words}: {done.stderr.decode(errors='replace')}")
        return done


HEADLIGHT = ("--light", "head", "--material", "0.1,0.7,0.2,10")  # as VTK has it


def native(words):
    """A pixel for each smallest spacing of the volume, where the words do not say how many there are."""
    return words if {"--size", "--spacing"} & set(words) else (*words, "--size", "native")


def png(data):
    """The samples of a grey PNG of 8 bits."""
    import struct
    import zlib

    import numpy as np

    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, idat = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            assert (bits, colour) == (8, 0)
        if kind == b"IDAT":
            idat += body
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(idat), "u1").reshape(height, width + 1).astype(int)
    picture = np.zeros((height, width), int)
    for y, (filtered, row) in enumerate(zip(rows[:, 0], rows[:, 1:])):
        up = picture[y - 1] if y else np.zeros(width, int)
        for x in range(width):
            left, above, corner = (picture[y, x - 1] if x else 0), up[x], (up[x - 1] if x else 0)
            guess = left + above - corner
            paeth = min((abs(guess - left), 0, left), (abs(guess - above), 1, above), (abs(guess - corner), 2, corner))[2]
            picture[y, x] = (row[x] + [0, left, above, (left + above) // 2, paeth][filtered]) % 256
    return picture


def corner_of_mr_head(folder, at=(90, 20, 90), extent=(61, 67, 53)):
    """A file with a corner of the MR head, x first, at its own values and spacing: a 27th of its samples, of which 41 % are air, as 42 % of
    the whole head are. For tests of errors and bytes, to which it matters what a head looks like and that its voxels are no cubes."""
    import gzip
    import struct

    import files
    import numpy as np

    data = gzip.decompress((DATA / "mr_brain/MR.nii.gz").read_bytes())
    n, spacing = struct.unpack_from("<8h", data, 40)[1:4], struct.unpack_from("<8f", data, 76)[1:4]
    offset, slope, inter = struct.unpack_from("<3f", data, 108)
    head = np.frombuffer(data, "u1", int(np.prod(n)), int(offset)).reshape(n[::-1])
    path = folder / "mr_corner.nii"
    files.write_nifti(path, head[tuple(slice(a, a + e) for a, e in zip(at[::-1], extent[::-1]))], slope=slope, inter=inter, spacing=spacing)
    return path
