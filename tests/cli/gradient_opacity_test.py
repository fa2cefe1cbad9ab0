"""Opacities by the length of the gradient, and colours of labels, against closed forms. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from levels_test import premultiplied
from running import Running, native

CAST = ("--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9", "--background", "none", "--mode", "composite")


class Opacities(Running):
    def transfer(self, **keys):
        file = self.folder / "t.json"
        file.write_text(json.dumps(keys))
        return file

    def render(self, source, *words):
        self.run_it("render", source, "-o", self.folder / "p.nrrd", "--quiet", *native(words))
        return premultiplied(files.read(self.folder / "p.nrrd")[0].astype(float))

    def test_a_ramp_has_the_opacity_of_its_slope(self):
        slope, n = 6.0, 14
        x = np.broadcast_to(slope * np.arange(20, dtype="<f4"), (n, 8, 20)).copy()
        files.write_nrrd(self.folder / "v.nrrd", x)
        table = [{"magnitude": 2, "opacity": 0.1}, {"magnitude": 10, "opacity": 0.9}]
        transfer = self.transfer(points=[{"value": 0, "opacity": 0.2, "color": [0.5, 1, 0.25]}], unit=1, gradient=table)
        for words, magnitude, length in (((), slope, n), (("--input-spacing", "3,1,1"), slope / 3, n), (("--rotate", "0,0,30"), slope, n),
                                         (("--input-spacing", "1,1,2"), slope, 2 * n), (("--scale", "2"), slope, 2 * n)):
            factor = np.interp(magnitude, [2, 10], [0.1, 0.9])
            picture = self.render(self.folder / "v.nrrd", *words, "--transfer", transfer, *CAST)
            middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
            opacity = 1 - (1 - 0.2 * factor) ** length
            np.testing.assert_allclose(middle, [0.5 * opacity, opacity, 0.25 * opacity, opacity], rtol=2e-3, err_msg=str(words))
        lit = self.render(self.folder / "v.nrrd", "--transfer", transfer, "--shade", "phong", "--light", "-1,0,0", *CAST)
        self.assertAlmostEqual(lit[4, 10, 3], 1 - (1 - 0.2 * 0.5) ** n, 4)

    def test_predicted_errors_hold(self):
        z, y, x = np.meshgrid(*[np.linspace(-1, 1, 30)] * 3, indexing="ij")
        files.write_nrrd(self.folder / "v.nrrd", (100 / (1 + np.exp(12 * (np.sqrt(x * x + y * y + z * z) - 0.6)))).astype("<f4"))
        transfer = self.transfer(points=[{"value": 0, "opacity": 0, "color": [1, 1, 1]}, {"value": 80, "opacity": 0.4, "color": [1, 0.5, 0.2]}],
                                 gradient=[{"magnitude": 3, "opacity": 0}, {"magnitude": 12, "opacity": 1}])
        for words in ((), ("--shade", "phong"), ("--perspective", "40")):
            done = self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--transfer", transfer,
                               "--rotate", "20,30,0", *words, "--size", "160x140", "--max-error", "0.03", "--verify=all", "--json", "-")
            report = json.loads(done.stdout)
            self.assertLessEqual(report["measured"]["error"]["nrmse"], 1.1 * report["plan"]["predicted"]["error"], words)

    def test_labels_have_colours(self):
        labels = np.zeros((4, 6, 9), "u1")
        labels[1:3, 1:3, 1:4], labels[:, 4, 5:8] = 3, 200
        files.write_nrrd(self.folder / "l.nrrd", labels)
        picture = self.render(self.folder / "l.nrrd", "--mode", "composite", "--preset", "labels", "--labels", "--background", "none")
        seen = labels.max(0)
        np.testing.assert_allclose(picture[seen == 0], 0)
        first, second = picture[1, 1], picture[4, 6]
        np.testing.assert_allclose(picture[seen == 3], np.broadcast_to(first, (6, 4)), rtol=1e-5)
        np.testing.assert_allclose(picture[seen == 200], np.broadcast_to(second, (3, 4)), rtol=1e-5)
        self.assertAlmostEqual(first[3], 1 - 0.1 ** 2, 5)
        self.assertAlmostEqual(second[3], 1 - 0.1 ** 4, 3)
        self.assertGreater(np.abs(first[:3] / first[3] - second[:3] / second[3]).max(), 0.2)

    def test_light_and_opacity_are_warped_in_place_of_values(self):
        z, y, x = np.meshgrid(*[np.linspace(-1, 1, 28)] * 3, indexing="ij")
        files.write_nrrd(self.folder / "v.nrrd", (100 / (1 + np.exp(5 * (np.sqrt(x * x + y * y + z * z) - 0.6)))).astype("<f4"))
        gentle = [{"value": 0, "opacity": 0, "color": [0.2, 0.4, 1]}, {"value": 100, "opacity": 0.3, "color": [1, 0.6, 0.3]}]
        words = ("render", self.folder / "v.nrrd", "--mode", "composite", "--transfer", self.transfer(points=gentle, unit=1))
        for more in (("--rotate", "20,30,0"), ("--rotate", "20,30,0", "--shade", "phong"), ("--turntable", "3"), ()):
            paths = []
            for name, via in (("v", ("--via", "shade.classify")), ("w", ("--via", "project.ray_cast/filter=foh/step=1"))):
                done = self.run_it(*words, *more, *via, "--max-error", "9", "-o", self.folder / f"{name}_%d.nrrd", "--verify", "--json", "-")
                paths.append(json.loads(done.stdout))
            self.assertEqual([step["transition"] for step in paths[0]["plan"]["steps"]],
                             ["shade.classify", "warp.colored", "project.composite_colored"])
            # A gentle function of a smooth volume: both orders show nearly the same, and what they differ by is predicted.
            error = paths[0]["measured"]["error"]["nrmse"]
            self.assertLess(error, 0.03, more)
            self.assertLess(error, 2 * paths[0]["plan"]["predicted"]["error"] + 1e-3, more)
            first = [files.read(self.folder / f"{name}_0.nrrd")[0].astype(float) for name in "vw"]
            self.assertLess(np.abs(first[0] - first[1]).max(), 0.1, more)
        # Of a steep one they do not: the colour between two samples is that of neither.
        steep = [{"value": 49, "opacity": 0, "color": [1, 1, 1]}, {"value": 50, "opacity": 0.9, "color": [1, 1, 1]},
                 {"value": 51, "opacity": 0.9, "color": [1, 1, 1]}, {"value": 52, "opacity": 0, "color": [1, 1, 1]}]
        words = (*words[:4], "--transfer", self.transfer(points=steep, unit=1), "--rotate", "20,30,0", "--max-error", "9", "-o", "null:",
                 "--verify", "--json", "-")
        errors = [json.loads(self.run_it("render", self.folder / "v.nrrd", *words[2:], "--via", via).stdout)["measured"]["error"]["nrmse"]
                  for via in ("shade.classify", "project.preintegrated_cast/filter=foh/step=1")]
        self.assertGreater(errors[0], 2 * errors[1])
        for more in (("--perspective", "30"), ("--shade", "phong", "--turntable", "3"), ("--clip", "0,0,0,9,9,9")):
            self.run_it("render", self.folder / "v.nrrd", "--mode", "composite", *more, "--via", "shade.classify", "-o",
                        self.folder / "n_%d.png", code=3)

    def test_refusals(self):
        files.write_nrrd(self.folder / "v.nrrd", np.linspace(0, 1, 27).reshape(3, 3, 3).astype("<f4"))
        point = [{"value": 0, "opacity": 0.2, "color": [1, 1, 1]}]
        for gradient, part in (([], "gradient"), ([{"magnitude": 1}], "gradient[0]"), ([{"magnitude": -1, "opacity": 1}], "magnitude"),
                               ([{"magnitude": 2, "opacity": 1}, {"magnitude": 1, "opacity": 1}], "ascend")):
            transfer = self.transfer(points=point, gradient=gradient)
            error = self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--transfer", transfer, code=2)
            self.assertIn(part, error.stderr.decode())
        error = self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--preset", "labels", code=2)
        self.assertIn("no label", error.stderr.decode())


if __name__ == "__main__":
    unittest.main()
