"""Plans for volumes and machines that are not there. Needs EDGEWISE."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
from scipy.optimize import nnls

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
HUGE = "describe:4096x4096x4096:u16"


class Describe(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        self.addCleanup(shutil.rmtree, self.folder)

    def run_it(self, *words, code=0):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=60, text=True,
                              env={**os.environ, "XDG_CONFIG_HOME": str(self.folder)}, check=False)
        self.assertEqual(done.returncode, code, f"{words}: {done.stderr}")
        return done

    def report(self, *words):
        return json.loads(self.run_it(*words, "--json", "-", "--quiet").stdout)

    def plan(self, *words):
        return self.report("plan", *words)["plan"]

    def test_needs_neither_data_nor_the_memory_for_them(self):
        done = self.plan("render", HUGE, "--mode", "xray", "--machine", "cluster", "--ranks", 4096,
                         "--max-memory", "4GiB")
        self.assertEqual(done["steps"][0]["transition"], "net.spread")
        # A rank's share of the samples at least, and far from all of them.
        self.assertGreaterEqual(done["predicted"]["bytes"], 2 * 4096**3 / 4096)
        self.assertLess(done["predicted"]["bytes"], 4 * 2**30)

    def test_a_rank_must_hold_its_share(self):
        done = self.run_it("plan", "render", HUGE, "--mode", "xray", "--machine", "cluster", "--ranks", 16,
                           "--max-memory", "4GiB", code=3)
        self.assertIn("no plan keeps to", done.stderr)

    def test_a_machine_says_how_many_ranks_and_how_much_memory(self):
        asked = self.report("plan", "render", HUGE, "--machine", "cluster")
        self.assertEqual(asked["request"]["ranks"], 4096)
        self.assertEqual(asked["request"]["threads"], 16)
        for entry in json.loads(self.run_it("list", "machines", "--json", "-").stdout)["machines"]:
            if entry["name"] == "maspar-mp1-16k":
                self.assertEqual(entry["ranks"], 16384)
                return
        self.fail("no maspar-mp1-16k")

    def test_seconds_are_s_over_p_and_log_p(self):
        # Within one rank warps send nothing.
        for edge, least in (("project.ray_cast/filter=foh/step=1", 0), ("warp.backward/filter=foh", 1),
                            ("warp.permutation/filter=foh", 1)):
            ranks = 2 ** np.arange(least, 13)
            seconds = self.scaling(ranks, edge)
            terms = np.stack([np.ones(len(ranks)), 4096**3 / ranks, np.log2(ranks)], axis=1)
            found, _ = nnls(terms / seconds[:, None], np.ones(len(ranks)))
            self.assertLess(np.max(np.abs(terms @ found / seconds - 1)), 0.1, f"{edge}: {seconds}")
            self.assertTrue(np.all(np.diff(seconds) < 0), edge)

    def scaling(self, ranks, edge):
        """Of the same algorithm on every number of ranks; one rank is spread over by nothing."""
        words = ["render", HUGE, "--rotate", "30,20,10", "--mode", "xray", "--machine", "cluster", "--threads", 16,
                 "--max-memory", "10000TB", "--max-error", 1, "--max-time", "1000h"]
        spread = ["--via", "net.spread/layout=slice-and-dice"]
        return np.array([self.plan(*words, "--ranks", p, *(spread if p > 1 else []), "--via", edge)["predicted"]["seconds"]
                         for p in ranks])

    def test_a_small_volume_stays_on_one_rank(self):
        # [W93] TABLE 29: 32^3 by zero-order hold takes 0.097 s on one processor of the Proteus, 0.150 s on 32.
        def begins(side, hold):
            return self.plan("render", f"describe:{side}x{side}x{side}:u8", "--rotate", "20,20,20", "--size", "native", "--machine", "proteus-32",
                             "--max-error", 1, "--via", f"project.ray_cast/filter={hold}/step=1")["steps"][0]["transition"]
        self.assertEqual(begins(32, "zoh"), "project.ray_cast")
        self.assertEqual(begins(32, "foh"), "net.spread")
        self.assertEqual(begins(128, "zoh"), "net.spread")

    def test_what_is_known_of_the_samples_changes_the_choice(self):
        def error(*more):
            return self.plan("warp", ":".join(["describe:256x256x256:u8", *more]), "--rotate", "10,20,30",
                             "--via", "warp.backward/filter=foh", "--max-error", 1)["predicted"]["error"]
        smooth, rough = error("spectrum=4"), error("spectrum=1.5")
        self.assertLess(smooth, rough)
        self.assertLess(error("spectrum=0.1"), error("spectrum=1"))
        self.assertEqual(error(), error("spectrum=3"))

    def test_spacing_and_occupied(self):
        done = self.report("plan", "render", "describe:64x64x32:u8:spacing=1,1,2:occupied=0.1", "--size", "native", "--mode", "composite")
        self.assertEqual(done["plan"]["steps"][-1]["to"].split("/")[-1].split("x")[:2], ["64", "64"])
        self.run_it("graph", "render", "describe:64x64x32:u8", "-o", self.folder / "graph.json")
        graph = json.loads((self.folder / "graph.json").read_text())
        self.assertTrue(graph["edges"])

    def test_runs_need_samples_and_one_rank(self):
        out = self.folder / "out.nrrd"
        done = self.run_it("warp", "describe:8x8x8:u8", "-o", out, code=2)
        self.assertIn("a description has no samples", done.stderr)
        done = self.run_it("render", "phantom:sphere:16", "--ranks", 4, "-o", self.folder / "out.png", code=2)
        self.assertIn("a run is on one rank", done.stderr)
        done = self.run_it("render", "phantom:sphere:16", "--machine", "proteus-32", "-o", self.folder / "out.png", code=2)
        self.assertIn("a run is on one rank", done.stderr)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_what_is_wrong_with_a_description(self):
        for words, message in (("describe:64x64x64", "expected describe:"), ("describe:64:u8", "is no size"),
                               ("describe:64x64x64:u9", "u9"), ("describe:0x64x64:u8", "0"),
                               ("describe:64x64x64:c64", "no order"), ("describe:64x64x64:u8:color=1", "none of"),
                               ("describe:64x64x64:u8:occupied=2", "occupied"),
                               ("describe:64x64x64:u8:spacing=1,2", "spacing takes")):
            self.assertIn(message, self.run_it("plan", "warp", words, code=2).stderr, words)

    def test_one_rank_plans_as_before(self):
        plain = self.report("plan", "warp", "describe:64x64x64:u8", "--rotate", "10,20,30")
        one = self.report("plan", "warp", "describe:64x64x64:u8", "--rotate", "10,20,30", "--ranks", 1)
        self.assertEqual(plain["plan"]["steps"], one["plan"]["steps"])
        self.assertNotIn("net.spread", [s["transition"] for s in plain["plan"]["steps"]])
        self.assertTrue(all(s["work"]["congested"] == 0 and s["work"]["messages"] == 0
                            for s in plain["plan"]["steps"]))


if __name__ == "__main__":
    unittest.main()
