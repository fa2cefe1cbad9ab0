"""Presets, transfer functions of ParaView and Slicer, --mode shaded and --background none, as a user asks for them. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import unittest

import files
import numpy as np
from running import DATA, Running

VP = "1\n1\n0.8\n0.15\n0.25\n12\n6 100 0 200 0.2 800 0.9\n4 0 1 255 1\n12 100 0.5 0.2 0.1 200 1 0.5 0.2 800 1 1 1\n"
HEAD = DATA / "ct_head" / "quarter.nhdr"
CHEST = DATA / "ct_chest" / "chest.nrrd"
BRAIN = DATA / "mr_brain" / "MR.nii.gz"
VOLUMES = {"ct-bone": HEAD, "ct-skin": HEAD, "ct-lung": CHEST, "ct-vessels": CHEST, "ct-soft": HEAD, "mr-head": BRAIN,
           "mr-angio": DATA / "carotid" / "carotid.vtk", "microscopy": DATA / "neuron" / "neuron.tif", "general": BRAIN,
           "micro-ct": DATA / "engine" / "engine.nii.gz"}


class Presets(Running):
    def render(self, source, out, *words, code=0):
        done = self.run_it("render", source, "-o", self.folder / out, "--size", "96", *words, code=code)
        return done if code else files.read(self.folder / out)[0].astype(float)

    def refused(self, *words, code=2):
        done = self.run_it("plan", "render", *words, code=code)
        return done.stderr.decode()

    def test_they_are_listed(self):
        listed = json.loads(self.run_it("list", "presets", "--json", "-").stdout)["presets"]
        self.assertLessEqual(set(VOLUMES), {entry["name"] for entry in listed})
        for entry in listed:
            self.assertTrue(entry["meaning"])
            self.assertEqual(entry["values"], "hounsfield" if entry["name"].startswith("ct-") else "labels" if entry["name"] == "labels" else "window")
        self.assertIn(b"ct-bone: CT", self.run_it("list", "presets").stdout)

    def test_each_makes_a_picture(self):
        listed = json.loads(self.run_it("list", "presets", "--json", "-").stdout)["presets"]
        for name in (entry["name"] for entry in listed if entry["name"] != "labels"):  # gradient_opacity_test.py has them
            picture = self.render(VOLUMES[name], f"{name}.png", "--mode", "shaded", "--preset", name)
            self.assertEqual(picture.shape[2], 3)
            bright = picture.max(axis=2)
            lit = np.mean(bright > 40)
            self.assertGreater(lit, 0.003 if name == "microscopy" else 0.05, name)
            self.assertLess(lit, 0.97, name)
            self.assertLess(np.mean(picture.min(axis=2) > 250), 0.01, f"{name}: white blobs")
            self.assertGreater(len(np.unique(bright)), 40, name)

    def test_a_head_without_hounsfield_units_is_recognised(self):
        done = self.run_it("render", HEAD, "-o", "null:", "--mode", "composite", "--preset", "ct-bone")
        self.assertIn(b"Hounsfield units plus 1024", done.stderr)
        done = self.run_it("render", BRAIN, "-o", "null:", "--mode", "composite", "--preset", "ct-bone")
        self.assertIn(b"do not look like", done.stderr)

    # --- --mode shaded

    def test_shaded_is_composite_with_light_and_a_preset(self):
        for source, name in ((CHEST, "ct-bone"), (BRAIN, "mr-head")):
            shaded = self.render(source, "shaded.nrrd", "--mode", "shaded")
            named = self.render(source, "named.nrrd", "--mode", "composite", "--shade", "phong", "--preset", name)
            self.assertTrue(np.array_equal(shaded, named), name)
            unlit = self.render(source, "unlit.nrrd", "--mode", "composite", "--preset", name)
            self.assertFalse(np.array_equal(shaded, unlit), name)

    def test_shaded_runs_over_the_window(self):
        narrow = self.render(BRAIN, "narrow.nrrd", "--mode", "shaded", "--window", "200,400")
        wide = self.render(BRAIN, "wide.nrrd", "--mode", "shaded", "--window", "50,400")
        self.assertLess(np.mean(narrow.max(axis=2) > 0.05), np.mean(wide.max(axis=2) > 0.05))

    def test_the_material_of_a_file_holds_where_none_is_given(self):
        (self.folder / "a.vp").write_text(VP)
        words = ("--mode", "composite", "--shade", "phong", "--preset", self.folder / "a.vp")
        of_file = self.render(HEAD, "file.nrrd", *words)
        self.assertTrue(np.array_equal(of_file, self.render(HEAD, "given.nrrd", *words, "--material", "0.15,0.8,0.25,12")))
        self.assertFalse(np.array_equal(of_file, self.render(HEAD, "other.nrrd", *words, "--material", "0.1,0.7,0.2,10")))

    # --- files

    def test_files_of_other_programs_mean_what_ours_mean(self):
        points = [(100, 0, (0.5, 0.2, 0.1)), (200, 0.2, (1, 0.5, 0.2)), (800, 0.9, (1, 1, 1))]
        own = {"unit": 1, "points": [{"value": v, "opacity": a, "color": c} for v, a, c in points]}
        curve = [{"x": v, "y": a, "midpoint": 0.5, "sharpness": 0} for v, a, _ in points]
        color = [{"x": v, "color": c, "midpoint": 0.5, "sharpness": 0} for v, _, c in points]
        slicer = {"volumeProperties": [{"components": [{"scalarOpacity": {"points": curve}, "rgbTransferFunction": {"points": color}}]}]}
        paraview = [{"ColorSpace": "RGB", "Name": "a", "RGBPoints": [n for v, _, c in points for n in (v, *c)],
                     "Points": [n for v, a, _ in points for n in (v, a, 0.5, 0)]}]
        pictures = []
        for name, text in (("own.json", json.dumps(own)), ("a.vp", VP), ("a.vp.json", json.dumps(slicer)), ("pv.json", json.dumps(paraview))):
            (self.folder / name).write_text(text)
            # ParaView's opacities are for each smallest spacing: 1 as well.
            pictures.append(self.render(HEAD, "out.nrrd", "--mode", "composite", "--transfer", self.folder / name, "--input-spacing", "1"))
        self.assertGreater(pictures[0].max(), 0.3)
        for picture in pictures[1:]:
            self.assertTrue(np.array_equal(pictures[0], picture))

    def test_what_makes_no_sense_is_refused(self):
        (self.folder / "bad.vp").write_text(VP.replace("0.15", "7"))
        (self.folder / "empty.json").write_text("[{}]")
        for words, said in ((("--mode", "composite", "--preset", "ct-bone", "--transfer", "x.json"), ["--preset", "--transfer"]),
                            (("--mode", "mip", "--preset", "ct-bone"), ["--preset", "composite"]),
                            (("--mode", "mip", "--transfer", "none.json"), ["--transfer", "composite"]),
                            (("--mode", "mip", "--background", "none"), ["--background", "composite"]),
                            (("--mode", "composite", "--background", "nothing"), ["--background", "none"]),
                            (("--mode", "composite", "--preset", "ct-bonee"), ["--preset", "ct-bone"]),
                            (("--mode", "shaded", "--preset", self.folder / "bad.vp"), ["bad.vp", "line 4 (ambient)", "0 to 1"]),
                            (("--mode", "shaded", "--transfer", self.folder / "empty.json"), ["empty.json", "RGBPoints"]),
                            (("--mode", "shaded", "--transfer", self.folder), ["cannot be read"])):
            text = self.refused(BRAIN, *words)
            for word in said:
                self.assertIn(word, text)

    # --- --background none

    def test_alpha_is_kept(self):
        words = ("--mode", "shaded", "--preset", "mr-head")
        black = self.render(BRAIN, "black.exr", *words)
        tiff = self.render(BRAIN, "none.tif", *words, "--background", "none")
        exr = self.render(BRAIN, "none.exr", *words, "--background", "none")
        png = self.render(BRAIN, "none.png", *words, "--background", "none", "--window", "0,1")
        for picture in (tiff, exr, png):
            self.assertEqual(picture.shape[2], 4)
        alpha = exr[..., 3]
        self.assertLess(alpha[0, 0], 1e-6)
        self.assertGreater(alpha.max(), 0.95)
        # EXR holds colour multiplied by alpha, which over black is the picture; TIFF and PNG hold it straight.
        np.testing.assert_allclose(exr[..., :3], black, atol=1e-6)
        np.testing.assert_allclose(tiff[..., 3], alpha, atol=1e-6)
        np.testing.assert_allclose(tiff[..., :3] * alpha[..., None], exr[..., :3], atol=1e-5)
        np.testing.assert_allclose(png[..., 3], np.rint(alpha * 255), atol=1)
        np.testing.assert_allclose(png[..., :3] / 255, np.where(alpha[..., None] > 0, np.clip(tiff[..., :3], 0, 1), 0), atol=1 / 255)
        self.assertIn(b"JPEG", self.render(BRAIN, "none.jpg", *words, "--background", "none", code=2).stderr)

    def test_the_error_counts_alpha(self):
        errors = {}
        for background in ("none", "0,0,0"):
            report = json.loads(self.run_it("render", BRAIN, "-o", "null:", "--size", "64", "--mode", "composite", "--preset", "mr-head",
                                            "--background", background, "--via", "ray_cast/filter=zoh/step=2", "--verify", "--range", "1",
                                            "--json", "-").stdout)
            errors[background] = report["measured"]["error"]
            self.assertEqual(report["request"]["mode"], "composite")
        self.assertNotEqual(errors["none"]["nrmse"], errors["0,0,0"]["nrmse"])
        self.assertGreater(errors["none"]["max"], 0)


if __name__ == "__main__":
    unittest.main()
