"""Where projections fail: opacity and step, energy, end of rays, skipping, boxes, lattices."""

import json

import numpy as np
from driving import Driven, main, read_nrrd, rms, turn3, via, write_nrrd

TERMINATED = 1 / 4096  # rays of a composite end where less than this transparency is left


class Rays(Driven):
    def transfer(self, points, unit=1.0):
        """File of a transfer function of (value, opacity, grey or colour)."""
        file = self.folder / "transfer.json"
        listed = [{"value": float(v), "opacity": float(a),
                   "color": [float(c)] * 3 if np.isscalar(c) else list(map(float, c))}
                  for v, a, c in points]
        file.write_text(json.dumps({"points": listed, "unit": unit}))
        return ["--mode", "composite", "--transfer", file]

    def cast(self, samples, words, step=1, filter_="foh", **more):
        return self.render(samples, *words,
                           *via(f"project.ray_cast/filter={filter_}/step={step}"), **more)


def composited(values, points, step=1.0):
    """Front-to-back compositing of [depth, ...] values in f64, white or grey, without an end."""
    at = np.array([p[0] for p in points])
    opacity = np.interp(values, at, [p[1] for p in points])
    color = np.interp(values, at, [p[2] for p in points])
    left, light = np.ones(values.shape[1:]), np.zeros(values.shape[1:])
    for a, c in zip(opacity, color):
        t = (1 - a) ** step
        light += left * (1 - t) * c
        left *= t
    return light


