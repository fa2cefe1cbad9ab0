"""Light from the depths of a picture: a ball, whose normals are known, and a ball in front of a wall. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import HEADLIGHT, Running, native

N, RADIUS = 40, 14.0
MATERIAL = (0.1, 0.7, 0.2, 10)


def away(n=N, middle=None):
    """Distance of samples [z, y, x] from the middle."""
    at = np.indices((n, n, n), float)
    middle = np.array([(n - 1) / 2] * 3 if middle is None else middle)
    return np.sqrt(((at - middle[:, None, None, None]) ** 2).sum(0))


class Depths(Running):
    def picture(self, volume, *words, via=("project.depth", "shade.depth")):
        files.write_nrrd(self.folder / "v.nrrd", volume.astype("<f4"))
        out = self.folder / "out.nrrd"
        self.run_it("render", self.folder / "v.nrrd", "--mode", "surface", "--isovalue", "0", "--background", "none", *HEADLIGHT, *native(words),
                    *[word for name in via for word in ("--via", name)], "-o", out)
        return files.read(out)[0].astype(float)

    def test_a_ball_is_lit_as_its_normals_say(self):
        """A distance is nearly linear between samples, so depths are right to about a hundredth of a sample."""
        for spacing in (1, 0.5):
            picture = self.picture(RADIUS - away(), "--spacing", str(spacing))
            size = picture.shape[0]
            x = (np.arange(size) - (size - 1) / 2) * spacing / RADIUS
            inside = x[None, :] ** 2 + x[:, None] ** 2
            middle = inside < 0.5
            cosine = np.sqrt(1 - inside[middle])
            ambient, diffuse, specular, exponent = MATERIAL
            expected = ambient + diffuse * cosine + specular * np.maximum(0, 2 * cosine**2 - 1) ** exponent
            got = picture[..., 0][middle]
            # Half differences of a circle's arc at 0.7 of its radius, a pixel of 1/14 wide, and depths off by 0.02 samples.
            self.assertLess(np.sqrt(((got - expected) ** 2).mean()), 0.02)
            self.assertTrue((picture[..., 3][middle] == 1).all())
            self.assertTrue((picture[..., 3][inside > 1.1] == 0).all())

    def test_depths_of_neighbours_across_an_edge_are_left_out(self):
        """A ball in front of a wall: at its rim central differences reach from one to the other."""
        wall = np.indices((N, N, N))[0] - 33.5
        volume = np.maximum(RADIUS - 4 - away(middle=[14, 19.5, 19.5]), wall)
        errors = []
        exact = self.picture(volume, via=("project.ray_cast/filter=foh/step=0.25",))
        for normals in ("adaptive", "central"):
            got = self.picture(volume, via=("project.depth/filter=foh/step=0.5", f"shade.depth/normals={normals}"))
            errors.append(np.sqrt(((got[..., 0] - exact[..., 0]) ** 2).mean()))
        self.assertLess(errors[0], 0.6 * errors[1])

    def test_bytes_do_not_depend_on_threads_and_errors_are_measured(self):
        pictures = [self.picture(RADIUS - away(), "--rotate", "20,30,5", "--depth-cue", "0.01", "--threads", threads).tobytes()
                    for threads in ("1", "2", "7")]
        self.assertEqual(pictures[0], pictures[1])
        self.assertEqual(pictures[0], pictures[2])
        words = ("render", self.folder / "v.nrrd", "--mode", "surface", "--isovalue", "0", "--via", "shade.depth", "-o", "null:")
        report = json.loads(self.run_it(*words, "--verify", "--json", "-", "--max-error", "9").stdout)
        self.assertGreater(report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"] / 2)

    def test_refusals(self):
        files.write_nrrd(self.folder / "v.nrrd", np.zeros((4, 4, 4), "<f4"))
        for words in (("--mode", "mip"), ("--mode", "surface", "--isovalue", "0.5", "--perspective", "30")):
            self.run_it("render", self.folder / "v.nrrd", *words, "--via", "shade.depth", "-o", "null:", code=3)


if __name__ == "__main__":
    unittest.main()
