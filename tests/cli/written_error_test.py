"""What an error is, from the files that are written: of small and sparse pictures, composites over a background, constants,
and volumes with samples that are not finite. The references here are worked out with numpy alone."""

import json
import unittest

import numpy

from running import Running, native


def write_nrrd(file, volume):
    volume = numpy.ascontiguousarray(volume, dtype="<f4")
    sizes = " ".join(str(n) for n in reversed(volume.shape))
    header = f"NRRD0004\ntype: float\ndimension: {volume.ndim}\nsizes: {sizes}\nendian: little\nencoding: raw\n\n"
    file.write_bytes(header.encode() + volume.tobytes())
    return file


def read_nrrd(file):
    header, data = file.read_bytes().split(b"\n\n", 1)
    sizes = next(line for line in header.decode().splitlines() if line.startswith("sizes:")).split()[1:]
    return numpy.frombuffer(data, "<f4").reshape([int(n) for n in reversed(sizes)])


def sharp_peak():
    volume = numpy.zeros((20, 60, 40), "f4")
    volume[9, 31, 17] = 1
    return volume


class WrittenError(Running):
    def report(self, *words, code=0):
        words = native(words) if words[0] == "render" else words
        return json.loads(self.run_it(*words, "--json", "-", "--quiet", code=code).stdout)

    def test_small_pictures_are_verified_whole(self):
        file = write_nrrd(self.folder / "peak.nrrd", sharp_peak())
        request = ("render", file, "-o", "null:", "--mode", "mip", "--rotate", "10,20,30", "--max-error", "0.05",
                   "--via", "project.ray_cast/filter=foh")
        some = self.report(*request, "--verify")["measured"]["error"]
        every = self.report(*request, "--verify=all")["measured"]["error"]
        self.assertEqual(some, every)
        self.assertEqual(some["low"], some["nrmse"])
        self.assertEqual(some["high"], some["nrmse"])

    def test_an_interval_that_straddles_the_budget_leaves_it_open(self):
        request = ("render", "phantom:noise:48", "--mode", "mip", "--rotate", "10,20,30", "-o", "null:", "--size", "100x100",
                   "--via", "project.ray_cast/filter=foh/step=1")
        predicted = self.report(*request, "--max-error", "1")["plan"]["predicted"]["error"]
        budget = 1.02 * predicted
        seen = set()
        for seed in range(1, 6):
            for samples in (20, "all"):
                measured = self.report(*request, "--max-error", budget, f"--verify={samples}", "--seed", seed)["measured"]
                error, kept = measured["error"], measured["kept"]
                self.assertIs(kept, True if error["high"] <= budget else False if error["low"] > budget else None, measured)
                seen.add((samples, kept))
                if samples == 20:
                    self.assertEqual(error["samples"], 20)
                    self.assertLess(error["low"], error["nrmse"])
                    self.assertLess(error["nrmse"], error["high"])
        self.assertIn((20, None), seen)
        self.assertIn(("all", True), seen)

    def test_a_composite_counts_its_colours_over_the_background(self):
        rng = numpy.random.default_rng(4)
        volume = rng.random((12, 20, 24)).astype("f4")
        file = write_nrrd(self.folder / "random.nrrd", volume)
        points = [(0.0, 0.0, (0.2, 0.0, 0.0)), (1.0, 0.4, (1.0, 0.5, 0.1))]
        transfer = self.folder / "transfer.json"
        transfer.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": c} for v, a, c in points], "unit": 1.0}))
        background = (0.0, 0.25, 1.0)

        def picture(values, length):  # [steps, y, x] along the rays
            light, left = numpy.zeros(values.shape[1:] + (3,)), numpy.ones(values.shape[1:])
            for value in values:
                kept = (1 - 0.4 * value) ** length
                colour = numpy.stack([0.2 + 0.8 * value, 0.5 * value, 0.1 * value], -1)
                light += (left * (1 - kept))[..., None] * colour
                left = left * kept
            return light + left[..., None] * numpy.array(background)

        middles = (numpy.arange(12 * 8) + 0.5) / 8 - 0.5
        low = numpy.clip(numpy.floor(middles), 0, 10).astype(int)
        f = numpy.clip(middles - low, 0, 1)[:, None, None]
        linear = (1 - f) * volume[low].astype("f8") + f * volume[low + 1]
        expected = picture(linear, 1 / 8)
        out = self.folder / "out.nrrd"
        report = self.report("render", file, "-o", out, "--mode", "composite", "--view", "z", "--transfer", transfer,
                             "--background", ",".join(map(str, background)), "--reference", "linear", "--max-error", "1",
                             "--via", "project.ray_cast/filter=zoh/step=2", "--verify")
        got = read_nrrd(out)
        self.assertEqual(got.shape, expected.shape)
        span = expected.max() - expected.min()
        error = numpy.sqrt(((got - expected) ** 2).mean()) / span
        measured = report["measured"]["error"]
        self.assertAlmostEqual(measured["range"], span, delta=1e-5)
        self.assertAlmostEqual(measured["nrmse"], error, delta=1e-5 + 1e-4 * error)
        # All pixels were drawn: the prediction is the error and its reserve.
        predicted = report["plan"]["predicted"]["error"]
        self.assertGreater(predicted, 0.98 * error)
        self.assertLess(predicted, 1.5 * error)

    def test_a_constant_has_its_magnitude_for_a_range(self):
        for value in (0.1, -1000.25, 0.0, 1e-20, 3e7):
            file = write_nrrd(self.folder / "constant.nrrd", numpy.full((9, 11, 13), value))
            for words in (("render", "--mode", "mean", "--rotate", "10,20,30"), ("render", "--mode", "mip", "--rotate", "10,20,30"),
                          ("render", "--mode", "composite", "--rotate", "10,20,30"), ("warp", ),
                          ("warp", "--translate", "0.3,0.2,0.1", "--size", "6x6x6"),
                          ("render", "--mode", "composite", "--rotate", "10,20,30", "--via", "project.ray_cast/filter=bspline3"),
                          ("render", "--mode", "mean", "--via", "project.ray_cast/filter=bspline3")):
                with self.subTest(value=value, words=words):
                    report = self.report(words[0], file, "-o", "null:", *words[1:], "--max-error", "0.01", "--verify")
                    self.assertLess(report["plan"]["predicted"]["error"], 1e-3)
                    self.assertLess(report["measured"]["error"]["nrmse"], 1e-4)
                    if words[-1] != "composite" and "bspline3" not in words[-1] and "composite" not in words:
                        self.assertAlmostEqual(report["measured"]["error"]["range"], abs(value) or 1, delta=1e-3 * abs(value))

    def test_rays_lose_only_the_sample_that_is_not_finite(self):
        ones = numpy.ones((9, 9, 9), "f4")
        ones[4, 4, 4] = numpy.nan
        file = write_nrrd(self.folder / "hole.nrrd", ones)
        expected = numpy.full((9, 9), 9.0)
        expected[4, 4] = 8
        for edge in ("project.ray_cast/filter=foh/step=1", "project.ray_cast/filter=zoh/step=1", "project.shear_warp/filter=zoh"):
            for view in ("x", "y", "z"):
                with self.subTest(edge=edge, view=view):
                    out = self.folder / "out.nrrd"
                    report = self.report("render", file, "-o", out, "--mode", "xray", "--view", view, "--via", edge,
                                         "--max-error", "0.01", "--verify")
                    numpy.testing.assert_allclose(read_nrrd(out), expected, atol=1e-5)
                    self.assertLess(report["measured"]["error"]["nrmse"], 1e-5)
        # Turned rays too: a constant stays one beside what is missing.
        out = self.folder / "out.nrrd"
        self.report("render", file, "-o", out, "--mode", "mean", "--rotate", "20,30,10", "--via", "project.ray_cast/filter=foh/step=0.5")
        picture = read_nrrd(out)
        numpy.testing.assert_allclose(picture[picture != 0], 1, atol=1e-5)

    def test_what_is_left_out_is_in_the_prediction(self):
        rng = numpy.random.default_rng(9)
        smooth = numpy.fft.irfftn(numpy.fft.rfftn(rng.standard_normal((24, 24, 24))) *
                                  numpy.exp(-40 * sum(numpy.square(f) for f in numpy.meshgrid(
                                      numpy.fft.fftfreq(24), numpy.fft.fftfreq(24), numpy.fft.rfftfreq(24), indexing="ij"))))
        smooth = 500 + 100 * smooth / smooth.std()
        for name, gaps in (("one", 1), ("many", 200)):
            volume = smooth.astype("f4")
            volume.ravel()[rng.choice(volume.size, gaps, replace=False)] = rng.choice([numpy.nan, numpy.inf, -numpy.inf], gaps)
            file = write_nrrd(self.folder / "gaps.nrrd", volume)
            for mode in ("mip", "xray", "mean", "composite"):
                for reference in ("spline", "linear"):
                    for edge in ("project.ray_cast/filter=foh/step=1", "project.ray_cast/filter=zoh/step=1",
                                 "project.shear_warp/filter=zoh"):
                        with self.subTest(gaps=name, mode=mode, edge=edge, reference=reference):
                            report = self.report("render", file, "-o", "null:", "--mode", mode, "--rotate", "20,30,10", "--via", edge,
                                                 "--max-error", "9", "--verify=all", "--reference", reference)
                            error = report["measured"]["error"]["nrmse"]
                            predicted = report["plan"]["predicted"]["error"]
                            self.assertGreater(predicted, 0.95 * error)
                            self.assertLess(predicted, 2 * error + 1e-3)

    def test_what_would_spread_is_refused(self):
        volume = numpy.ones((9, 9, 9), "f4")
        volume[4, 4, 4] = numpy.inf
        file = write_nrrd(self.folder / "hole.nrrd", volume)
        for edges in (("project.shear_warp/filter=foh",), ("warp.backward/filter=foh", "project.combine"), ("spectrum.slice",),
                      ("project.ray_cast/filter=bspline3",)):
            with self.subTest(edges=edges):
                words = [word for edge in edges for word in ("--via", edge)]
                done = self.run_it("render", file, "-o", "null:", "--mode", "xray", "--rotate", "20,30,10", *words, code=3)
                self.assertIn(b"not finite", done.stderr)

    def test_nothing_finite_is_no_failure(self):
        file = write_nrrd(self.folder / "nothing.nrrd", numpy.full((6, 7, 8), numpy.nan))
        for words in (("render", "--mode", "mip"), ("render", "--mode", "xray", "--rotate", "10,20,30"), ("render", "--mode", "mean"),
                      ("render", "--mode", "composite"), ("warp", "--rotate", "0,0,30")):
            with self.subTest(words=words):
                done = self.run_it(words[0], file, "-o", "null:", *words[1:], "--verify")
                self.assertIn(b"336 values are not finite", done.stderr)


if __name__ == "__main__":
    unittest.main()