class Opacity(Rays):
    def test_S21_opacity_does_not_depend_on_the_step(self):
        """Eight voxels of one medium; uncorrected, .64 at step 1 becomes .9997 at step 1/8. Five
        media stand beside each other, three columns each, and rays go through centres."""
        opacities = (1e-7, 1e-4, 0.01, 0.12, 0.5)
        samples = np.tile(np.repeat(np.arange(5, dtype="f4"), 3), (8, 3, 1))
        words = self.transfer([(i, opacity, 1) for i, opacity in enumerate(opacities)])
        expected = -np.expm1(8 * np.log1p(-np.float64(np.float32(opacities))))
        expected = np.tile(np.repeat(expected, 3)[:, None], (3, 1, 3))
        for step in (2, 1, 0.7, 0.5, 0.25, 0.125, 0.0625):
            made = self.cast(samples, words, step)
            np.testing.assert_allclose(made, expected, atol=1e-6, rtol=1e-5, err_msg=str(step))
        # A medium alone, where all samples are alike.
        words = self.transfer([(0, 0.12, 1), (1, 0.12, 1)])
        for step in (2, 0.25):
            made = self.cast(np.ones((8, 3, 3), "f4"), words, step)
            np.testing.assert_allclose(made, expected[:, 9:12], atol=1e-6, rtol=1e-5)

    def test_S21_tiny_and_full_opacities_keep_their_digits(self):
        """log1p and expm1: 1 - (1 - a)^h of a = 1e-7 would be 0 or 1.2e-7 in f32."""
        samples = np.ones((64, 2, 2), "f4")
        for opacity, step in ((1e-7, 0.25), (3e-8, 1), (1e-6, 0.1)):
            made = self.cast(samples, self.transfer([(0, opacity, 1)]), step)
            expected = -np.expm1(64 * np.log1p(-opacity))
            # A sum of 64 / step products, each rounded to f32 of what is left, 1.
            np.testing.assert_allclose(made, expected, rtol=0.02, err_msg=f"{opacity} {step}")
        for opacity in (1, 1 - 2 ** -24):
            for step in (1, 0.5, 0.1):
                made = self.cast(samples, self.transfer([(0, opacity, 1)]), step)
                np.testing.assert_allclose(made, 1, atol=TERMINATED)
        self.assertTrue(np.all(self.cast(samples, self.transfer([(0, 0, 1)]), 0.5) == 0))

    def test_S21_unit_of_opacity(self):
        samples = np.ones((8, 2, 2), "f4")
        for unit in (0.5, 1, 4):
            made = self.cast(samples, self.transfer([(0, 0.2, 1)], unit), spacing=(1, 1, 0.5))
            self.assertAlmostEqual(float(made.flat[0]), 1 - 0.8 ** (4 / unit), delta=1e-6)

    def test_S22_a_medium_makes_no_light(self):
        """I = 1 everywhere gives 1 - exp(-tau); emission and absorption of two kinds give more
        than 1 (EQ 60 and 61: 1.58 at alpha = 1)."""
        samples = np.ones((16, 2, 2), "f4")
        for tau in (0.01, 0.1, 0.5, 1, 2, 5, 20):
            opacity = -np.expm1(-tau / 16)
            for edge in (*(f"project.ray_cast/filter=foh/step={step}" for step in (1, 0.5, 0.3)),
                         "project.combine", "project.shear_warp/filter=foh"):
                made = self.render(samples, *self.transfer([(0, opacity, 1)]), *via(edge))
                self.assertLessEqual(made.max(), 1, edge)
                end = TERMINATED if np.exp(-tau) < TERMINATED else 0
                np.testing.assert_allclose(made, -np.expm1(-tau), atol=1e-6 + end)

    def test_S16_opacity_and_light_stay_in_0_to_1_beside_negative_lobes(self):
        """A spline overshoots at a step; a transfer function is constant beyond its ends. An opaque
        one shows what a ray meets first: there is nothing before it that would hide an excess."""
        samples = np.zeros((12, 12, 12), "f4")
        samples[:, 4:8, 4:8] = 1
        for points in ([(0, 0, 0), (1, 1, 1)], [(0, 1, 0), (1, 1, 1)]):
            for angles in ("0,0,0", "20,30,40"):
                made = self.cast(samples, [*self.transfer(points), "--rotate", angles], 0.5,
                                 "bspline3")
                self.assertTrue(made.min() >= 0 and made.max() <= 1)

    def test_S23_order_of_the_quadrature(self):
        """A smooth hump in opacity and colour, against 1000 cells a voxel in f64. Transparency of a
        hump converges faster than any order; light is made and lost within one cell as if it were
        one medium, which leaves order 2 (Riemann's sum, or no attenuation within it: 1)."""
        depth, fine = 48, 48000
        hump = np.exp(-((np.arange(depth) - 20) / 2) ** 2).astype("<f4")
        samples = np.tile(hump[:, None, None], (1, 2, 2))
        points = [(0, 0, 0), (1, 0.8, 1)]
        at = (np.arange(fine) + 0.5) / fine * depth - 0.5
        values = np.interp(at, np.arange(depth), hump.astype("f8"))
        truth = composited(values[:, None], points, depth / fine)[0]
        words = self.transfer(points)
        # A step of 1 would meet nothing but the samples themselves.
        errors = [abs(float(self.cast(samples, words, step).flat[0]) - truth)
                  for step in (0.5, 0.25, 0.125)]
        slopes = np.log2(np.array(errors[:-1]) / errors[1:])
        self.assertLess(np.abs(slopes - 2).max(), 0.2, (errors, slopes))

    def test_S23_closed_forms(self):
        """Opacity that climbs linearly: the integral of log(1 - opacity) is known."""
        depth = 16
        samples = np.tile(np.linspace(0, 1, depth, dtype="f4")[:, None, None], (1, 2, 2))
        low, high = 0.05, 0.3
        form = np.vectorize(lambda a: -(1 - a) * np.log1p(-a) - a)  # its derivative is log(1 - a)
        inside = (depth - 1) * (form(high) - form(low)) / (high - low)
        inside += 0.5 * np.log1p(-low) + 0.5 * np.log1p(-high)  # half a voxel beyond either end
        words = self.transfer([(0, low, 1), (1, high, 1)])
        for step, most in ((2, 1e-3), (1, 3e-4), (0.25, 2e-5)):
            made = float(self.cast(samples, words, step).flat[0])
            self.assertAlmostEqual(made, -np.expm1(inside), delta=most)

    def test_S24_thin_transfer_functions_are_seen_coming(self):
        """A peak thinner than a step is missed by some rays (there is no pre-integrating edge): the
        prediction knows, and the plan within the budget has a smaller step or says so."""
        shape = (24, 24, 24)
        z, y, x = np.indices(shape)
        samples = ((x + 2 * y + 20 * z) / 520).astype("<f4")
        write_nrrd(self.folder / "ramp.nrrd", samples)
        wide = [(0.2, 0, 1), (0.5, 0.3, 1), (0.8, 0, 1)]
        thin = [(0.5 - 0.008, 0, 1), (0.5, 0.9, 1), (0.5 + 0.008, 0, 1)]
        predicted = {}
        for name, points in (("wide", wide), ("thin", thin)):
            report = self.report("plan", "render", self.folder / "ramp.nrrd",
                                 *self.transfer(points), "--reference", "linear", "--range", "1",
                                 "--max-error", "9", *via("project.ray_cast/filter=foh/step=1"))
            predicted[name] = report["plan"]["predicted"]["error"]
        self.assertGreater(predicted["thin"], 5 * predicted["wide"])
        done = self.run_it("render", self.folder / "ramp.nrrd", "-o", "null:", *self.transfer(thin),
                           "--reference", "linear", "--range", "1", "--verify=all", "--max-error", "0.03",
                           "--json", "-", "--quiet", code=None)
        report = json.loads(done.stdout)
        if done.returncode == 0:
            measured = report["measured"]["error"]["nrmse"]
            self.assertLessEqual(measured, report["plan"]["predicted"]["error"])
            self.assertLessEqual(measured, 0.03)
        else:  # it says that none keeps it, and what comes nearest
            self.assertEqual(done.returncode, 3)
            nearest = report["error"]["nearest"]
            self.assertTrue(nearest)
            for plan in nearest:
                self.assertGreater(plan["predicted"]["error"], 0.03)
        coarse = self.report("render", self.folder / "ramp.nrrd", "-o", "null:",
                             *self.transfer(thin), "--reference", "linear", "--range", "1",
                             "--verify=all", "--max-error", "9",
                             *via("project.ray_cast/filter=foh/step=1"))
        self.assertGreater(coarse["measured"]["error"]["nrmse"], 0.03)


