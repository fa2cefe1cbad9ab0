"""Every mode that `list modes` names, with every edge that `list edges` names: paths keep the errors that they promise. Needs EDGEWISE, EDGEWISE_DATA.

Nothing here names a mode or an edge that a sweep goes over, so that one that is added later is swept as well. All paths of a
request are compared with the same reference on all pixels. So any two of them differ by at most the sum of their promises."""

import json
import subprocess
import unittest

import files
import numpy as np
from running import COMMAND, DATA, Running

ON_DEMAND = "taken only where --via names it"
# A promise is the error of drawn pixels (of small pictures: of all), raised by three standard errors. What it does not count is
# within 15 %: steps of 8 bits under gradients, cells that a clip cuts.
CHANCE = 1.15
# At least so many places of a picture are drawn. Of pixels that are as rare as 3 in 72 they meet none in one case of twenty. Where
# a mode shows the first hit of a ray, these miss it by all of a surface's light.
PLACES = 72
SMALL = 1 << 12  # pixels: such pictures are measured whole
ROUNDING = 1e-6  # of f32, of the range
# Where a ray grazes a surface, f32 finds the hit, and with it the normal, less well.
GRAZING = 2e-4


def thin_vessels():
    """8 bits, empty but for a few curves of brightness in a corner."""
    random = np.random.default_rng(3)
    samples = np.zeros((54, 60, 56), "u1")
    for _ in range(3):
        at, way = random.uniform(8, 22, 3), random.normal(size=3)
        for _ in range(30):
            way += 0.4 * random.normal(size=3)
            at = np.clip(at + way / np.linalg.norm(way), 6, 23)
            z, y, x = at.astype(int)
            samples[z, y, x] = 250
            samples[z - 1:z + 2, y - 1:y + 2, x - 1:x + 2] = np.maximum(samples[z - 1:z + 2, y - 1:y + 2, x - 1:x + 2], 120)
    return samples


def tissues():
    """Three labels: two balls that touch, and a box."""
    z, y, x = np.mgrid[:28, :30, :32]
    labels = np.zeros((28, 30, 32), "u1")
    labels[(x - 11) ** 2 + (y - 14) ** 2 + (z - 13) ** 2 < 49] = 1
    labels[(x - 20) ** 2 + (y - 16) ** 2 + (z - 15) ** 2 < 36] = 2
    labels[4:9, 4:9, 18:26] = 3
    return labels


