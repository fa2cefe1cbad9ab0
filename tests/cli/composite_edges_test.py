"""Composites by way of classified samples: the same picture as project.combine, whatever the order, and never chosen unasked."""

import json
import unittest

import numpy as np

from running import Running

ORDERS = ("composite.back_to_front", "composite.front_to_back", "composite.binary_tree", "composite.binary_tree_front_to_back",
          "composite.attenuated_sum")
EDGES = ("composite.classify", *ORDERS)
SCENE = ("phantom:gaussians:32", "--rotate", "10,20,30", "--mode", "composite", "--size", "native", "--max-error", "9")


class CompositeEdges(Running):
    def render(self, name, *words, code=0):
        file = self.folder / (name + ".nrrd")
        done = self.run_it("render", *SCENE, "-o", file, *words, code=code)
        return samples_of(file) if code == 0 else done.stderr.decode()

    def test_all_orders_are_the_picture_of_combine(self):
        for warp in ("warp.backward/filter=foh", "warp.permutation/filter=zoh"):
            combined = self.render("combined", "--via", warp, "--via", "project.combine")
            self.assertGreater(np.abs(combined).max(), 0.05)
            for edge in ORDERS:
                picture = self.render("order", "--via", warp, "--via", edge)
                # 56 slices: some hundred roundings of 2^-24, and rays that end early 2^-12 before they are opaque.
                self.assertLessEqual(np.abs(picture - combined).max(), 2**-12 + 120 * 2**-24, (warp, edge))

    def test_alpha_is_the_same_too(self):
        words = ("--via", "warp.backward/filter=foh", "--background", "none")
        combined = self.render("combined", *words, "--via", "project.combine")
        self.assertEqual(combined.shape[-1], 4)
        for edge in ORDERS:
            picture = self.render("order", *words, "--via", edge)
            self.assertLessEqual(np.abs(picture[..., 3] - combined[..., 3]).max(), 2**-12 + 120 * 2**-24, edge)

    def test_the_way_through_classified_samples_is_reported(self):
        report = json.loads(self.run_it("render", *SCENE, "-o", "null:", "--via", "binary_tree", "--quiet", "--json", "-",
                                        "--verify=all").stdout)
        steps = [step["transition"] for step in report["plan"]["steps"]]
        self.assertEqual(steps[-2:], ["composite.classify", "composite.binary_tree"])
        measured, predicted = report["measured"]["error"]["nrmse"], report["plan"]["predicted"]["error"]
        self.assertLess(measured, 1.1 * predicted)

    def test_errors_are_predicted_as_those_of_combine(self):
        def predicted(edge):
            report = json.loads(self.run_it("plan", "render", *SCENE, "--via", "warp.backward/filter=foh", "--via", edge, "--quiet",
                                            "--json", "-").stdout)
            return report["plan"]["predicted"]["error"]
        combined = predicted("project.combine")
        for edge in ORDERS:
            self.assertLess(abs(predicted(edge) - combined), 1e-5 * combined, edge)

    def test_threads_and_boxes_change_no_byte(self):
        for edge in ORDERS:
            words = ("--via", "warp.backward/filter=foh", "--via", edge)
            first = self.render("one", *words, "--threads", "1")
            self.assertTrue(np.array_equal(first, self.render("seven", *words, "--threads", "7")), edge)

    def test_pictures_on_the_way_change_no_byte(self):
        for plain, refined in (("composite.front_to_back", "composite.front_to_back/every=5"),
                               ("composite.binary_tree_front_to_back", "composite.binary_tree_front_to_back/first=4")):
            words = ("--via", "warp.backward/filter=foh", "--via")
            self.assertTrue(np.array_equal(self.render("plain", *words, plain), self.render("refined", *words, refined)), plain)

    def test_they_are_listed(self):
        listed = json.loads(self.run_it("list", "edges", "--json", "-").stdout)["edges"]
        joins = {edge["name"]: edge["joins"] for edge in listed}
        self.assertEqual(joins["composite.classify"], [{"from": "screen/scalar", "to": "screen/classified"}])
        for edge in ORDERS:
            self.assertEqual(joins[edge], [{"from": "screen/classified", "to": "screen/picture"}])
        shown = self.run_it("list", "edges").stdout.decode()
        for edge in EDGES:
            self.assertIn(edge, shown)

    def test_the_planner_takes_what_is_cheaper(self):
        for words in ((), ("--max-error", "0.05"), ("--max-time", "5s"), ("--minimize", "error"), ("--minimize", "memory"),
                      ("--turntable", "6"), ("--transfer", self.transfer()), ("--without", "project.ray_cast"),
                      ("--without", "project.ray_cast", "--without", "project.shear_warp")):
            for volume in ("phantom:gaussians:32", "phantom:gaussians:96"):
                report = json.loads(self.run_it("plan", "render", volume, "--rotate", "10,20,30", "--mode", "composite", *words,
                                                "--quiet", "--json", "-").stdout)
                steps = [step["transition"] for step in report["plan"]["steps"]]
                self.assertFalse(set(steps) & set(EDGES), (volume, words, steps))

    def test_the_family_is_enough(self):
        report = json.loads(self.run_it("plan", "render", *SCENE, "--via", "composite", "--quiet", "--json", "-").stdout)
        steps = [step["transition"] for step in report["plan"]["steps"]]
        self.assertEqual(steps[-2], "composite.classify")
        self.assertIn(steps[-1], ORDERS)

    def test_graphs_hold_them_where_they_are_asked_for(self):
        def graph(*words):
            file = self.folder / "graph.json"
            self.run_it("graph", "render", "phantom:gaussians:32", "--rotate", "10,20,30", *words, "-o", file)
            graph = json.loads(file.read_text())
            self.assertLessEqual(len(graph["vertices"]), 30)
            self.assertLessEqual(len(graph["edges"]), 120)
            return graph
        for mode in ("mip", "xray", "composite"):
            unasked = graph("--mode", mode)
            self.assertNotIn("classified", json.dumps(unasked["vertices"]), mode)
            self.assertFalse({edge["transition"] for edge in unasked["edges"]} & set(EDGES), mode)
        reasons = {refused["transition"]: refused["reason"] for refused in unasked["refused"]}
        for edge in ORDERS:
            self.assertEqual(reasons[edge], "taken only where --via names it")
            asked = graph("--mode", "composite", "--via", edge)
            self.assertEqual({other["transition"] for other in asked["edges"]} & set(EDGES), {"composite.classify", edge})

    def test_what_they_cannot_do_is_refused_with_its_reason(self):
        for words, reason in ((("--shade", "phong"), "light needs gradients"), (("--clip", "4,4,4,20,20,20"), "the clip cuts slices"),
                              (("--perspective", "40"), "composite.classify"),
                              (("--mode", "mip"), "nobody reads light and transparency")):
            message = self.render("refused", *words, "--via", "composite.classify", "--via", "composite.binary_tree", code=3)
            self.assertIn(reason, message, words)
        message = self.render("refused", "--via", "composite.binary_tree_front_to_back/first=12", code=3)
        self.assertIn("1, 2, 4, 8", message)

    def transfer(self):
        file = self.folder / "transfer.json"
        file.write_text(json.dumps({"points": [{"value": v, "opacity": 0.02 * v, "color": [v, 0.5, 1 - v]}
                                               for v in (0, 0.2, 0.4, 0.6, 0.8, 1)]}))
        return file


def samples_of(file):
    """Floats of a NRRD file, with channels last."""
    head, _, body = file.read_bytes().partition(b"\n\n")
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    sizes = [int(n) for n in fields["sizes"].split()]
    assert fields["encoding"] == "raw" and fields["type"] in ("float", "f4"), fields
    return np.frombuffer(body, "<f4").reshape(sizes[::-1]).astype(float)


if __name__ == "__main__":
    unittest.main()
