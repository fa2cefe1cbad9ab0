"""A request gives the same plan and the same bytes, whatever the machine does besides: on 1 thread and on 7, while it computes something
else, with what is kept of the file and without, and after somebody has looked at the plan. 100 runs and more are drawn from these."""

import hashlib
import json
import multiprocessing
import random
import shutil
import subprocess
import time
import unittest

from running import COMMAND, Running, corner_of_mr_head

REQUESTS = [["render", "--mode", mode, "--rotate", "20,30,10", "--size", "128x128", *more]
            for mode in ("mip", "xray", "composite", "shaded") for more in ([], ["--max-error", "0.02"], ["--turntable", "12"])]
REQUESTS += [["warp", "--rotate", "10,20,30"], ["warp", "--rotate", "10,20,30", "--max-error", "0.01"],
             ["filter", "--op", "convolve", "--kernel", "gauss:1.5"]]
RUNS = 105


def compute(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        sum(range(10000))


class SamePlan(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        corner_of_mr_head(cls.folder)
        cls.source = cls.folder / "mr_corner.nii"

    def setUp(self):
        self.kept = self.folder / "kept"
        self.out = self.folder / "out"
        shutil.rmtree(self.kept, ignore_errors=True)

    def made_by(self, request, threads, cache):
        """The steps of the plan, and what was written."""
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()
        ending = "%03d.nrrd" if request[0] == "render" else "a.nrrd"
        done = self.run_it(request[0], self.source, "-o", self.out / ending, *request[1:], "--threads", threads, "--json", "-", "--quiet",
                           env={**self.env, "XDG_CACHE_HOME": str(cache)})
        bytes_of_all = hashlib.sha256()
        for file in sorted(self.out.iterdir()):
            bytes_of_all.update(file.read_bytes())
        return json.dumps(json.loads(done.stdout)["plan"]["steps"], default=str), bytes_of_all.hexdigest()

    def look_at(self, request):
        subprocess.run([COMMAND, "plan", request[0], self.source, *request[1:], "--explain"], check=True, capture_output=True,
                       env={**self.env, "XDG_CACHE_HOME": str(self.kept)})

    def test_whatever_the_machine_does_besides(self):
        draw = random.Random(1)
        nothing = self.folder / "nothing"
        steps = lambda made: [(step["transition"], step.get("parameters")) for step in json.loads(made[0])]
        expected = {}
        for number, request in enumerate(REQUESTS):
            shutil.rmtree(nothing, ignore_errors=True)
            expected[number] = self.made_by(request, 2, nothing)
        for run in range(RUNS):
            number = run % len(REQUESTS)
            request = REQUESTS[number]
            threads, keeps, loaded, looked = draw.choice((1, 7)), draw.random() < 0.5, draw.random() < 0.5, draw.random() < 0.3
            if looked:
                self.look_at(request)
            shutil.rmtree(nothing, ignore_errors=True)
            busy = [multiprocessing.Process(target=compute, args=(30,)) for _ in range(3 if loaded else 0)]
            for process in busy:
                process.start()
            try:
                made = self.made_by(request, threads, self.kept if keeps or looked else nothing)
            finally:
                for process in busy:
                    process.kill()
                    process.join()
            how = (request, threads, keeps, loaded, looked)
            self.assertEqual(steps(made), steps(expected[number]), how)
            self.assertEqual(made[1], expected[number][1], how)


if __name__ == "__main__":
    unittest.main()