class EveryPath(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.modes = [line.split(":")[0] for line in cls.listed("modes").splitlines()]
        edges = json.loads(cls.listed("edges", "--json", "-"))["edges"]
        found, more = set(), {"screen/picture"}
        while more != found:  # what leads to a picture, by the names of vertices
            found = set(more)
            more |= {join["from"] for edge in edges for join in edge["joins"] if join["to"].startswith(tuple(found))}
        cls.edges = [edge for edge in edges if any(join["to"].startswith(tuple(found)) for join in edge["joins"])]
        cls.shades = {mode["name"]: mode["shades"] for mode in json.loads(cls.listed("modes", "--json", "-"))["modes"]}
        vessels = cls.folder / "vessels.nrrd"
        files.write_nrrd(vessels, thin_vessels())
        labels = cls.folder / "tissues.nrrd"
        files.write_nrrd(labels, tissues())
        # Input and view, a value that is clear, one that is not, and a level between them.
        cls.scenes = {
            "formula": (["phantom:gaussians:20", "--rotate", "25,-40,10", "--size", "native"], 0.1, 0.9, 0.5),
            "vessels": ([vessels, "--rotate", "10,20,0", "--size", "40x40"], 40, 220, 100),
            "head": ([DATA / "ct_head/quarter.nhdr", "--orient", "RPI", "--rotate", "10,30,0", "--size", "32x32"], 300, 1500, 600),
            "artery": ([DATA / "carotid/carotid.vtk", "--rotate", "20,30,0", "--size", "40x40"], 50, 400, 150),
            "large": ([DATA / "ct_head/quarter.nhdr", "--orient", "RPI", "--rotate", "10,30,0", "--size", "native"], 300, 1500, 600),
            "labels": ([labels, "--labels", "--rotate", "25,-40,10", "--size", "native"], 0, 3, 1)}
        cls.takes_level = {}  # mode, of labels: whether it asks for --isovalue
        cls.run_by = {}  # edge: the requests that it was run in

    @classmethod
    def listed(cls, *words):
        return subprocess.run([COMMAND, "list", *words], capture_output=True, text=True, check=True, env=cls.env).stdout

    def transfer(self, low, high):
        file = self.folder / f"{low}_{high}.json"
        file.write_text(json.dumps({"unit": 1, "points": [{"value": low, "opacity": 0, "color": [1, 0.5, 0.2]},
                                                          {"value": high, "opacity": 0.3, "color": [0.4, 0.8, 1]}]}))
        return file

    def done(self, *words):
        return subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, env=self.env, timeout=200)

    def request(self, scene, *words):
        """The words of a request; those that its mode asks for are added."""
        source, low, high, level = self.scenes[scene]
        request = [*source, *words]
        if "composite" in words:
            request += ["--transfer", self.transfer(low, high)]
        mode = words[words.index("--mode") + 1]
        kind = (mode, "--labels" in source)
        if kind not in self.takes_level:
            plan = self.done("plan", "render", *request, "--json", "-")
            self.takes_level[kind] = plan.returncode == 2 and "--isovalue" in plan.stderr
        return request + ["--isovalue", level] * self.takes_level[kind]

    def measured(self, request, limit, via=()):
        """Points of a chart with all pixels compared, or None where no path leads there."""
        out = self.folder / "chart.json"
        done = self.done("chart", "render", *request, "--repeat", 1, "--verify=all", "--limit", limit, "--max-error", "9", "--quiet",
                         "-o", out, *(word for edge in via for word in ("--via", edge)))
        if via and done.returncode == 3:
            return None
        self.assertEqual(done.returncode, 0, f"{request} {via}: {done.stderr}")
        return json.loads(out.read_text())["points"]

    def expect_kept(self, points, request):
        first_hits = "--isovalue" in request or "--labels" in request
        for point in points:
            path = " > ".join(point["steps"])
            where = f"{' '.join(map(str, request))}: {path}"
            error, promise = point["measured"]["error"], point["predicted"]["error"]
            for step in point["steps"]:
                self.run_by.setdefault(step.split("/")[0], []).append(request)
            self.assertTrue(np.isfinite(error["nrmse"]), where)
            if promise is None:
                continue  # nothing is promised, and no budget takes it
            bound = CHANCE * promise + (GRAZING if first_hits else ROUNDING)
            if first_hits and error["samples"] > SMALL:
                bound += error["max"] / error["range"] * np.sqrt(3 / PLACES)
            if error["low"] > bound:
                self.broken.append(f"{where}: {error['nrmse']:.3g}, promised {promise:.3g}")

    def sweep(self, scene, *words, limit=40, also=None):
        """All paths of a request up to a number. Then two of each edge of `also` that is not on these; None: of every edge that only
        --via brings, or that the number left out. @return the edges that were run"""
        request = self.request(scene, *words)
        met = set()

        def run(limit, *via):
            points = self.measured(request, limit, via)
            if points is not None:
                self.expect_kept(points, request)
                met.update(step.split("/")[0] for point in points for step in point["steps"])
            return len(points or ())

        whole = run(limit) < limit
        if also is None:
            reasons = self.refused(request)
            also = {edge for edge, reason in reasons.items() if reason == ON_DEMAND}
            for family in sorted({edge.split(".")[0] for edge in also}):
                # Where a family is asked for, its edges tell their own reasons.
                also -= {edge for edge in self.refused(request, "--via", family) if edge.startswith(family + ".")}
            if not whole:
                also |= {edge["name"] for edge in self.edges} - set(reasons)
        for edge in sorted(also - met):
            run(2, edge)
        return met

    def refused(self, request, *words):
        """Edges and their reasons."""
        plan = json.loads(self.done("plan", "render", *request, *words, "--max-error", "9", "--json", "-").stdout)
        return {refusal["transition"]: refusal["reason"] for refusal in plan["refused"]}

    def setUp(self):
        self.broken = []

    def tearDown(self):
        self.assertFalse(self.broken, "broken promises:\n" + "\n".join(self.broken))

    def test_every_mode_by_every_edge(self):
        """A formula by all edges, a scan by those that came to a picture of the formula, and what only empty space or voxels that
        are no cubes bring."""
        for mode in self.modes:
            met = self.sweep("formula", "--mode", mode)
            self.sweep("artery", "--mode", mode, limit=16, also=met)
            self.sweep("head", "--mode", mode, limit=8, also=set())
            self.sweep("vessels", "--mode", mode, limit=8, also=set())
        self.try_elsewhere()
        pictures = {edge["name"] for edge in self.edges if any(join["to"].startswith("screen/picture") for join in edge["joins"])}
        self.assertFalse(pictures - set(self.run_by), "edges to a picture that no request took")
        # Words of parameters that the planner does not try by itself, in the first request that took the edge. Filters have
        # properties/filters_test.py.
        for edge in self.edges:
            for key, domain in edge["parameters"].items():
                for word in sorted(set(domain.get("words", ())) - set(domain["tried"])) if key != "filter" else ():
                    request = self.run_by.get(edge["name"], [None])[0]
                    points = request and self.measured(request, 2, [f"{edge['name']}/{key}={word}"])
                    if points:
                        self.expect_kept(points, request)

    def try_elsewhere(self):
        """Edges that no request has run yet, by themselves or behind an edge that makes what they read."""
        for edge in (edge for edge in self.edges if edge["name"] not in self.run_by):
            reads = {join["from"] for join in edge["joins"]}
            before = [[other["name"]] for other in self.edges if other["name"] in self.run_by and reads & {join["to"] for join in other["joins"]}]
            views = [("vessels", [], self.modes[:4:3]), ("large", [], self.modes[:4:3]), ("artery", ["--perspective", "30"], self.modes[:4:3]),
                     ("formula", ["--depth-cue", "0.01,linear"], self.modes[1:2]),
                     ("formula", ["--shade", self.shades["xray"][0]], ["xray"]), ("labels", [], self.modes)]
            for scene, view, mode, via in [(scene, view, mode, via) for via in ([], *before[:2]) for scene, view, modes in views for mode in modes]:
                request = [*self.request(scene, "--mode", mode), *view]
                points = self.measured(request, 2, [*via, edge["name"]])
                if points:
                    self.expect_kept(points, request)
                    break

    def test_light_and_cuts_by_every_edge(self):
        ways = [("--mode", "composite", "--shade", shade) for shade in self.shades["composite"]]
        # Sums have the same rules, and each takes one.
        sums = [mode for mode in self.shades if self.shades[mode] == self.shades["xray"]]
        ways += [("--mode", mode, "--shade", shade, "--light", "-1,-1,-1") for mode, shade in zip(sums, self.shades["xray"])]
        ways += [("--mode", "composite", "--shade", self.shades["composite"][0], "--shadows", "--light", "-1,-1,-1"),
                 ("--mode", "composite", "--perspective", "40"), ("--mode", "composite", "--depth-cue", "0.02"),
                 ("--mode", "mip", "--clip", "3,3,3,15,14,16"), ("--mode", "mean", "--clip-plane", "1,2,1,-40")]
        for words in ways:
            self.sweep("formula", *words, limit=24)
            self.sweep("artery", *words, limit=8, also=set())

    def test_pictures_of_which_a_part_is_drawn(self):
        for mode in self.modes:
            self.sweep("large", "--mode", mode, also=set(), limit=5)


if __name__ == "__main__":
    unittest.main()
