"""1, 2 and 7 threads give the same bytes, by every edge that `list edges` names, also those that only --via brings. Needs EDGEWISE."""

import json
import subprocess
import unittest

import files
import numpy as np
from running import COMMAND, Running


class EveryThread(Running):
    def test_every_edge(self):
        # Wider than a tile, with samples that no grid of tiles divides, and empty at one end.
        z, y, x = np.mgrid[:26, :37, :90]
        samples = (120 + 100 * np.sin(x / 3) * np.cos(y / 4 + z / 5)).astype("u1")
        samples[:, :, :60] = 0
        source, out = self.folder / "v.nrrd", self.folder / "p.nrrd"
        files.write_nrrd(source, samples)
        edges = json.loads(self.run_it("list", "edges", "--json", "-").stdout)["edges"]
        modes = [line.split(":")[0] for line in self.run_it("list", "modes").stdout.decode().splitlines()]
        words = ["--rotate", "20,30,10", "--spacing", "1", "--max-error", "9"]
        same = set()
        to_pictures = {edge["name"] for edge in edges if any(join["to"].startswith("screen/picture") for join in edge["joins"])}
        # Whatever it takes: a mode, a grid that is not cubic, and for what makes pictures an eye or labels.
        plain = [*((mode, []) for mode in modes), (modes[0], ["--input-spacing", "1,1.3,1.1"])]
        other = [(mode, more) for more in (["--perspective", "40"], ["--labels"]) for mode in modes]
        found, leading = set(), {"screen/picture"}
        while leading != found:  # vertices that lead to a picture
            found = set(leading)
            leading |= {join["from"] for edge in edges for join in edge["joins"] if join["to"].startswith(tuple(found))}
        for edge in (edge for edge in edges if any(join["to"].startswith(tuple(found)) for join in edge["joins"])):
            for mode, more in plain + other if edge["name"] in to_pictures else plain:
                request = ["render", source, "-o", out, "--mode", mode, *words, "--via", edge["name"], *more]
                done = subprocess.run([COMMAND, *map(str, request)], capture_output=True, text=True, env=self.env)
                if done.returncode == 2 and "--isovalue" in done.stderr:
                    request += ["--isovalue", "130"]
                    done = subprocess.run([COMMAND, *map(str, request)], capture_output=True, text=True, env=self.env)
                if done.returncode == 3:
                    continue
                pictures = []
                for threads in (1, 2, 7):
                    self.run_it(*request, "--threads", threads)
                    pictures.append(out.read_bytes())
                self.assertEqual(pictures[0], pictures[1], (edge["name"], mode))
                self.assertEqual(pictures[0], pictures[2], (edge["name"], mode))
                same.add(edge["name"])
                break
        self.assertGreater(len(same & to_pictures), 0.8 * len(to_pictures), to_pictures - same)


if __name__ == "__main__":
    unittest.main()
