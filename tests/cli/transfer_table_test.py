"""Opacities and colours by value and gradient, against closed forms. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from levels_test import premultiplied
from running import Running, native

CAST = ("--via", "project.ray_cast/filter=foh/step=1", "--max-error", "9", "--background", "none", "--mode", "composite")
VALUES, GRADIENTS = [0, 40, 120], [0, 5, 20]
OPACITY = [[0, 0.1, 0.05], [0.1, 0.6, 0.3], [0.4, 0.2, 0.9]]


def bilinear(table, value, gradient):
    """By columns first, then along the rest."""
    column = [np.interp(value, VALUES, row) for row in np.asarray(table, float)]
    return np.interp(gradient, GRADIENTS, column)


class Tables(Running):
    def transfer(self, name="t.json", **keys):
        file = self.folder / name
        file.write_text(json.dumps(keys))
        return file

    def render(self, source, *words):
        self.run_it("render", source, "-o", self.folder / "p.nrrd", "--quiet", *native(words))
        return premultiplied(files.read(self.folder / "p.nrrd")[0].astype(float))

    def ball(self, n=30):
        z, y, x = np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij")
        file = self.folder / "ball.nrrd"
        files.write_nrrd(file, (100 / (1 + np.exp(12 * (np.sqrt(x * x + y * y + z * z) - 0.6)))).astype("<f4"))
        return file

    def test_a_ramp_has_the_opacity_of_its_value_and_slope(self):
        slope, n = 6.0, 14
        x = np.broadcast_to(slope * np.arange(20, dtype="<f4"), (n, 8, 20)).copy()
        files.write_nrrd(self.folder / "v.nrrd", x)
        color = [[[0, 0.5, 1], [1, 0.5, 0], [0.2, 0.2, 0.2]], [[0, 1, 0], [0.5, 0.5, 0.5], [1, 0, 0]], [[1, 1, 1], [0, 0, 1], [0.3, 0.6, 0.9]]]
        table = {"values": VALUES, "gradients": GRADIENTS, "opacity": OPACITY, "color": color}
        transfer = self.transfer(table=table, unit=1)
        for words, gradient, length in (((), slope, n), (("--input-spacing", "3,1,1"), slope / 3, n), (("--input-spacing", "1,1,2"), slope, 2 * n),
                                        (("--input-spacing", "0.1,1,1"), slope * 10, n)):
            picture = self.render(self.folder / "v.nrrd", *words, "--size", "20x8", "--spacing", words[1].split(",")[0] + ",1" if words else "1",
                                  "--transfer", transfer, *CAST)
            for i in range(1, 19):
                opacity = 1 - (1 - bilinear(OPACITY, slope * i, gradient)) ** length
                want = [opacity * bilinear(np.array(color)[..., c], slope * i, gradient) for c in range(3)] + [opacity]
                np.testing.assert_allclose(picture[4, i], want, rtol=2e-3, atol=1e-5, err_msg=str((words, i)))

    def test_colours_are_those_of_the_points_or_white(self):
        files.write_nrrd(self.folder / "v.nrrd", np.broadcast_to(6 * np.arange(20, dtype="<f4"), (4, 8, 20)).copy())
        table = {"values": VALUES, "gradients": GRADIENTS, "opacity": OPACITY}
        white = self.render(self.folder / "v.nrrd", "--transfer", self.transfer(table=table, unit=1), *CAST)
        for c in range(3):
            np.testing.assert_allclose(white[..., c], white[..., 3], rtol=1e-5, atol=1e-6)
        points = [{"value": 30, "opacity": 0.7, "color": [1, 0, 0.5]}, {"value": 90, "opacity": 0, "color": [0, 1, 0.5]}]
        colored = self.render(self.folder / "v.nrrd", "--transfer", self.transfer(table=table, points=points, unit=1), *CAST)
        np.testing.assert_allclose(colored[..., 3], white[..., 3], rtol=1e-5)
        for i in range(1, 19):
            red = np.interp(6 * i, [30, 90], [1, 0])
            np.testing.assert_allclose(colored[4, i] / colored[4, i, 3], [red, 1 - red, 0.5, 1], rtol=1e-4, atol=1e-5)

    def test_a_table_of_one_gradient_is_a_transfer_function(self):
        source = self.ball()
        points = [{"value": v, "opacity": o, "color": [1, o, 0.5]} for v, o in ((10, 0), (40, 0.3), (80, 0.05))]
        table = {"values": [10, 40, 80], "gradients": [0], "opacity": [[0, 0.3, 0.05]]}
        plain = self.transfer("p.json", points=points, unit=1)
        tabled = self.transfer("t.json", points=points, table=table, unit=1)
        for words in (("--rotate", "20,30,0"), ("--rotate", "20,30,0", "--shade", "phong"), ("--perspective", "40"),
                      ("--depth-cue", "0.02")):
            a, b = (self.render(source, *words, "--transfer", transfer, *CAST) for transfer in (plain, tabled))
            self.assertGreater(a[..., 3].max(), 0.5)
            # Rounding of f32, over rays of some 50 samples.
            np.testing.assert_allclose(a, b, atol=2e-5)

    def test_a_gradient_is_a_table_of_products(self):
        source = self.ball()
        magnitudes, factors, values, opacities = [3, 12], [0, 1], [0, 80], [0, 0.4]
        edges = self.transfer("e.json", points=[{"value": v, "opacity": o, "color": [1, 1, 1]} for v, o in zip(values, opacities)], unit=1,
                              gradient=[{"magnitude": m, "opacity": o} for m, o in zip(magnitudes, factors)])
        table = {"values": values, "gradients": magnitudes, "opacity": np.outer(factors, opacities).tolist()}
        a, b = (self.render(source, "--rotate", "20,30,0", "--transfer", transfer, *CAST)
                for transfer in (edges, self.transfer("t.json", table=table, unit=1)))
        self.assertGreater(a[..., 3].max(), 0.5)
        np.testing.assert_allclose(a, b, atol=2e-5)

    def test_predicted_errors_hold(self):
        source = self.ball()
        table = {"values": [0, 20, 50, 80, 100], "gradients": [0, 4, 16], "opacity": [[0, 0, 0, 0, 0], [0, 0.05, 0.2, 0.1, 0], [0, 0.3, 0.5, 0.3, 0]]}
        transfer = self.transfer(table=table)
        for words in ((), ("--shade", "phong"), ("--perspective", "40"), ("--clip-ball", "14,15,16,10"), ("--reference", "linear")):
            done = self.run_it("render", source, "-o", "null:", "--mode", "composite", "--transfer", transfer, "--rotate", "20,30,0", *words,
                               "--size", "160x140", "--max-error", "0.05", "--verify=all", "--json", "-")
            report = json.loads(done.stdout)
            self.assertLessEqual(report["measured"]["error"]["nrmse"], 1.1 * report["plan"]["predicted"]["error"] + 1e-6, words)
            self.assertLess(report["measured"]["error"]["nrmse"], 0.05, words)

    def test_gradients_beside_the_samples(self):
        source = self.ball()
        transfer = self.transfer(table={"values": VALUES, "gradients": GRADIENTS, "opacity": OPACITY})
        words = ("--rotate", "20,30,0", "--transfer", transfer, "--mode", "composite", "--background", "none", "--max-error", "9")
        own = self.render(source, *words, "--via", "project.ray_cast/filter=foh/step=1")
        beside = self.render(source, *words, "--via", "shade.gradient", "--via", "project.gradient_cast/filter=foh/step=1")
        # Gradients of 16 bits.
        np.testing.assert_allclose(own, beside, atol=2e-3)

    def test_shares_of_the_window_and_the_range(self):
        files.write_nrrd(self.folder / "v.nrrd", np.broadcast_to(6 * np.arange(20, dtype="<f4"), (4, 8, 20)).copy())
        high = 6 * 19
        shares = {"values": [0, 0.5, 1], "gradients": [0, 0.1], "opacity": [[0, 0, 0], [0, 0.5, 0.25]]}
        values = {"values": [0, high / 2, high], "gradients": [0, high / 10], "opacity": shares["opacity"]}
        a, b = (self.render(self.folder / "v.nrrd", "--transfer", transfer, *CAST) for transfer in
                (self.transfer("a.json", table=shares, values="range", unit=1), self.transfer("b.json", table=values, unit=1)))
        self.assertGreater(a[..., 3].max(), 0.5)
        np.testing.assert_allclose(a, b, atol=1e-6)

    def test_constant_one_voxel_and_absent_samples(self):
        table = {"values": [0, 5], "gradients": [0, 1], "opacity": [[0.2, 0.2], [0.9, 0.9]]}
        transfer = self.transfer(table=table, unit=1)
        for shape in ((1, 1, 1), (1, 8, 8), (9, 1, 4), (6, 6, 6)):
            files.write_nrrd(self.folder / "c.nrrd", np.full(shape, 3, "<f4"))
            picture = self.render(self.folder / "c.nrrd", "--transfer", transfer, *CAST)
            middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
            self.assertAlmostEqual(middle[3], 1 - 0.8 ** shape[0], 5, shape)
        holes = np.full((6, 6, 6), 3, "<f4")
        holes[2:4, 2:4, 2:4] = np.nan
        holes[0, 0, 0] = np.inf
        files.write_nrrd(self.folder / "h.nrrd", holes)
        picture = self.render(self.folder / "h.nrrd", "--transfer", transfer, *NEAREST)
        self.assertTrue(np.isfinite(picture).all())
        self.assertAlmostEqual(picture[1, 1, 3], 1 - 0.8 ** 6, 5)
        self.assertAlmostEqual(picture[2, 2, 3], 1 - 0.8 ** 4, 5)
        one = self.transfer(table={"values": [7], "gradients": [0], "opacity": [[0.25]]}, unit=1)
        picture = self.render(self.ball(8), "--transfer", one, *CAST)
        self.assertAlmostEqual(picture[4, 4, 3], 1 - 0.75 ** 8, 5)

    def test_threads_change_no_byte(self):
        transfer = self.transfer(table={"values": VALUES, "gradients": GRADIENTS, "opacity": OPACITY})
        written = []
        for threads in (1, 2, 5):
            self.render(self.ball(), "--transfer", transfer, "--rotate", "20,30,0", "--size", "150x150", "--threads", str(threads), *CAST)
            written.append((self.folder / "p.nrrd").read_bytes())
        self.assertEqual(len(set(written)), 1)

    def test_edges_without_gradients(self):
        transfer = self.transfer(table={"values": VALUES, "gradients": GRADIENTS, "opacity": OPACITY})
        for edge in ("shear_warp", "combine", "project.preintegrated_cast", "shade.classify", "project.splat_sheets", "project.adaptive_cast"):
            done = self.run_it("render", self.ball(), "-o", "null:", "--mode", "composite", "--transfer", transfer, "--via", edge, "--max-error",
                               "9", code=3)
            self.assertTrue(any(word in done.stderr.decode() for word in ("gradient", "leaves out")), (edge, done.stderr))
        for words in (("--shadows",), ("--ambient-occlusion", "3")):
            done = self.run_it("render", self.ball(), "-o", "null:", "--mode", "composite", "--transfer", transfer, "--shade", "phong", *words,
                               code=2)
            self.assertIn("table", done.stderr.decode())

    def test_refusals(self):
        files.write_nrrd(self.folder / "v.nrrd", np.linspace(0, 1, 27).reshape(3, 3, 3).astype("<f4"))
        good = {"values": [0, 1], "gradients": [0, 2], "opacity": [[0, 0], [0, 1]]}
        point = [{"value": 0, "opacity": 0.2, "color": [1, 1, 1]}]
        for change, part in (({"values": [1, 0]}, "values[1]"), ({"values": [0, 0]}, "ascend"), ({"gradients": [-1, 2]}, "table.gradients[0]"),
                             ({"gradients": [2, 2]}, "ascend"), ({"values": []}, "table.values"), ({"values": 3}, "table.values"),
                             ({"opacity": [[0, 0]]}, "one for each gradient"), ({"opacity": [[0, 0], [0]]}, "table.opacity[1]"),
                             ({"opacity": [[0, 0], [0, 1.5]]}, "table.opacity[1][1]"), ({"opacity": [[0, None], [0, 1]]}, "table.opacity[0][1]"),
                             ({"opacity": [[0, "x"], [0, 1]]}, "table.opacity[0][1]"), ({"opacity": 4}, "no list"),
                             ({"color": [[[0, 0, 0]] * 2] * 3}, "table.color"), ({"color": [[[0, 0, 0]] * 2, [[0, 0, 2]] * 2]}, "table.color[1][0]"),
                             ({"color": [[[0, 0]] * 2] * 2}, "table.color[0][0]"), ({"colour": []}, "colour"), ({"values": list(range(5000))}, "4096")):
            transfer = self.transfer(table={**good, **change})
            error = self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--transfer", transfer, code=2)
            self.assertIn(part, error.stderr.decode(), change)
        for keys, part in (({"table": 3}, "table"), ({"table": {}}, "values"), ({"table": good, "points": point, "gradient": [{"magnitude": 0, "opacity": 1}]}, "gradient"),
                           ({"table": good, "values": "labels"}, "labels"), ({}, "points"), ({"table": good, "points": []}, "points")):
            error = self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--transfer", self.transfer(**keys), code=2)
            self.assertIn(part, error.stderr.decode(), keys)
        for text in ('{"table": {"values": [0, NaN], "gradients": [0], "opacity": [[0, 1]]}}',
                     '{"table": {"values": [0, 1e999], "gradients": [0], "opacity": [[0, 1]]}}'):
            (self.folder / "t.json").write_text(text)
            self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--transfer", self.folder / "t.json", code=2)
        wide = {"values": list(range(2000)), "gradients": list(range(600)), "opacity": [[0] * 2000] * 600}
        error = self.run_it("render", self.folder / "v.nrrd", "-o", "null:", "--mode", "composite", "--transfer", self.transfer(table=wide), code=2)
        self.assertIn("cells", error.stderr.decode())


NEAREST = ("--via", "project.ray_cast/filter=zoh/step=1", "--max-error", "9", "--background", "none", "--mode", "composite")

if __name__ == "__main__":
    unittest.main()
