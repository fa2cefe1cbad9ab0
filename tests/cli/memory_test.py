"""--max-memory is never broken: the peak of the whole process, as the system counts it, stays under every budget
that a plan is found for, and what does not fit is refused before anything is allocated."""
import os
import pathlib
import subprocess
import tempfile
import unittest

EDGEWISE = os.environ["EDGEWISE"]
HEAD = pathlib.Path(os.environ["EDGEWISE_DATA"]) / "mr_brain/MR.nii.gz"
BUDGETS = (16, 64, 96, 192, 1024)  # MiB
# Of the two that take seconds, budgets whose plans are those of a neighbour are left out.
FEWER = (16, 64, 192)
REQUESTS = (
    ("render", "--rotate", "20,30,40"),
    ("render", "--mode", "xray", "--turntable", "12"),
    ("render", "--mode", "composite", "--verify"),
    ("render", "--mode", "composite", "--size", "700x700", "--report", "{folder}/r.html"),
    ("render", "--mode", "xray", "--via", "spectrum.inverse"),
    ("render", "--rotate", "10,20,30", "--via", "warp.backward", "--via", "project.combine"),
    ("warp", "--rotate", "10,20,30"),
    ("warp", "--rotate", "10,20,30", "--via", "warp.shear"),
)


def run(*arguments):
    """Exit code and peak resident memory [MiB]."""
    process = subprocess.Popen([EDGEWISE, *map(str, arguments)], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_maxrss / 1024


class Memory(unittest.TestCase):
    def test_the_peak_stays_under_the_budget(self):
        done = refused = 0
        with tempfile.TemporaryDirectory() as folder:
            for verb, *options in REQUESTS:
                out = pathlib.Path(folder) / ("o_%d.png" if verb == "render" else "o.nrrd")
                for budget in FEWER if "composite" in options else BUDGETS:
                    with self.subTest(request=(verb, *options), budget=budget):
                        words = [word.format(folder=folder) for word in options]
                        code, peak = run(verb, HEAD, "-o", out, *words, "--max-memory",
                                         f"{budget}MiB")
                        self.assertIn(code, (0, 3))
                        self.assertLessEqual(peak, budget if code == 0 else 64)
                        done += code == 0
                        refused += code == 3
        self.assertGreater(done, 2 * len(REQUESTS))
        self.assertGreater(refused, 4)


if __name__ == "__main__":
    unittest.main()
