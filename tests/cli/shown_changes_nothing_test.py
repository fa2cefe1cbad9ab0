"""What is shown changes no byte of a result: --json, plan, --explain, an empty or a full cache, any number of threads."""
import pathlib
import shutil
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
from running import Running  # noqa: E402

REQUESTS = [
    ("--mode", "mip", "--rotate", "20,30,10", "--turntable", "24"),
    ("--mode", "xray", "--rotate", "20,30,10", "--turntable", "40"),
    ("--mode", "mip", "--rotate", "5,0,0", "--max-error", "0.02"),
    ("--mode", "mip", "--rotate", "5,0,0", "--turntable", "12", "--max-error", "0.05"),
    ("--mode", "mean", "--rotate", "40,20,0", "--turntable", "30", "--max-error", "0.004"),
    ("--mode", "composite", "--rotate", "10,20,0", "--turntable", "8"),
]


class ShownChangesNothing(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        random = np.random.default_rng(2)
        z, y, x = np.mgrid[0:56, 0:60, 0:64]
        blobs = sum(200 * np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / 40) for a, b, c in random.uniform(12, 48, (20, 3)))
        cls.volume = cls.folder / "blobs.nii"
        files.write_nifti(cls.volume, (blobs + random.normal(size=blobs.shape)).clip(0, 255).astype("u1"))

    def result(self, words, *more, cached=False):
        if not cached:
            shutil.rmtree(self.folder / "cache", ignore_errors=True)
        out = self.folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        self.run_it("render", self.volume, *words, "--size", "96x80", "-o", out / "f_%d.tif" if "--turntable" in words else out / "f.tif",
                    "--quiet", *more)
        return {file.name: file.read_bytes() for file in out.iterdir()}

    def test_results_are_the_same(self):
        for words in REQUESTS:
            with self.subTest(words=words):
                first = self.result(words)
                self.assertTrue(first)
                self.assertEqual(self.result(words, cached=True), first)
                self.run_it("plan", "render", self.volume, *words, "--size", "96x80", "--quiet")
                self.assertEqual(self.result(words, cached=True), first)
                for more in (("--json", self.folder / "report.json"), ("--explain",), ("--threads", "1"), ("--threads", "7")):
                    self.assertEqual(self.result(words, *more), first, more)


if __name__ == "__main__":
    unittest.main()
