"""The words of the command line: any case, short names, mistyped ones, and options in their places."""

import json
import unittest

import numpy as np

from running import Running, png


class Words(Running):
    def report(self, *words, code=0):
        return json.loads(self.run_it(*words, "--quiet", "--json", "-", code=code).stdout)

    def plan(self, *words):
        return self.report("plan", "render", "phantom:gaussians:24", "--rotate", "10,20,30", *words)

    def test_any_case_will_do(self):
        shouted = self.plan("--mode", "XRAY", "--view", "X", "--minimize", "Error", "--reference", "LINEAR", "--planner", "Estimate",
                            "--max-time", "5S", "--max-memory", "900mib", "--via", "Project.Ray_Cast/Filter=FOH/Step=1")
        said = self.plan("--mode", "xray", "--view", "x", "--minimize", "error", "--reference", "linear", "--max-time", "5s",
                         "--max-memory", "900MiB", "--via", "project.ray_cast/filter=foh/step=1")
        for report in (shouted, said):
            self.assertEqual(report["plan"]["steps"][-1]["transition"], "project.ray_cast")
        self.assertEqual(shouted["request"], said["request"])
        self.assertEqual(self.run_it("LIST", "Modes").stdout, self.run_it("list", "modes").stdout)
        self.assertEqual(self.plan("--max-error", "40DB")["request"], self.plan("--max-error", "1%")["request"])
        self.run_it("warp", "Phantom:Sphere:16".replace("Phantom", "phantom"), "-o", "NULL:", "--size", "FIT", "--shear", "XY=0.1")
        self.run_it("warp", "phantom:sphere:16", "-o", "null:", "--size", "12X12X12")

    def test_planes_have_their_names(self):
        volume = self.folder / "v.nrrd"
        self.run_it("warp", "phantom:noise:20", "-o", volume, "--scale", "1,0.8,0.6")
        picture = lambda view: self.run_it("render", volume, "--orient", "RAS", "--view", view, "-o", "-").stdout
        for plane, side in (("coronal", "front"), ("Sagittal", "left"), ("axial", "bottom")):
            self.assertEqual(picture(plane), picture(side), plane)

    def test_the_end_of_an_edges_name_is_enough_where_it_is_one(self):
        for word, whole in (("ray_cast", "project.ray_cast"), ("shear_warp", "project.shear_warp"), ("SLICE", "spectrum.slice")):
            report = self.plan("--via", word, "--mode", "xray", "--max-error", "9")
            self.assertIn(whole, [step["transition"] for step in report["plan"]["steps"]])
            report = self.plan("--without", word, "--mode", "xray", "--max-error", "9")
            self.assertNotIn(whole, [step["transition"] for step in report["plan"]["steps"]])

    def test_mistyped_words_get_the_nearest(self):
        base = ["render", "phantom:sphere:8", "-o", "null:"]
        for words, nearest in (
                ([*base, "--turntabel", "3"], "--turntable"), ([*base, "--rotat=1,2,3"], "--rotate"),
                ([*base, "--mode", "mpi"], "mip"), ([*base, "--mode", "x-ray"], "xray"), ([*base, "--view", "frnt"], "front"),
                ([*base, "--via", "project.raycast"], "project.ray_cast"), ([*base, "--via", "raycast"], "ray_cast"),
                ([*base, "--via", "ray_cast/filtr=foh"], "filter"), ([*base, "--via", "ray_cast/filter=fho"], "foh"),
                ([*base, "--without", "spectrm"], "spectrum"), ([*base, "--minimize", "tiem"], "time"),
                ([*base, "--reference", "splin"], "spline"), ([*base, "--planner", "pilto"], "pilot"),
                (["rendr", "phantom:sphere:8"], "render"), (["list", "edgs"], "edges"),
                (["render", "phantom:spere:8", "-o", "null:"], "sphere")):
            done = self.run_it(*words, code=2)
            message = done.stderr.decode()
            self.assertIn(f"did you mean {nearest}?", message, words)
            self.assertLess(len(message), 160, words)
            self.assertEqual(done.stdout, b"")

    def test_an_option_of_another_verb_is_told(self):
        message = self.run_it("warp", "phantom:sphere:8", "-o", "null:", "--turntable", "3", code=2).stderr.decode()
        self.assertIn("--turntable", message)
        self.assertIn("render", message)
        message = self.run_it("render", "phantom:sphere:8", "-o", "null:", "--outside", "3", code=2).stderr.decode()
        self.assertIn("warp", message)

    def test_what_is_far_from_all_names_is_not_answered_by_forty(self):
        message = self.run_it("render", "phantom:sphere:8", "-o", "null:", "--quux", "3", code=2).stderr.decode()
        self.assertIn("--quux", message)
        self.assertIn("--help", message)
        self.assertLess(len(message), 160)
        message = self.run_it("render", "phantom:sphere:8", "-o", "null:", "--via", "quux", code=2).stderr.decode()
        self.assertIn("list edges", message)


class Places(Running):
    def picture(self, *words):
        return png(self.run_it("render", "phantom:gaussians:24", "--view", "z", "--size", "40x40", "--spacing", "1", *words, "--mode",
                               "mean", "--via", "ray_cast/filter=foh/step=0.25", "--window", "0,1", "--max-error", "9", "-o",
                               "-").stdout)

    def test_a_turntable_turns_at_its_place(self):
        out = self.folder / "f_%d.png"
        about_y_first, about_x_first = (self.picture("--rotate", "0,90,0", "--rotate", "20,0,0"),
                                        self.picture("--rotate", "20,0,0", "--rotate", "0,90,0"))
        apart = np.abs(about_y_first - about_x_first).mean()
        self.assertGreater(apart, 1)
        for order, right in ((["--turntable", "4", "--rotate", "20,0,0"], about_y_first),
                             (["--rotate", "20,0,0", "--turntable", "4"], about_x_first)):
            self.run_it("render", "phantom:gaussians:24", "--view", "z", "--size", "40x40", "--spacing", "1", *order, "--mode", "mean",
                        "--via", "ray_cast/filter=foh/step=0.25", "--window", "0,1", "--max-error", "9", "-o", out)
            frame = png((self.folder / "f_1.png").read_bytes())
            # The depth of four views is not that of one, and so samples along rays lie elsewhere.
            self.assertLess(np.abs(frame - right).mean(), apart / 10, order)

    def test_zoom_shows_the_middle_larger(self):
        small, large = self.picture("--spacing", "0.5"), self.picture("--spacing", "1", "--zoom", "2")
        self.assertTrue(np.array_equal(small, large))

    def test_one_number_is_the_longer_side(self):
        volume = self.folder / "v.nrrd"
        self.run_it("warp", "phantom:gaussians:24", "--size", "24x12x18", "--spacing", "1", "-o", volume)
        picture = png(self.run_it("render", volume, "--size", "48", "-o", "-").stdout)
        self.assertEqual(picture.shape, (24, 48))


if __name__ == "__main__":
    unittest.main()