class Ends(Rays):
    POINTS = [(0, 0, 0.3), (0.35, 0.02, 0.4), (1, 0.5, 1)]

    def test_S25_early_termination_keeps_its_bound(self):
        """Against compositing to the end in f64: a ray misses at most what is left of it, 1/4096 of
        the brightest light, less than half a step of 8 bits."""
        samples = np.random.default_rng(1).random((80, 40, 41), "f4")
        samples[:, :20] *= 0.4  # long rays beside short ones
        for points in (self.POINTS, [(0, 0.3, 1), (1, 1, 0)], [(0, 0.001, 0), (1, 0.01, 1)]):
            full = composited(samples.astype("f8"), points)
            made = self.cast(samples, self.transfer(points))[..., 0]
            missed = full - made
            self.assertLessEqual(missed.max(), TERMINATED + 1e-5)
            self.assertGreaterEqual(missed.min(), -1e-5)
        self.assertLess(TERMINATED, 1 / 510)

    def test_S29_over_of_512_layers(self):
        """Rounding of f32, front to back or as a tree of parts: 2e-6 over 512 samples."""
        samples = np.random.default_rng(2).random((512, 4, 5), "f4")
        points = [(0, 0, 0.1), (1, 0.02, 1)]
        full = composited(samples.astype("f8"), points)
        for edge in ("project.ray_cast/filter=foh/step=1", "project.combine",
                     "project.shear_warp/filter=zoh", "project.shear_warp/filter=foh"):
            for threads in (1, 7):
                made = self.render(samples, *self.transfer(points), "--threads", threads,
                                   *via(edge))
                self.assertLessEqual(np.abs(made[..., 0] - full).max(), 4e-6, edge)

    def test_S30_layers_that_are_empty_full_or_few(self):
        """Any number of layers, opaque in front, behind, between, nowhere, beside each other."""
        for depth in (1, 2, 3, 5, 7, 31, 64, 65):
            samples = np.zeros((depth, 3, 16), "f4")
            samples[depth // 3] = 0.25
            for i, full in enumerate((0, depth // 2, depth - 1)):
                samples[full, :, 4 * i:4 * i + 4] = 1
            points = [(0, 0, 0.5), (0.25, 0.3, 0.2), (1, 1, 0.8)]
            expected = composited(samples.astype("f8"), points)
            for edge in ("project.combine", "project.ray_cast/filter=foh/step=1"):
                made = self.render(samples, *self.transfer(points), *via(edge))
                np.testing.assert_allclose(made[..., 0], expected, atol=TERMINATED, err_msg=f"{depth} {edge}")

    def test_S29_S28_threads_change_no_byte(self):
        """A picture so large that other threads have come before it is done."""
        samples = np.random.default_rng(3).random((33, 40, 41), "f4")
        for edge in ("project.combine", "project.ray_cast/filter=foh/step=0.5",
                     "project.shear_warp/filter=foh"):
            made = [self.render(samples, *self.transfer(self.POINTS), "--rotate", "10,20,30",
                                "--spacing", "0.125", "--threads", threads, *via(edge)).tobytes()
                    for threads in (1, 2, 5, 16)]
            self.assertEqual(len(set(made)), 1, edge)


class Skipping(Rays):
    # Bricks are made where rays read more samples than there are voxels: three pixels a voxel, of
    # which the middle one looks at the voxel's centre.
    FINE = ["--spacing", repr(1 / 3)]

    def cast_fine(self, samples, words):
        height, width = samples.shape[1:]
        size = ["--size", f"{3 * width}x{3 * height}"]
        return self.cast(samples, [*words, *self.FINE, *size])[1::3, 1::3]

    def sparse(self):
        """A large empty volume with lone samples and small blocks, some at the faces of bricks."""
        random = np.random.default_rng(4)
        samples = np.zeros((64, 64, 64), "f4")
        for _ in range(40):
            at = random.integers(0, 59, 3)
            size = random.integers(1, 5, 3)
            samples[tuple(slice(a, a + s) for a, s in zip(at, size))] = random.random()
        samples[3, 3, 3] = samples[4, 4, 4] = samples[7, 8, 63] = 1
        return samples

    def test_S26_skipping_changes_nothing(self):
        """What is empty may be left out only where opacity is exactly 0: the same function with an
        opacity of 1e-12 there forbids it and must give the same picture."""
        samples = self.sparse()
        for angles in ("0,0,0", "13,-27,41"):
            for peak in ((0.3, 0.5), (0.49, 0.51)):
                middle = sum(peak) / 2
                made = []
                for least in (0, 1e-12):
                    points = [(0, least, 1), (peak[0], least, 1), (middle, 0.9, 1),
                              (peak[1], least, 1), (1, least, 1)]
                    made.append(self.cast(samples, [*self.transfer(points), *self.FINE, "--rotate",
                                                    angles]))
                np.testing.assert_allclose(made[0], made[1], atol=2e-7)
                self.assertGreater(made[0].max(), 0.01)

    def test_S26_narrow_peak_between_the_ends_of_a_brick(self):
        """Every brick holds 0 and 1, the peak lies between: levels of its ends would skip it."""
        samples = np.zeros((64, 64, 64), "f4")
        samples[::4, ::4, ::4] = 1
        samples[1::4, 2::4, 3::4] = 0.5
        points = [(0, 0, 1), (0.45, 0, 1), (0.5, 0.7, 1), (0.55, 0, 1), (1, 0, 1)]
        expected = composited(samples.astype("f8"), points)
        made = self.cast_fine(samples, self.transfer(points))[..., 0]
        np.testing.assert_allclose(made, expected, atol=TERMINATED + 1e-5)
        self.assertGreater(expected.max(), 0.9)

    def test_S26_peak_between_two_bricks_of_one_value_each(self):
        """No brick holds anything but 0 or anything but 1, and all that is opaque lies between."""
        samples = np.zeros((64, 64, 64), "f4")
        samples[:, :, 32:] = 1
        made = []
        for least in (0, 1e-12):
            points = [(0, least, 1), (0.45, least, 1), (0.5, 0.7, 1), (0.55, least, 1), (1, least, 1)]
            made.append(self.cast(samples, [*self.transfer(points), *self.FINE, "--rotate", "0,80,5"]))
        np.testing.assert_allclose(made[0], made[1], atol=2e-7)
        self.assertGreater(made[0].max(), 0.1)

    def test_S26_largest_values_are_not_skipped(self):
        samples = self.sparse()
        made = self.cast(samples, [])
        np.testing.assert_allclose(made, samples.max(0), rtol=1e-6)
        made = self.cast(-samples, [])
        np.testing.assert_allclose(made, (-samples).max(0), rtol=1e-6, atol=0)

    def test_S26_S20_bricks_with_values_that_are_not_finite(self):
        """A NaN or an infinity hides no neighbour, and rays take it as outside."""
        for bad in (np.nan, np.inf, -np.inf):
            samples = np.zeros((64, 64, 64), "f4")
            samples[30, 29, 28] = 1
            samples[33, 29, 28] = samples[30, 32, 30] = bad
            finite = np.where(np.isfinite(samples), samples, 0)
            made = self.cast(samples, [])
            self.assertTrue(np.all(np.isfinite(made)))
            self.assertEqual(made[29, 28], 1)
            np.testing.assert_array_equal(made, finite.max(0))
            points = [(0, 0, 1), (1, 0.5, 1)]
            lit = self.cast_fine(samples, self.transfer(points))[..., 0]
            np.testing.assert_allclose(lit, composited(finite.astype("f8"), points), atol=1e-6)


class Boxes(Rays):
    def test_S27_rays_along_axes(self):
        """Direction components of 0 and -0 in all 24 right-angled views, rays in faces of voxels
        included: each sample once, none twice."""
        samples = np.random.default_rng(5).random((6, 7, 8)).astype("<f4")
        for x in (0, 90, 180, 270):
            for y in (0, 90, 180, 270):
                for z in (0, 90):
                    turned = np.rint(turn3(x, y, z)).astype(int)
                    order = [int(np.argmax(np.abs(row))) for row in turned]
                    signs = [int(turned[row, order[row]]) for row in range(3)]
                    laid = samples.transpose([2 - order[2], 2 - order[1], 2 - order[0]])
                    laid = laid[tuple(slice(None, None, s) for s in signs[::-1])].astype("f8")
                    words = ["--rotate", f"{x},{y},{z}", "--spacing", "1", "--size",
                             f"{laid.shape[2]}x{laid.shape[1]}"]
                    made = self.cast(samples, ["--mode", "xray", *words])
                    np.testing.assert_allclose(made, laid.sum(0), rtol=1e-5, err_msg=str(words))
                    # Rays are set up alike whatever they make of samples.
                    if (x + y) // 90 % 3 == 0:
                        made = self.cast(samples, words)
                        np.testing.assert_allclose(made, laid.max(0), rtol=1e-6)

    def chords(self, size, shape, linear):
        """Length of every pixel's ray inside the box, by slabs in f64, no component 0."""
        y, x = np.indices((size, size)) - (size - 1) / 2
        back = linear.T
        origin = np.einsum("ij,jyx->iyx", back, np.stack([x, y, np.zeros_like(x)]))
        direction = back[:, 2]
        low, high = np.full(x.shape, -np.inf), np.full(x.shape, np.inf)
        for axis in range(3):
            half = shape[2 - axis] / 2
            if abs(direction[axis]) < 1e-15:
                outside = np.abs(origin[axis]) > half
                low, high = np.where(outside, 0, low), np.where(outside, 0, high)
                continue
            a = (-half - origin[axis]) / direction[axis]
            b = (half - origin[axis]) / direction[axis]
            low, high = np.maximum(low, np.minimum(a, b)), np.minimum(high, np.maximum(a, b))
        return np.maximum(high - low, 0)

    def test_S27_grazing_rays_and_corners(self):
        """A constant integrates to the chord, whatever the step, however short the chord."""
        shape, size = (9, 10, 11), 25
        samples = np.ones(shape, "f4")
        diagonal = float(np.degrees(np.arctan(1 / np.sqrt(2))))
        for angles in ((0, 45, 0), (45, 0, 0), (diagonal, 45, 0), (1e-7, 0, 0), (0, 89.9999999, 0),
                       (10, 20, 30), (0, 0, 45)):
            expected = self.chords(size, shape, turn3(*angles))
            for step in (1, 0.37, 3):
                made = self.cast(samples, ["--mode", "xray", "--rotate",
                                           ",".join(map(repr, angles)), "--spacing", "1", "--size",
                                           f"{size}x{size}"], step)
                # In faces, edges and corners a rounding decides whether a ray meets the box.
                close = np.abs(made - expected) <= 2e-5 * (1 + expected)
                self.assertGreaterEqual(close.mean(), 0.95 if 0 in angles else 1, (angles, step))
                self.assertTrue(np.all(np.isfinite(made)) and made.min() >= 0)

    def test_S27_thin_boxes(self):
        """One voxel, one plane, one rod: every ray that meets it has a sample."""
        for shape in ((1, 1, 1), (1, 5, 6), (5, 1, 6), (5, 6, 1), (1, 1, 9)):
            samples = np.full(shape, 3, "f4")
            for angles in ((0, 0, 0), (10, 20, 30), (89, 1, 0)):
                expected = self.chords(15, shape, turn3(*angles))
                words = ["--rotate", ",".join(map(str, angles)), "--spacing", "1", "--size", "15x15"]
                # Oblique rays at either step; others where it is harder for what they make.
                for step in (1, 4) if angles == (10, 20, 30) else (1,):
                    made = self.cast(samples, ["--mode", "xray", *words], step)
                    np.testing.assert_allclose(made, 3 * expected, atol=1e-4)
                for step in (1, 4) if angles == (10, 20, 30) else (4,):
                    largest = self.cast(samples, words, step)
                    self.assertTrue(np.all(largest == 3))  # a ray that misses: the least value


class Framing(Rays):
    """What a picture shows more or less of must not change what is seen."""

    def test_a_zoom_leaves_lengths_from_an_eye_as_they_are(self):
        samples = np.ones((16, 16, 16), "f4")
        for scale in ("1,1,1", "1,1,2", "1.5,1,0.5"):
            words = ["--mode", "xray", "--perspective", "40", "--size", "9x9", "--scale", scale]
            plain = self.cast(samples, words)
            self.assertAlmostEqual(plain[4, 4], 16 * float(scale.split(",")[2]), places=3)
            # Pixel k of a picture twice as large is at the place of pixel k / 2.
            twice = self.cast(samples, [*words, "--zoom", "2"])
            np.testing.assert_allclose(twice[::2, ::2], plain[2:7, 2:7], rtol=1e-4, err_msg=scale)

    def test_what_is_cropped_away_is_still_there_for_rays(self):
        """A warp between the crop and the picture reads beyond the box that is left."""
        samples = np.full((40, 40, 40), 5, "f4")
        samples[14:20, 18:24, 20:26] = np.random.default_rng(3).uniform(5, 9, (6, 6, 6))
        for mode in (["mip"], ["xray", "--zero", "5"]):
            words = ["--mode", *mode, "--rotate", "10,20,30", "--size", "50x50"]
            made = {}
            for first in ([], ["--via", "store.crop"]):
                steps = [*first, "--via", "warp.backward/filter=foh", "--via", "project.combine"]
                without = [] if first else ["--without", "store.crop"]
                made[len(first)] = self.render(samples, *words, *steps, *without)
            self.assertGreater(np.ptp(made[0]), 1)
            np.testing.assert_allclose(made[2], made[0], atol=2e-4, err_msg=mode[0])

    def test_a_sheet_between_two_planes_of_samples_is_predicted(self):
        """One sample thick and seen from its side, it ends where samples of the screen lie: which of them count is the
        kernel's to say, and the prediction's to know."""
        source = self.folder / "sheet.nrrd"
        # Turned by some degrees, as f32 has it: so its faces lie beside those planes by its roundings.
        source.write_bytes(b"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 1 11 20\n"
                           b"space directions: (-0.07747802934914348,-0.3662948927753414,-0.08532998590691586) "
                           b"(-0.029831922404587482,-0.08086206357323296,0.374202329068547) "
                           b"(-0.3749176061134232,0.08213025143867286,-0.01214126948883184)\n"
                           b"space origin: (48.21,-36.39,-24.62)\nendian: little\nencoding: raw\n\n" + bytes([178]) * 220)
        wrong = 0
        for path in ("warp.shear/filter=foh", "warp.backward/filter=foh"):
            error = self.report("render", source, "-o", "null:", "--mode", "xray", "--view", "back", "--turntable", "4",
                                "--range", "100", "--verify=all", "--via", path, "--via", "project.combine",
                                "--max-error", "1e6")
            predicted, measured = error["plan"]["predicted"]["error"], error["measured"]["error"]["nrmse"]
            self.assertLess(measured, 1.1 * predicted + 1e-6, path)
            wrong = max(wrong, measured)
        self.assertGreater(wrong, .01, "some sheet is lost: else nothing was tested")

    def test_errors_of_a_picture_with_wide_margins_are_predicted(self):
        """Few pixels see the data, so that a preview draws them all and needs no guess."""
        samples = np.random.default_rng(5).uniform(0, 100, (8, 8, 8)).astype("f4")
        source = self.folder / "small.nrrd"
        write_nrrd(source, samples)
        for mode in ("mip", "mean"):
            error = self.report("render", source, "-o", "null:", "--mode", mode, "--rotate", "20,30,0",
                                "--size", "96x96", "--verify=all", *via("project.ray_cast/filter=foh/step=1"))
            ratio = error["plan"]["predicted"]["error"] / error["measured"]["error"]["nrmse"]
            self.assertTrue(2 / 3 < ratio < 3, f"{mode}: {ratio}")


class Lattice(Rays):
    def test_S28_samples_do_not_move_with_the_box(self):
        """A volume cut to what is occupied has the same samples at the same places along rays."""
        samples = np.zeros((40, 44, 48), "f4")
        z, y, x = np.indices((9, 10, 11))
        samples[16:25, 15:25, 20:31] = (1 + np.sin(x) + np.cos(y + z)) / 3
        samples = np.maximum(samples, 0)
        points = self.transfer([(0, 0, 0), (1, 0.4, 1)])
        for words in (["--mode", "mip"], points, ["--mode", "xray"]):
            for step in (1, 0.37):
                edge = f"project.ray_cast/filter=foh/step={step}"
                made = [self.render(samples, *words, "--rotate", "13,27,-9", *choice, "--via", edge,
                                    "--without", "store.precision")
                        for choice in (["--via", "store.crop"], ["--without", "store.crop"])]
                # Places in f32 from another corner differ by 2^-19 beside sample 48, where the
                # field climbs by up to 1 a sample; a lattice of the box's own would differ by
                # percents.
                np.testing.assert_allclose(made[0], made[1], atol=1e-5, rtol=1e-5)

    def test_S28_pieces_of_a_picture_are_its_pieces(self):
        samples = np.random.default_rng(6).random((20, 21, 22), "f4")
        words = ["--rotate", "13,27,-9", "--spacing", "1"]
        whole = self.cast(samples, [*words, "--size", "40x40"])
        for size in (8, 20, 38):
            piece = self.cast(samples, [*words, "--size", f"{size}x{size}"])
            edge = (40 - size) // 2
            np.testing.assert_array_equal(piece, whole[edge:40 - edge, edge:40 - edge])

    def test_S32_shear_warp_where_its_axis_switches(self):
        """At 45 degrees slices of another axis are sheared: the step between the pictures on either
        side is within what both promise, and no larger than a turn by that angle itself plus it."""
        z, y, x = (np.indices((33, 33, 33)) - 16) / 16
        samples = np.exp(-6 * ((x - 0.2) ** 2 + 2 * y ** 2 + (z + 0.3) ** 2)).astype("<f4")
        samples += np.exp(-9 * ((x + 0.4) ** 2 + (y - 0.3) ** 2 + z ** 2)).astype("<f4")
        write_nrrd(self.folder / "blobs.nrrd", samples)
        for mode in ("mip", "xray", "mean"):
            made, promised = [], 0
            for degrees in (44.99, 45.01):
                out = self.folder / "side.nrrd"
                report = self.report("render", self.folder / "blobs.nrrd", "-o", out, "--mode",
                                     mode, "--rotate", f"0,{degrees},0", "--spacing", "1", "--size",
                                     "49x49", *via("project.shear_warp/filter=foh"), "--max-error",
                                     "9", "--verify=100")
                made.append(read_nrrd(out))
                # Another family as the judge, which knows no axis.
                cast = self.report("render", self.folder / "blobs.nrrd", "-o", out, "--mode", mode,
                                   "--rotate", f"0,{degrees},0", "--spacing", "1", "--size",
                                   "49x49", *via("project.ray_cast/filter=foh/step=0.5"),
                                   "--verify=100")
                between = rms(made[-1] - read_nrrd(out))
                span = report["measured"]["error"]["range"]
                promise = report["plan"]["predicted"]["error"] * span
                promised += promise
                cast_promise = cast["plan"]["predicted"]["error"] * span
                self.assertLessEqual(between, 1.05 * (promise + cast_promise), (mode, degrees))
            self.assertLessEqual(rms(made[0] - made[1]), promised + 1e-3 * span, mode)
            self.assertLess(np.abs(made[0] - made[1]).max(), 0.05 * span, mode)

    def test_S32_shear_warp_refuses_an_eye(self):
        message = self.render(np.ones((8, 8, 8), "f4"), "--perspective", "30",
                              *via("project.shear_warp/filter=foh"), code=3)
        self.assertIn("finite distance", message)

    def test_S40_means_and_integrals_over_a_large_offset(self):
        """Detail of 1 on 2^19: what the samples hold must not drown in the sum."""
        detail = np.random.default_rng(7).integers(0, 16, (64, 5, 6)) / 16
        samples = (detail + 2 ** 19).astype("<f4")
        made = self.cast(samples, ["--mode", "mean"])
        # f32 itself holds 2^19 to 1/16; sums of 32 numbers round by 2^-24 each.
        np.testing.assert_allclose(made, detail.mean(0) + 2 ** 19, rtol=8 * 2 ** -24)
        np.testing.assert_array_equal(self.cast(samples, []), samples.max(0))

    def test_S40_standard_deviations_over_a_large_offset(self):
        """Detail of 1 on 2^19, by every way to the picture: squares of values would have no digit of it left."""
        detail = np.random.default_rng(7).integers(0, 16, (64, 5, 6)) / 16
        samples = (detail + 2 ** 19).astype("<f4")
        ways = (["--via", "project.ray_cast/filter=foh/step=1"], ["--via", "project.shear_warp/filter=foh"],
                ["--via", "warp.backward/filter=foh"])
        for way in ways:
            made = self.render(samples, "--mode", "stddev", *way)
            # Differences of f32 are exact here; 64 sums of squares below 1 round by 2^-24 each.
            np.testing.assert_allclose(made, detail.std(0), rtol=64 * 2 ** -24, err_msg=str(way))
        np.testing.assert_array_equal(self.cast(samples, ["--mode", "minip"]), samples.min(0))


class Pieces(Rays):
    """Transfer functions that are narrower than what neighbouring samples differ by."""

    def pieces(self, samples, words, step=1, filter_="foh", **more):
        return self.render(samples, *words,
                           *via(f"project.preintegrated_cast/filter={filter_}/step={step}"), **more)

    @staticmethod
    def exact(depth, points, unit=1.0):
        """Along a ramp of slope 1: the integral in f64, attenuated within pieces too."""
        fine = 4096
        z = -0.5 + (np.arange(depth * fine) + 0.5) / fine
        values = np.clip(z, 0, depth - 1)  # beyond the outermost centres the nearest sample continues
        return float(composited(values[:, None], points, 1 / fine / unit)[0])

    def test_a_band_between_two_samples_is_seen(self):
        depth = 24
        samples = np.broadcast_to(np.arange(depth, dtype="f4")[:, None, None], (depth, 4, 4)).copy()
        band = [(12.3, 0, 1), (12.31, 0.9, 1), (12.49, 0.9, 1), (12.5, 0, 1)]
        expected = self.exact(depth, band)
        words = self.transfer(band)
        missed = self.cast(samples, words)
        np.testing.assert_array_equal(missed, 0, "no sample has such a value")
        for step in (0.5, 1, 2, 3.7):
            np.testing.assert_allclose(self.pieces(samples, words, step), expected, rtol=5e-3, err_msg=str(step))

    def test_a_medium_is_the_same_at_any_step(self):
        # Three media beside each other; and one alone.
        opacities = np.array((1e-4, 0.05, 0.5))
        columns = np.tile(np.repeat(np.arange(3, dtype="f4"), 3), (9, 3, 1))
        words = self.transfer([(i, opacity, 1) for i, opacity in enumerate(opacities)])
        expected = np.tile(np.repeat(-np.expm1(9 * np.log1p(-opacities)), 3)[:, None], (3, 1, 3))
        for step in (2, 1, 0.7, 0.25):
            np.testing.assert_allclose(self.pieces(columns, words, step), expected, rtol=1e-5, atol=1e-6)
        words = self.transfer([(0, 0.05, 1), (2, 0.05, 1)])
        made = self.pieces(np.ones((9, 3, 3), "f4"), words, 0.7)
        np.testing.assert_allclose(made, expected[:, 3:6], rtol=1e-5, atol=1e-6)

    def test_orders_of_convergence_in_the_step(self):
        """Pieces are of second order: within one, all light is attenuated alike. The midpoint rule is of second order or
        better, until the rounding of f32."""
        rng = np.random.default_rng(5)
        z = np.arange(40)
        samples = (20 + 15 * np.sin(z[:, None, None] * 1.2 + rng.uniform(0, 6, (1, 6, 6)))).astype("f4")
        words = self.transfer([(0, 0.02, 0), (45, 0.11, 1)])
        for made_by, steps in ((self.cast, (2, 1, 0.5)), (self.pieces, (0.5, 0.25, 0.125))):
            finest = made_by(samples, words, 1 / 64, filter_="bspline3").astype(float)
            errors = [rms(made_by(samples, words, step, filter_="bspline3") - finest) for step in steps]
            slopes = np.log2(np.array(errors[:-1]) / errors[1:])
            self.assertTrue(np.all(slopes > 1.8), f"{made_by}: {errors} {slopes}")
            if made_by == self.pieces:
                self.assertTrue(np.all(slopes < 2.2), f"{errors} {slopes}")
        # Both go to the same picture.
        self.assertLess(rms(self.cast(samples, words, 1 / 64).astype(float) - self.pieces(samples, words, 1 / 64)), 1e-4)
        steep = [(25, 0, 1), (25.1, 0.8, 0.5), (26, 0.8, 1), (26.1, 0, 1)]
        words = self.transfer(steep)
        finest = self.cast(samples, words, 1 / 64).astype(float)
        points = rms(self.cast(samples, words, 1) - finest)
        pieces = rms(self.pieces(samples, words, 1) - finest)
        self.assertLess(pieces, 0.25 * points)

    def test_predicted_errors_hold_and_what_it_refuses(self):
        samples = (np.random.default_rng(3).random((20, 20, 20)) * 100).astype("f4")
        steep = self.transfer([(60, 0, 1), (61, 0.7, 0.5), (65, 0.7, 1), (66, 0, 1)])
        write_nrrd(self.folder / "s.nrrd", samples)
        for step in (1, 2):
            report = self.report("render", self.folder / "s.nrrd", "-o", "null:", *steep, "--rotate", "20,30,0", "--verify=all",
                                 "--max-error", "9", "--via", f"project.preintegrated_cast/filter=foh/step={step}")
            self.assertLessEqual(report["measured"]["error"]["nrmse"], 1.1 * report["plan"]["predicted"]["error"])
        for words in (["--mode", "mip"], [*steep, "--shade", "phong"], [*steep, "--depth-cue", "0.1"]):
            self.run_it("render", self.folder / "s.nrrd", "-o", "null:", *words, "--via", "project.preintegrated_cast", code=3)


if __name__ == "__main__":
    main()
