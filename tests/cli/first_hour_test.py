"""docs/first_hour.md: what it shows is what happens, and its pictures are those of its commands. Needs EDGEWISE; numpy."""
import ast
import json
import math
import pathlib
import re
import struct
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import files  # noqa: E402
import first_hour_page as page  # noqa: E402
from running import COMMAND, Running  # noqa: E402


class FirstHour(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.text = page.PAGE.read_text(encoding="utf8")
        cls.ran, cls.place = page.run(cls.folder / "clone", COMMAND)

    def read(self, path):
        """(rows, columns, channels)"""
        out = self.folder / "read.nrrd"
        self.run_it("warp", path, "-o", out)
        return files.read_nrrd(out.read_bytes())[0].astype(int)

    def test_rule_for_what_varies(self):
        self.assertTrue(page.fits("a …, c\n", "a 12.5 ms, c\n"))
        self.assertTrue(page.fits("a\n…\nb\n", "a\nx\ny\nb\n"))
        self.assertTrue(page.fits("a\n…\nb\n", "a\nb\n"))
        self.assertTrue(page.fits("a\n", "edgewise: planning ...\na\n"))
        self.assertFalse(page.fits("a …, c\n", "a 12.5 ms, d\n"))
        self.assertFalse(page.fits("a …\n", "a b\nc\n"))
        self.assertFalse(page.fits("a\n", "edgewise: warning: more\na\n"))

    def test_each_command_says_what_the_page_says(self):
        self.assertGreaterEqual(len(self.ran), 22)
        for commands, expected, said, _ in self.ran:
            with self.subTest(commands):
                self.assertTrue(page.fits(expected, said), f"\n{commands}said:\n{said}expected:\n{expected}")

    def test_each_command_of_the_page_is_run(self):
        # Whoever adds a block of commands without what it prints would have it untested.
        self.assertEqual(len(re.findall(r"^```sh$", self.text, re.M)), len(self.ran))
        for commands, _, _, code in self.ran:
            wrong = "shadded" in commands or "cells.png" in commands
            self.assertEqual(code != 0, wrong, commands)

    def test_pictures_show_something(self):
        names = [name for commands, *_ in self.ran for name in re.findall(r"-o (\S+\.(?:png|jpg))", commands)]
        self.assertGreaterEqual(len(names), 12)
        for name in dict.fromkeys(names):
            if name in ("cells.png", "turn.png"):  # of commands that fail
                self.assertFalse((self.place / name).exists(), name)
                continue
            with self.subTest(name):
                picture = self.read(self.place / name)
                self.assertGreaterEqual(max(picture.shape[:2]), 380)
                grey = picture.mean(axis=2)
                self.assertGreater(np.quantile(grey, 0.98), 60)  # not black
                self.assertLess(np.quantile(grey, 0.02), 200)  # not white
                self.assertGreater(grey.std(), 12)
                self.assertGreater(len(np.unique(grey)), 40)
                said = re.search(rf"^edgewise: {re.escape(name)}, (\d+)x(\d+), (?!.*\d of)", "".join(said for _, _, said, _ in self.ran), re.M)
                if said and name not in ("depth.jpg", "sheet.png"):  # a legend makes it wider; a montage
                    self.assertEqual(picture.shape[1::-1], tuple(map(int, said.groups())))

    def test_pictures_for_print_are_white_around(self):
        for name in ("white.png", "print.png"):
            picture = self.read(self.place / name)[..., :3]
            for corner in (picture[0, 0], picture[0, -1], picture[-1, -1]):
                self.assertEqual(corner.tolist(), [255, 255, 255], name)
        self.assertEqual(self.read(self.place / "print.png").shape[1], 1181)

    def test_the_head_is_upright(self):
        # The cranium is wider than the chin, and the neck leaves the scan below.
        lit = self.read(self.place / "skull.png").max(axis=2) > 40
        rows = lit.sum(axis=1)
        self.assertGreater(rows[:40].mean(), 1.2 * rows[-90:-60].mean())
        # The light comes from the viewer's left.
        bright = self.read(self.place / "skin.png").mean(axis=2)
        self.assertGreater(bright[:, 128:256].mean(), bright[:, 256:384].mean())

    def test_films_have_their_pictures(self):
        for name, frames in (("turn.gif", 36), ("cells.gif", 36)):
            data = (self.place / name).read_bytes()
            self.assertEqual(data[:6], b"GIF89a")
            self.assertEqual(data.count(b"\x21\xf9\x04"), frames, name)  # one graphic control block each

    def test_meshes_are_closed(self):
        for name in ("skull.stl", "nuclei.stl"):
            data = (self.place / name).read_bytes()
            count = struct.unpack_from("<I", data, 80)[0]
            at = np.frombuffer(data, [("n", "<f4", 3), ("at", "<f4", (3, 3)), ("", "<u2")], offset=84)["at"].reshape(-1, 3)
            index = np.unique(at, axis=0, return_inverse=True)[1].reshape(-1, 3)
            self.assertEqual(len(index), count)
            sides = np.concatenate([index[:, [0, 1]], index[:, [1, 2]], index[:, [2, 0]]])
            key = lambda pairs: np.sort(pairs[:, 0].astype("i8") * (index.max() + 1) + pairs[:, 1])
            np.testing.assert_array_equal(key(sides), key(sides[:, ::-1]), name)  # each side is passed both ways
        report = json.loads((self.place / "nuclei.json").read_text())
        self.assertTrue(report["closed"])
        # Ellipsoids of script/first_hour_data. Their brightness falls by an eighth of the half axes, from 1600 over 160; texture has mean 1.
        axes = re.search(r"^NUCLEI = (.*\n.*)\]$", (page.ROOT / "script/first_hour_data").read_text(), re.M)[1] + "]"
        cubic = sum(4 / 3 * math.pi * a * b * c for _, (a, b, c) in ast.literal_eval(axes))
        self.assertAlmostEqual(report["volume"] * 1e9 / (cubic * (1 - (600 - 160) / 1600 / 8) ** 3), 1, delta=0.06)

    def test_pictures_of_the_page_are_those_of_its_commands(self):
        names = page.pictures(self.text)
        self.assertGreaterEqual(len(names), 5)
        self.assertEqual(sorted(names), sorted(path.name for path in page.PICTURES.iterdir()))
        for name in names:
            kept, made = self.read(page.PICTURES / name), self.read(self.place / name)
            self.assertLess((page.PICTURES / name).stat().st_size, 200_000, name)
            self.assertEqual(kept.shape, made.shape, name)
            # Not bit for bit: compilers round light in other ways. Another view or window differs by tens of levels.
            self.assertLess(np.abs(kept - made).mean(), 4, f"{name}: script/first_hour_pictures makes it again")


if __name__ == "__main__":
    unittest.main()
