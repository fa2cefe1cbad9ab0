"""Volume presets of vtk.js, cornerstone and OHIF, and files of several presets: FILE#NAME. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running

BONE = {"name": "CT-Bone-Like", "gradientOpacity": "4 0 1 255 1", "specularPower": "12", "scalarOpacity": "8 -3024 0 -16.5 0 641.4 0.72 3071 0.71",
        "specular": "0.25", "shade": "1", "ambient": "0.15",
        "colorTransfer": "16 -3024 0 0 0 -16.5 0.73 0.25 0.3 641.4 0.91 0.82 0.55 3071 1 1 1 ", "diffuse": "0.8", "interpolation": "1"}
LUNG = {**BONE, "name": "CT-Lung-Like", "scalarOpacity": "12 -1000 0 -600 0 -599 0.15 -400 0.15 -399 0 2952 0"}
EDGES = {**BONE, "name": "Edges", "gradientOpacity": "4 20 0 200 1"}


def as_vp(preset):
    """The same as Slicer's nine lines."""
    keys = ("interpolation", "shade", "diffuse", "ambient", "specular", "specularPower", "scalarOpacity", "gradientOpacity", "colorTransfer")
    return "".join(preset[key] + "\n" for key in keys)


class VtkJs(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        z, y, x = np.mgrid[-1:1:24j, -1:1:28j, -1:1:32j]
        r = np.sqrt(x * x + y * y + z * z)
        cls.source = cls.folder / "ct.nii"
        files.write_nifti(cls.source, np.where(r < .4, 1200, np.where(r < .8, -500, -1000)).astype("<i2"))

    def write(self, name, content):
        path = self.folder / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    def picture(self, preset, *more, option="--preset"):
        out = self.folder / "out.nrrd"
        self.run_it("render", self.source, "-o", out, "--mode", "composite", "--size", "48x48", "--rotate", "20,30,0", option, preset, *more)
        return files.read(out)[0]

    def refused(self, preset, option="--preset"):
        return self.run_it("plan", "render", self.source, "--mode", "composite", option, preset, code=2).stderr.decode()

    def test_one_shows_what_slicer_shows_of_the_same_numbers(self):
        for preset in (BONE, LUNG, EDGES):
            for light in ((), ("--shade", "phong")):
                with self.subTest(preset=preset["name"], light=light):
                    expected = self.picture(self.write("same.vp", as_vp(preset)), *light)
                    self.assertGreater(np.ptp(expected), .1)
                    one = self.write("one.json", preset)
                    for option in ("--preset", "--transfer"):
                        np.testing.assert_array_equal(self.picture(one, *light, option=option), expected)

    def test_one_of_several_is_named(self):
        right = {p["name"]: self.picture(self.write("one.json", p)) for p in (BONE, LUNG, EDGES)}
        self.assertFalse(np.array_equal(right["CT-Bone-Like"], right["CT-Lung-Like"]))
        shapes = {"list": [BONE, LUNG, EDGES], "under": {"volumeRenderingPresets": [BONE, LUNG, EDGES], "rendering": {"quality": 1}},
                  "keyed": {p["name"]: {k: v for k, v in p.items() if k != "name"} for p in (BONE, LUNG, EDGES)}}
        for shape, content in shapes.items():
            path = self.write(f"{shape}.json", content)
            for name, expected in right.items():
                with self.subTest(shape=shape, name=name):
                    np.testing.assert_array_equal(self.picture(f"{path}#{name}"), expected)
                    np.testing.assert_array_equal(self.picture(f"{path}#{name.upper()}", option="--transfer"), expected)
            message = self.refused(path)
            for word in ("3 presets", "#CT-Bone-Like", "CT-Bone-Like, CT-Lung-Like, Edges"):
                self.assertIn(word, message)
            self.assertIn("did you mean CT-Lung-Like?", self.refused(f"{path}#CT-Lung-Lik"))
            self.assertIn("it has CT-Bone-Like, CT-Lung-Like, Edges", self.refused(f"{path}#zzz"))
        np.testing.assert_array_equal(self.picture(self.write("alone.json", [LUNG])), right["CT-Lung-Like"])

    def test_colour_maps_of_vtkjs_and_paraview_are_named_too(self):
        maps = [{"Name": "Warm", "ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 1, 1, .5, 0]},
                {"Name": "Cold", "ColorSpace": "RGB", "NanColor": [1, 1, 0], "RGBPoints": [0, 0, 0, 0, 1, 0, .5, 1]}]
        path = self.write("maps.json", maps)
        for one in maps:
            np.testing.assert_array_equal(self.picture(f"{path}#{one['Name'].lower()}"), self.picture(self.write("map.json", one)))
        self.assertIn("Warm, Cold", self.refused(path))

    def test_a_file_whose_name_has_the_sign_is_taken_whole(self):
        path = self.write("a#b.json", BONE)
        np.testing.assert_array_equal(self.picture(path), self.picture(self.write("one.json", BONE)))
        both = self.write("c#d.json", [BONE, LUNG])
        np.testing.assert_array_equal(self.picture(f"{both}#CT-Bone-Like"), self.picture(path))

    def test_a_wrong_count_is_said(self):
        path = self.write("count.json", {**BONE, "scalarOpacity": "4 -3024 0 -16.5 0 641.4 0.72 3071 0.71"})
        done = self.run_it("render", self.source, "-o", "null:", "--mode", "composite", "--preset", path, "--json", "-")
        self.assertTrue(any("scalarOpacity says that 4 numbers follow, and 8 do" in w for w in json.loads(done.stdout)["warnings"]))
        np.testing.assert_array_equal(self.picture(path), self.picture(self.write("one.json", BONE)))

    def test_what_is_wrong_is_refused_by_its_name(self):
        for change, word in (({"scalarOpacity": "8 -3024 0 -16.5 0 641.4 0.72 3071"}, "scalarOpacity"), ({"colorTransfer": 7}, "colorTransfer"),
                             ({"colorTransfer": "8 0 0 0 0 1 2 0 0"}, "is not from 0 to 1"), ({"scalarOpacity": "4 5 0 1 1"}, "ascend"),
                             ({"scalarOpacity": "4 0 0 x 1"}, "'x' is no number"), ({"ambient": "2"}, "ambient"), ({"diffuse": "a"}, "'a' is no number"),
                             ({"scalarOpacity": None}, "scalarOpacity"), ({"gradientOpacity": "1 2"}, "gradientOpacity")):
            message = self.refused(self.write("bad.json", {**BONE, **change}))
            self.assertIn(word, message)
            self.assertIn("bad.json", message)
        without = {key: value for key, value in BONE.items() if key != "colorTransfer"}
        self.assertIn("colorTransfer", self.refused(self.write("bad.json", without)))


if __name__ == "__main__":
    unittest.main()
