"""Few wrong pixels carry a picture's error, and are predicted: rays that graze a black and white edge, and rays that are
shorter than the distance of screen samples."""
import json
import os
import subprocess
import tempfile
import unittest

EDGEWISE = os.environ["EDGEWISE"]

CUBE = ("phantom:cube:110", "--mode", "mip", "--rotate", "36,0,54", "--size", "90x90")
RINGS = ("phantom:marschner-lobb:57", "--mode", "mip", "--rotate", "33,62,-18", "--size", "90x110")

CASES = [
    *((CUBE, ("project.ray_cast/filter=zoh/step=" + step,)) for step in ("2", "1", "0.5", "0.25")),
    (CUBE, ("project.ray_cast/filter=foh/step=1",)),
    *((RINGS, ("warp.backward/filter=" + hold, "project.combine")) for hold in ("zoh", "foh", "bspline3")),
]


class FewPixels(unittest.TestCase):
    def test_their_error_is_predicted(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "XDG_CACHE_HOME": folder, "XDG_CONFIG_HOME": folder}
            for request, edges in CASES:
                with self.subTest(request=request[0], edges=edges):
                    via = [word for edge in edges for word in ("--via", edge)]
                    done = subprocess.run(
                        [EDGEWISE, "render", *request, *via, "--without", "store.crop", "--max-error", "1", "--verify=all",
                         "-o", "null:", "--json", "-", "--quiet"], capture_output=True, text=True, env=environment)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    report = json.loads(done.stdout)
                    self.assertGreaterEqual(len(report["plan"]["steps"]), len(edges))
                    measured = report["measured"]["error"]["nrmse"]
                    self.assertGreater(measured, 0.01)
                    # Upper estimates, of draws among neighbours: within a tenth below and half above.
                    self.assertGreater(report["plan"]["predicted"]["error"], 0.9 * measured)
                    self.assertLess(report["plan"]["predicted"]["error"], 1.5 * measured)


if __name__ == "__main__":
    unittest.main()
