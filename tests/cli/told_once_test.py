"""What is wrong with a file is told once; `info`, JSON and programs that ask for all get it always. Needs EDGEWISE."""
import json
import pathlib
import sys
import time
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
from running import Running  # noqa: E402

SETTLED = 3.1  # s after which facts of a file are kept: times of file systems are coarse


def warned(done):
    return [line for line in done.stderr.decode().splitlines() if line.startswith("edgewise: warning: ")]


class ToldOnce(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        random = np.random.default_rng(5)
        holed = random.normal(size=(9, 12, 15)).astype("<f4")
        holed[2, 3, 4] = np.nan
        cls.holed = cls.folder / "holed.nrrd"
        files.write_nrrd(cls.holed, holed)
        cls.changing = cls.folder / "changing.nrrd"
        files.write_nrrd(cls.changing, holed)
        # Integers that f32 cannot hold, and a spacing that is none.
        cls.wide = cls.folder / "wide.nrrd"
        files.write_nrrd(cls.wide, (random.integers(0, 2, (7, 9, 11)) + (1 << 25) + 1).astype("<i4"))
        cls.turned = cls.folder / "turned.nii"
        files.write_nifti(cls.turned, random.integers(0, 99, (8, 9, 10)).astype("<i2"), spacing=(1, -1, 2))
        cls.whole = cls.folder / "whole.nrrd"
        files.write_nrrd(cls.whole, random.normal(size=(6, 7, 8)).astype("<f4"))
        cls.files = [cls.holed, cls.wide, cls.turned]
        time.sleep(SETTLED)

    def setUp(self):
        # Nothing is known yet.
        self.env = {**self.env, "XDG_CACHE_HOME": str(self.folder / self.id())}

    def render(self, file, *words, **how):
        return self.run_it("render", file, "--mode", "mean", "-o", self.folder / "out.png", *words, **how)

    def test_a_second_command_does_not_tell_it(self):
        for file in self.files:
            first = self.render(file)
            self.assertEqual(len(warned(first)), 1, file)
            self.assertIn(file.name, warned(first)[0])
            self.assertIn("`edgewise info` lists it", first.stderr.decode())
            for verb in (("render", file, "--mode", "xray"), ("warp", file, "--rotate", "0,0,90", "--size", "fit")):
                later = self.run_it(*verb, "-o", self.folder / "out.nrrd")
                self.assertEqual(warned(later), [], verb)
                self.assertNotIn("`edgewise info`", later.stderr.decode())

    def test_info_and_json_always_tell_it(self):
        for file in self.files:
            said = []
            for _ in range(3):
                done = self.render(file, "--json", "-")
                said.append(json.loads(done.stdout)["warnings"])
            self.assertEqual(len(said[0]), 1)
            self.assertEqual(said, [said[0]] * 3)
            for _ in range(2):
                listed = json.loads(self.run_it("info", file, "--json", "-").stdout)
                self.assertTrue(listed["warnings"] == said[0] or listed["non_finite"] == 1, listed["warnings"])
                text = self.run_it("info", file).stdout.decode()
                self.assertTrue("warning" in text or "not finite   1 values" in text, text)

    def test_a_file_that_has_changed_tells_it_again(self):
        self.render(self.changing)
        self.assertEqual(warned(self.render(self.changing)), [])
        samples = np.random.default_rng(6).normal(size=(9, 12, 15)).astype("<f4")
        samples[5, 5, 5] = samples[6, 6, 6] = np.inf
        files.write_nrrd(self.changing, samples)
        # So new that nothing is kept of it: told each time.
        for _ in range(2):
            self.assertIn("2 values are not finite", warned(self.render(self.changing))[0])
        time.sleep(SETTLED)
        self.assertIn("2 values are not finite", warned(self.render(self.changing))[0])
        self.assertEqual(warned(self.render(self.changing)), [])

    def test_where_nothing_is_kept_it_is_told_each_time(self):
        off = {**self.env, "XDG_CACHE_HOME": "/proc/none"}  # no folder can be made there
        for file in self.files:
            for _ in range(2):
                done = self.render(file, env=off)
                self.assertEqual(len(warned(done)), 1)
                self.assertNotIn("`edgewise info`", done.stderr.decode())

    def test_who_was_told_nothing_is_told_later(self):
        self.assertEqual(self.render(self.wide, "--quiet").stderr, b"")
        self.assertEqual(self.render(self.wide, "--log", "error").stderr, b"")
        self.assertEqual(len(warned(self.render(self.wide))), 1)
        self.assertEqual(len(warned(self.render(self.wide))), 0)
        self.assertEqual(len(warned(self.render(self.wide, "--log", "info"))), 1)

    def test_what_the_request_makes_of_a_file_is_told_each_time(self):
        for _ in range(2):
            warnings = warned(self.render(self.whole, "--view", "front"))
            self.assertEqual(len(warnings), 1)
            self.assertIn("does not say how it lies in the body", warnings[0])

    def test_errors_are_told_each_time(self):
        cut = self.folder / "cut.nrrd"
        cut.write_bytes(self.holed.read_bytes()[:-10])
        for _ in range(2):
            self.assertIn("cut.nrrd", self.render(cut, code=4).stderr.decode())


if __name__ == "__main__":
    unittest.main()
