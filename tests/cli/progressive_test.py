"""Pictures on the way: `render --progressive` and `--stop-after`, against closed forms. Needs EDGEWISE."""

import ctypes
import json
import os
import struct
import unittest

import files
import numpy as np
from running import Running, native

MOVED = 0x40 | 0x80  # from a name and to one: events that are alike and follow one another would be one


class Arrivals:
    """The names that files leave and take in a folder, as the kernel tells."""

    def __init__(self, folder):
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.handle = self.libc.inotify_init1(os.O_NONBLOCK)
        self.libc.inotify_add_watch(self.handle, os.fsencode(folder), MOVED)

    def names(self):
        names = []
        try:
            while True:
                data = os.read(self.handle, 1 << 16)
                at = 0
                while at < len(data):
                    length = struct.unpack_from("iIII", data, at)[3]
                    names.append(data[at + 16:at + 16 + length].rstrip(b"\0").decode())
                    at += 16 + length
        except BlockingIOError:
            os.close(self.handle)
            return names


class Progressive(Running):
    DEPTH, OPACITY, COLOUR = 40, 0.05, (0.5, 0.25, 1)

    def setUp(self):
        self.source = self.folder / "s.nrrd"
        files.write_nrrd(self.source, np.full((self.DEPTH, 7, 9), 1.0, "<f4"))
        self.transfer = self.folder / "t.json"
        self.transfer.write_text(json.dumps({"points": [{"value": 1, "opacity": self.OPACITY, "color": self.COLOUR}], "unit": 1}))

    def render(self, *words, code=0, name="p.nrrd"):
        done = self.run_it("render", self.source, "-o", self.folder / name, "--mode", "composite", "--transfer", self.transfer,
                           "--via", "warp.backward/filter=foh", "--max-error", "9", "--json", self.folder / "r.json", *native(words), code=code)
        if code:
            return done.stderr.decode()
        self.report = json.loads((self.folder / "r.json").read_text())
        self.said = done.stderr.decode()
        return files.read(self.folder / name)[0].astype(float)

    def light(self, slices):
        return (1 - (1 - self.OPACITY) ** slices) * np.array(self.COLOUR)

    def test_the_first_picture_is_there_whatever_the_time(self):
        picture = self.render("--stop-after", "0")
        slices = -(-self.DEPTH // 16)
        np.testing.assert_allclose(picture, np.broadcast_to(self.light(slices), picture.shape), rtol=1e-5)
        refined = self.report["measured"]["refined"]
        self.assertTrue(refined["stopped"])
        self.assertEqual([(seen["slices"], seen["depth"]) for seen in refined["pictures"]], [(slices, self.DEPTH)])
        self.assertIn(f"{slices} of {self.DEPTH} slices", self.said)
        self.assertIn(", stopped on the way\n", self.said)

    def test_the_bound_holds_and_is_what_is_transparent(self):
        for edge, slices in (("composite.front_to_back/every=8", 8), ("composite.binary_tree_front_to_back/first=16", 16)):
            for background in ((0, 0, 0), (0.3, 1, 0.6)):
                words = ("--via", edge, "--background", ",".join(map(str, background)))
                front, whole = self.render("--stop-after", "0", *words), self.render(*words)
                bound = self.report["measured"]["refined"]
                self.assertIsNone(bound)
                self.render("--stop-after", "0", *words)
                bound = self.report["measured"]["refined"]["pictures"][-1]["bound"]
                through = (1 - self.OPACITY) ** slices
                np.testing.assert_allclose([bound["most"], bound["mean"]], through, rtol=1e-5)
                np.testing.assert_allclose(front, np.broadcast_to(self.light(slices) + through * np.array(background), front.shape), rtol=1e-5)
                self.assertLess(np.abs(whole - front).max(), bound["most"] + 1e-6)
                self.assertGreater(np.abs(whole - front).max(), 0.01)

    def test_bounds_fall_and_the_last_picture_is_the_same_bytes(self):
        scene = ("phantom:gaussians:32", "--rotate", "10,20,30", "--mode", "composite", "--max-error", "9",
                 "--via", "warp.backward/filter=foh", "--via", "composite.front_to_back")
        self.run_it("render", *scene, "-o", self.folder / "plain.nrrd")
        self.run_it("render", *scene, "-o", self.folder / "shown.nrrd", "--progressive", "--json", self.folder / "r.json")
        self.assertEqual((self.folder / "plain.nrrd").read_bytes(), (self.folder / "shown.nrrd").read_bytes())
        refined = json.loads((self.folder / "r.json").read_text())["measured"]["refined"]
        self.assertFalse(refined["stopped"])
        for number in ("most", "mean"):
            bounds = [seen["bound"][number] for seen in refined["pictures"]]
            self.assertEqual(bounds, sorted(bounds, reverse=True))
            self.assertEqual(bounds[-1], 0)
        self.assertEqual([seen["slices"] for seen in refined["pictures"]], sorted({seen["slices"] for seen in refined["pictures"]}))

    def test_each_picture_takes_the_place_of_the_one_before(self):
        for words, count in ((("--progressive",), 14), (("--stop-after", "1h"), 1),
                             (("--progressive", "--repeat", "3", "--via", "composite.front_to_back/every=10"), 4)):
            folder = self.folder / "arrivals"
            folder.mkdir(exist_ok=True)
            arrivals = Arrivals(folder)
            self.render(*words, name="arrivals/p.png")
            self.assertEqual([name for name in arrivals.names() if name == "p.png"], ["p.png"] * count, words)
            self.assertEqual(os.listdir(folder), ["p.png"])

    def test_views_have_files_of_their_own(self):
        self.run_it("render", self.source, "-o", self.folder / "v%d.png", "--mode", "composite", "--transfer", self.transfer,
                    "--max-error", "9", "--turntable", "3", "--size", "native", "--stop-after", "0", "--json", self.folder / "r.json", "--threads", "2")
        refined = json.loads((self.folder / "r.json").read_text())["measured"]["refined"]
        self.assertEqual(sorted(seen["view"] for seen in refined["pictures"]), [0, 1, 2])
        self.assertTrue(all((self.folder / f"v{view}.png").exists() for view in range(3)))

    def test_errors_are_measured_of_the_picture_that_is_there(self):
        words = ("render", "phantom:gaussians:32", "--mode", "composite", "--max-error", "0.05", "--size", "native", "-o", "null:", "--verify=all",
                 "--json", self.folder / "r.json")
        self.run_it(*words, "--stop-after", "0")
        measured = json.loads((self.folder / "r.json").read_text())["measured"]
        self.assertFalse(measured["kept"])
        self.assertGreater(measured["error"]["nrmse"], 0.05)
        self.run_it(*words, "--stop-after", "1h")
        self.assertTrue(json.loads((self.folder / "r.json").read_text())["measured"]["kept"])

    def test_a_cast_ends_with_the_picture_of_all_rays(self):
        scene = ("phantom:gaussians:32", "--mode", "composite", "--max-error", "9", "--size", "75x50", "--rotate", "10,20,30")
        for words in ((), ("--shade", "phong", "--light", "1,0,-1,2"), ("--perspective", "50"), ("--depth-cue", "0.02"),
                      ("--perspective", "70", "--eye", "16,15,12", "--look-at", "20,10,30", "--shade", "phong"),
                      ("--clip-plane", "1,1,0,-20"), ("--shade", "phong", "--shadows")):
            pictures = {}
            for name, via, more in (("whole", "project.ray_cast/filter=foh/step=0.5", ()),
                                    ("cast", "project.front_cast/filter=foh/step=0.5", ()),
                                    ("shown", "project.front_cast/filter=foh/step=0.5", ("--progressive", "--threads", "2")),
                                    ("front", "project.front_cast/filter=foh/step=0.5", ("--stop-after", "0", "--json", self.folder / "r.json"))):
                self.run_it("render", *scene, *words, "--via", via, *more, "-o", self.folder / "p.nrrd")
                pictures[name] = files.read(self.folder / "p.nrrd")[0].astype(float)
            self.assertGreater(pictures["whole"].max(), 0.05, words)
            np.testing.assert_allclose(pictures["cast"], pictures["whole"], atol=2e-6, rtol=2e-6, err_msg=str(words))
            np.testing.assert_array_equal(pictures["shown"], pictures["cast"])
            refined = json.loads((self.folder / "r.json").read_text())["measured"]["refined"]
            self.assertTrue(refined["stopped"], words)
            off = np.abs(pictures["front"] - pictures["whole"]).max()
            self.assertLessEqual(off, refined["pictures"][-1]["bound"]["most"] + 1e-6)
            self.assertGreater(off, 1e-3, words)

    def test_a_front_is_the_picture_of_the_slices_in_front(self):
        for slabs in (2, 5, 8, 40, 4000):
            front = self.light(self.DEPTH / min(slabs, self.DEPTH))
            self.run_it("render", self.source, "-o", self.folder / "p.nrrd", "--mode", "composite", "--transfer", self.transfer, "--max-error", "9",
                        "--via", f"project.front_cast/step=1/slabs={slabs}", "--stop-after", "0")
            picture = files.read(self.folder / "p.nrrd")[0]
            np.testing.assert_allclose(picture, np.broadcast_to(front, picture.shape), rtol=1e-5)

    def test_other_edges_say_that_they_show_nothing(self):
        done = self.run_it("render", self.source, "-o", self.folder / "p.nrrd", "--mode", "composite", "--transfer", self.transfer,
                           "--via", "project.ray_cast", "--progressive", code=3)
        self.assertIn("shows no pictures on the way", done.stderr.decode())

    def test_refuses_what_cannot_be(self):
        for words, said in ((("--progressive", "--strict"), "--strict"), (("--stop-after", "1h", "--strict"), "--strict"),
                            (("--stop-after", "soon"), "--stop-after: 'soon'"), (("--stop-after", "-1s"), "--stop-after: -1s is negative"),
                            (("--progressive", "--mode", "xray"), "--mode composite, not of xray"),
                            (("--progressive", "--turntable", "3"), "p_%03d.png")):
            self.assertIn(said, self.render(*words, code=2, name="p.png"), words)
        self.assertIn("-o x.gif: pictures on the way", self.run_it(
            "render", self.source, "-o", "x.gif", "--mode", "composite", "--turntable", "3", "--progressive", code=2).stderr.decode())
        self.assertIn("-o -: pictures on the way", self.run_it(
            "render", self.source, "-o", "-", "--mode", "composite", "--progressive", code=2).stderr.decode())
        self.assertIn("no --via warp.backward", self.render("--progressive", "--shade", "phong", code=3))


if __name__ == "__main__":
    unittest.main()
