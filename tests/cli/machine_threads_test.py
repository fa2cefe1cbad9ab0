"""Whose threads a plan is for: those of the machine that is named, else those of this process. Needs EDGEWISE."""

import json
import os
import unittest

from running import Running

HUGE = "describe:512x512x512:u8"


class MachineThreads(Running):
    def request(self, *words, env=None):
        done = self.run_it("plan", "render", HUGE, "--mode", "xray", *words, "--json", "-", env={**self.env, **(env or {})})
        request = json.loads(done.stdout)["request"]
        return request["threads"], request["threads_of"], request["ranks"]

    def machine(self, **fields):
        known = json.loads(self.run_it("list", "machines", "--json", "-").stdout)["machines"]
        profile = {key: value for key, value in next(m for m in known if m["name"] == "default").items()
                   if key not in ("file", "provenance", "spreads", "levels", "messages")}
        path = self.folder / "machine.json"
        path.write_text(json.dumps({"schema": 1, **profile, "name": "mine", **fields}))
        return path

    def test_one_rank_and_two_of_a_cluster_have_the_same_threads(self):
        for ranks in (1, 2, 64):
            self.assertEqual(self.request("--machine", "cluster", "--ranks", ranks), (16, "machine", ranks))
        self.assertEqual(self.request("--machine", "proteus-32", "--ranks", 1), (4, "machine", 1))
        self.assertEqual(self.request("--machine", "maspar-mp1-16k", "--ranks", 1), (1, "machine", 1))

    def test_threads_that_are_typed_win(self):
        for ranks in (1, 2):
            self.assertEqual(self.request("--machine", "cluster", "--ranks", ranks, "--threads", 3), (3, "option", ranks))
            self.assertEqual(self.request("--machine", "cluster", "--ranks", ranks, env={"EDGEWISE_THREADS": "5"}), (5, "option", ranks))

    def test_without_a_machine_they_are_this_process_s(self):
        cores = len(os.sched_getaffinity(0))
        threads, whose, ranks = self.request()
        self.assertEqual((whose, ranks), ("process", 1))
        self.assertLessEqual(threads, cores)

    def test_machines_of_files_count_as_others_where_their_processors_are(self):
        other = self.machine(cpu="Some other processor", processors=7)
        self.assertEqual(self.request("--machine", other)[:2], (7, "machine"))
        cpu = next((line.split(": ", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "")
        if cpu:
            self.assertEqual(self.request("--machine", self.machine(cpu=cpu, processors=7))[1], "process")

    def test_a_run_is_on_this_machine_and_says_that_the_profile_is_not(self):
        done = self.run_it("render", "phantom:sphere:16", "-o", "null:", "--mode", "xray", "--machine", "cluster", "--ranks", 1, "--json", "-")
        report = json.loads(done.stdout)
        self.assertEqual(report["request"]["threads_of"], "process")
        self.assertTrue(any("cluster" in w and "another machine" in w for w in report["warnings"]), report["warnings"])

    def test_the_explanation_says_whose(self):
        for words, said in ((("--machine", "cluster", "--ranks", "1"), "16 threads (the machine's)"),
                            (("--machine", "cluster", "--ranks", "2"), "16 threads on each of 2 ranks (the machine's)"),
                            (("--machine", "cluster", "--ranks", "2", "--threads", "1"), "1 thread on each of 2 ranks (--threads)"),
                            ((), "(of this process)")):
            self.assertIn(said, self.run_it("plan", "render", HUGE, "--mode", "xray", *words).stdout.decode())


if __name__ == "__main__":
    unittest.main()
