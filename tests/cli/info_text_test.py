"""`edgewise info` for people: units, modality and a histogram in a line; figures for engineers are in --json. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import re
import struct
import unittest

import numpy as np
from running import DATA, Running


def write_nifti(path, a, spacing):
    """[z, y, x] of i16, in millimetres."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *a.shape[::-1], 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 4, 16)
    struct.pack_into("<4f", head, 76, 1, *spacing)
    struct.pack_into("<3f", head, 108, 352, 1, 0)
    struct.pack_into("<b", head, 123, 2)
    head[344:348] = b"n+1\0"
    path.write_bytes(bytes(head) + a.astype("<i2").tobytes())


class Info(Running):
    def text(self, file):
        return self.run_it("info", file).stdout.decode()

    def test_small_spacings_are_in_micrometres(self):
        a = np.arange(60).reshape(3, 4, 5)
        for spacing, shown in (((0.0325, 0.0325, 0.05), "32.5 x 32.5 x 50 um"), ((0.000325, 0.000325, 0.002), "0.325 x 0.325 x 2 um"),
                               ((0.5, 0.5, 2), "0.5 x 0.5 x 2 mm"), ((0.09, 0.09, 0.2), "0.09 x 0.09 x 0.2 mm")):
            write_nifti(self.folder / "a.nii", a, spacing)
            self.assertIn(f"  spacing      {shown}\n", self.text(self.folder / "a.nii"))
            # The report stays in the file's unit.
            report = json.loads(self.run_it("info", self.folder / "a.nii", "--json", "-").stdout)
            np.testing.assert_allclose(report["spacing"], spacing, rtol=1e-6)

    def test_quantiles_are_those_of_the_samples(self):
        draw = np.random.default_rng(5)
        for a in (draw.integers(0, 200, (20, 30, 40)), draw.normal(0, 40, (16, 30, 50)).astype(int), np.full((9, 9, 9), 7) + (np.arange(729).reshape(9, 9, 9) > 700)):
            write_nifti(self.folder / "a.nii", a, (1, 1, 1))
            found = re.search(r"1 % below (\S+), half below (\S+), 99 % below (\S+)\)", self.text(self.folder / "a.nii"))
            step = max(1, (a.max() - a.min()) / 256)
            for number, share in zip(found.groups(), (0.01, 0.5, 0.99)):
                self.assertAlmostEqual(float(number), np.quantile(a, share), delta=step)

    def test_bars_show_where_values_are(self):
        a = np.zeros((10, 10, 10), int)
        a[:5] = 255
        write_nifti(self.folder / "a.nii", a, (1, 1, 1))
        bars = re.search(r"histogram    (.*?) \(log", self.text(self.folder / "a.nii"))[1]
        self.assertEqual((bars[0], bars[-1]), ("█", "█"))
        self.assertEqual(set(bars[1:-1]), {" "})

    def test_figures_of_engineers_are_in_the_report_alone(self):
        text = self.text(DATA / "ct_chest/chest.nrrd")
        self.assertNotIn("cycles", text)
        report = json.loads(self.run_it("info", DATA / "ct_chest/chest.nrrd", "--json", "-").stdout)
        self.assertTrue(report["spectrum"]["power"])


if __name__ == "__main__":
    unittest.main()
