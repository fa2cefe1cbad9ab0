"""CT presets of scans that are a tenth, a hundredth or a thousandth as large as a patient's: the same picture. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running


def write_metaimage(path, a, spacing):
    """[z, y, x] of i16; f64 spacing, in mm."""
    head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = {' '.join(map(repr, spacing))}\n"
            f"DimSize = {' '.join(map(str, a.shape[::-1]))}\nElementType = MET_SHORT\nAnatomicalOrientation = RAI\nElementDataFile = LOCAL\n")
    path.write_bytes(head.encode() + a.astype("<i2").tobytes())


def bone():
    """Air, a ball of soft tissue, a hollow shell of bone with struts, in Hounsfield units."""
    z, y, x = np.mgrid[-1:1:28j, -1:1:36j, -1:1:40j]
    r = np.sqrt(x * x + y * y + z * z)
    a = np.where(r < .9, 40.0, -1000.0)
    shell = (r > .5) & (r < .65) | (r <= .5) & (np.abs(np.sin(9 * x) * np.sin(9 * y)) > .8)
    a[shell] = 900
    return np.round(a)


class PresetSize(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = bone()

    def picture(self, spacing, *more, preset="ct-bone", size="64x64", volume=None):
        path = self.folder / "ct.mha"
        write_metaimage(path, self.volume if volume is None else volume, spacing)
        out = self.folder / "out.png"
        done = self.run_it("render", path, "-o", out, "--mode", "composite", "--preset", preset, "--rotate", "15,25,5", "--size", size, "--window",
                           "0,1", *more, "--json", "-")
        return files.read(out)[0].astype(int), json.loads(done.stdout), done.stderr.decode()

    def test_a_hundredth_of_all_lengths_is_the_same_picture(self):
        for preset in ("ct-bone", "ct-skin", "ct-lung", "ct-soft", "ct-vessels"):
            for light in ((), ("--shade", "phong")):
                for spacing in ((1.0, 1.0, 1.0), (0.9, 0.9, 1.5)):
                    with self.subTest(preset=preset, light=light, spacing=spacing):
                        patient, report, said = self.picture(spacing, *light, preset=preset)
                        self.assertNotIn("opacities are for", said)
                        self.assertGreater(patient.max(), 40)
                        for part in (10, 100, 1000):
                            small, _, said = self.picture([s / part for s in spacing], *light, preset=preset)
                            # Lengths in f32 along rays: values differ by their rounding, a level at most.
                            self.assertLessEqual(np.abs(small - patient).max(), 1, part)
                            self.assertIn("opacities are for", said)

    def test_a_micro_ct_is_opaque(self):
        # 10 um: bone was 1 % opaque per sample's hundredth of a millimetre before.
        picture, _, said = self.picture((.01, .01, .01))
        self.assertGreater(picture[32, 32].max(), 120)
        self.assertIn("0.01 mm", said)

    def test_scans_of_patients_are_as_they_were(self):
        # The same preset as a file, whose unit is 1 mm whatever the size.
        listed = json.loads(self.run_it("list", "presets", "--json", "-").stdout)["presets"]
        bone_preset = next(p for p in listed if p["name"] == "ct-bone")
        own = self.folder / "own.json"
        own.write_text(json.dumps({"points": bone_preset["points"], "values": "hounsfield", "unit": 1.0}))
        for spacing in ((.5, .5, 2.0), (.35, .35, .35), (.98, .98, 5.0)):
            np.testing.assert_array_equal(self.picture(spacing)[0], self.picture(spacing, preset=own)[0])
        # A file's own unit means what it says.
        faint = self.picture((.01, .01, .01), preset=own)[0]
        self.assertLess(faint.max(), 60)

    def test_a_file_may_ask_for_it(self):
        listed = json.loads(self.run_it("list", "presets", "--json", "-").stdout)["presets"]
        points = next(p for p in listed if p["name"] == "ct-bone")["points"]
        own = self.folder / "sized.json"
        own.write_text(json.dumps({"points": points, "values": "hounsfield", "unit": 1.0, "by_size": True}))
        np.testing.assert_array_equal(self.picture((.01, .01, .01), preset=own)[0], self.picture((.01, .01, .01))[0])
        for bad in ({"by_size": 1, "unit": 1.0}, {"by_size": True}):
            own.write_text(json.dumps({"points": points, **bad}))
            self.assertIn("by_size", self.run_it("render", self.folder / "ct.mha", "-o", "null:", "--mode", "composite", "--preset", own,
                                                 code=2).stderr.decode())


if __name__ == "__main__":
    unittest.main()
