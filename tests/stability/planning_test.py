"""Where choices fail: models that are wrong, prices that are none, requests without a way."""

import itertools
import json
import math

import numpy as np
from driving import Driven, main, write_nrrd

TERMS = ("operation", "streamed", "gather", "local", "global", "latency", "byte", "start")


class Prices(Driven):
    def profile(self, changes):
        machine = {"schema": 1, "name": "made", "processors": 2, "operation": 0.05e-9,
                   "streamed": 0.12e-9, "gather": 0.22e-9, "local": 0.3e-9, "global": 1e-9,
                   "latency": 1e-7, "byte": 1e-10, "start": 20e-6, **changes}
        file = self.folder / "machine.json"
        file.write_text(json.dumps(machine))
        return file

    def scene(self):
        z, y, x = (np.indices((24, 24, 24)) - 11.5) / 12
        samples = np.exp(-4 * (x ** 2 + 2 * (y - 0.2) ** 2 + z ** 2)).astype("<f4")
        write_nrrd(self.folder / "scene.nrrd", samples)
        return self.folder / "scene.nrrd"

    def test_S42_a_term_that_is_wrong_by_ten_costs_time_only(self):
        """Whatever the model believes, what it chooses keeps the error that was asked for."""
        scene = self.scene()
        # Less than what the cheapest ways are off by.
        jobs = ((["warp", scene, "--rotate", "10,20,30"], 0.01),
                (["render", scene, "--rotate", "10,20,30", "--mode", "xray"], 0.005),
                (["render", scene, "--rotate", "10,20,30", "--mode", "composite"], 0.002))
        chosen = set()
        for term, factor in itertools.product(TERMS, (0.1, 10)):
            file = self.profile({})
            right = json.loads(file.read_text())[term]
            file = self.profile({term: right * factor})
            for job, most in jobs[:3 if term in TERMS[:3] else 1]:
                report = self.report(*job, "-o", "null:", "--machine", file, "--max-error", most,
                                     "--verify=500")
                chosen.add(tuple(step["transition"] + json.dumps(step["parameters"])
                                 for step in report["plan"]["steps"]))
                measured = report["measured"]["error"]
                self.assertLessEqual(measured["low"], most)
                self.assertLessEqual(measured["nrmse"], report["plan"]["predicted"]["error"] * 1.05)
        self.assertGreater(len(chosen), 2)

    def test_S42_absurd_factors_of_edges(self):
        """A millionfold price takes an edge off the plan, never off the list of answers."""
        scene = self.scene()
        words = ["render", scene, "--rotate", "10,20,30", "--max-error", "0.02"]
        first = self.report("plan", *words)["plan"]["steps"]
        dear = {step["transition"]: 1e6 for step in first}
        report = self.report(*words, "-o", "null:", "--machine", self.profile({"factors": dear}),
                             "--verify=500")
        self.assertLessEqual(report["measured"]["error"]["low"], 0.02)
        self.assertNotEqual([s["transition"] for s in report["plan"]["steps"]],
                            [s["transition"] for s in first])

    def test_S42_ties_are_broken_the_same_way_always(self):
        """All prices 0: every path costs the same time."""
        scene = self.scene()
        free = self.profile({term: 0 for term in TERMS})
        texts = {json.dumps(self.report("plan", "render", scene, "--rotate", "10,20,30",
                                        "--machine", free)["plan"]["steps"]) for _ in range(5)}
        self.assertEqual(len(texts), 1)
        self.report("render", scene, "-o", "null:", "--machine", free)

    def test_S42_prices_that_are_none_are_refused(self):
        scene = self.scene()
        for term in TERMS:
            for price in ("NaN", "Infinity", "-Infinity", "-1e-9", "1e400", '"1"', "null", "[]"):
                file = self.profile({})
                machine = json.loads(file.read_text())
                machine[term] = "PRICE"
                file.write_text(json.dumps(machine).replace('"PRICE"', price))
                done = self.run_it("plan", "warp", scene, "--machine", file, code=None)
                self.assertIn(done.returncode, (2, 4), f"{term}: {price}: {done.stderr}")
                self.assertIn("machine", done.stderr)
        for factors in ({"warp.backward": -1}, {"warp.backward": "x"}, [], 3):
            file = self.profile({"factors": factors})
            done = self.run_it("plan", "warp", scene, "--machine", file, code=None)
            self.assertIn(done.returncode, (2, 4), done.stderr)

    def test_S42_a_graph_without_a_way(self):
        scene = self.scene()
        edges = [edge["name"] for edge in self.edges()]
        words = [word for edge in edges for word in ("--without", edge)]
        done = self.run_it("plan", "warp", scene, "--rotate", "1,2,3", *words, code=3)
        self.assertIn("edgewise: ", done.stderr)
        report = self.report("plan", "render", scene, "--without", "project", "--without",
                             "spectrum", code=3)
        self.assertIsNone(report["plan"])
        self.assertEqual(report["error"]["code"], 3)

    def test_S42_predictions_are_finite_for_any_extent(self):
        for extent in ("1x1x1", "1x1x100000", "100000x1x1", "2000x2000x2000", "4096x4096x4096",
                       "3x60000x7"):
            for job in ("warp", "render"):
                done = self.run_it("plan", job, f"describe:{extent}:u8", "--json", "-", "--quiet",
                                   "--machine", self.profile({}), code=None)
                self.assertIn(done.returncode, (0, 3), done.stderr)
                report = json.loads(done.stdout)
                for plan in report.get("front", []):
                    for key in ("seconds", "bytes"):
                        number = plan["predicted"][key]
                        self.assertTrue(number is not None and math.isfinite(number)
                                        and number >= 0, plan)

    def test_S31_S30_ranks_are_planned_and_not_run(self):
        """Boxes of ranks are convex and have one order along a ray; nothing else is taken."""
        scene = self.scene()
        for ranks in (1, 2, 3, 7, 64, 1000):
            done = self.run_it("plan", "render", "describe:64x64x64:u8", "--mode", "xray",
                               "--machine", "cluster", "--ranks", ranks, code=None)
            self.assertIn(done.returncode, (0, 3), done.stderr)
        done = self.run_it("render", scene, "-o", "null:", "--ranks", "4", code=2)
        self.assertIn("a run is on one rank", done.stderr)


class Absent(Driven):
    """What does not exist is not accepted: a request for it ends before any work."""

    def test_S19_edges_that_do_not_exist(self):
        for name in ("warp.ewa", "warp.antialias"):
            done = self.run_it("render", "phantom:sphere:8", "-o", "null:", "--via", name, code=2)
            self.assertIn(name, done.stderr)

    def test_S19_options_that_do_not_exist(self):
        for verb, option in (("warp", "--antialias"), ("render", "--antialias")):
            done = self.run_it(verb, "phantom:sphere:8", "-o", "null:", option, code=2)
            self.assertIn(option, done.stderr)

    def test_S40_modes_that_do_not_exist(self):
        done = self.run_it("render", "phantom:sphere:8", "-o", "null:", "--mode", "skeleton", code=2)
        self.assertIn("mip", done.stderr)


if __name__ == "__main__":
    main()
