"""Where reconstruction fails: ties, singular maps, horizons, drift, lobes, tails, seams, NaN."""

import numpy as np
from driving import Driven, grid, main, numbered, rms, seen_at, turn, turn3, via, write_nrrd

TYPES = ("u1", "i2", "u2", "f4")


def linear_at(samples, x, y):
    """First-order hold in f64 with the border rule: the nearest sample continues for half a sample,
    beyond that 0."""
    height, width = samples.shape
    inside = (x >= -0.5) & (x <= width - 0.5) & (y >= -0.5) & (y <= height - 0.5)
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    i, j = np.minimum(i, max(width - 2, 0)), np.minimum(j, max(height - 2, 0))
    u, v = x - i, y - j
    k, m = np.minimum(i + 1, width - 1), np.minimum(j + 1, height - 1)
    s = samples.astype("f8")
    value = ((1 - v) * ((1 - u) * s[j, i] + u * s[j, k]) + v * ((1 - u) * s[m, i] + u * s[m, k]))
    return np.where(inside, value, 0)


def spline_row(row):
    """B-spline coefficients of a row in f64, mirrored at its ends, by solving all of its equations
    at once: nothing recursive, nothing truncated."""
    n = len(row)
    if n == 1:
        return row.astype("f8")
    a = np.diag(np.full(n, 4 / 6)) + np.diag(np.full(n - 1, 1 / 6), 1)
    a += np.diag(np.full(n - 1, 1 / 6), -1)
    a[0, 1] += 1 / 6
    a[-1, -2] += 1 / 6
    return np.linalg.solve(a, row.astype("f8"))


def spline_at(coefficients, x):
    n = len(coefficients)
    period = 2 * max(n - 1, 1)
    i = np.floor(x).astype(int)
    t = x - i
    weights = ((1 - t) ** 3 / 6, 2 / 3 - t ** 2 + t ** 3 / 2,
               2 / 3 - (1 - t) ** 2 + (1 - t) ** 3 / 2, t ** 3 / 6)
    value = 0
    for k, weight in enumerate(weights):
        at = np.abs(i - 1 + k) % period
        value = value + weight * coefficients[np.where(at < n, at, period - at)]
    return value


class Sampling(Driven):
    def warps(self, without=()):
        return [path for path in self.paths("screen/scalar")
                if not any(word in path for word in without)]


class Ties(Sampling):
    def test_S4_halves_round_upward_on_either_side_of_zero(self):
        """Output i reads at i - s; a half belongs to the sample above it, floor(x + 1/2), for
        positive and for negative places: rounding away from zero would repeat sample 0."""
        width = 37
        for kind in TYPES:
            row = (np.arange(width) * 3 + 1).astype("<" + kind)
            samples = np.stack([row, row])
            for shift in (0.5, -0.5, 1.5, -2.5, 7.5, -7.5):
                at = np.arange(width) - shift
                nearest = np.floor(at + 0.5).astype(int)
                inside = (at >= -0.5) & (at <= width - 0.5)
                expected = np.where(inside, row[np.clip(nearest, 0, width - 1)], 0)
                for path in ("warp.backward/filter=zoh", "warp.permutation/filter=zoh"):
                    made = self.warp(samples, "--translate", f"{shift},0", *via(path))
                    np.testing.assert_array_equal(made, np.stack([expected] * 2),
                                                  f"{path} {kind} {shift}")

    def test_S4_the_rule_moves_every_sample_alike(self):
        """M adds the rounded shift to all: one gap or one overlap would show as a wrong step."""
        samples = numbered((9, 31))
        for shift in (0.5, -0.5, 2.5, -3.5, 1e-12 + 0.5, 0.5 - 1e-12):
            made = self.warp(samples, "--translate", f"{shift!r},{shift!r}", "--outside", "-1",
                             *via("warp.permutation/filter=me"))
            whole = int(np.floor(shift + 0.5))
            inner = np.s_[4:-4, 5:-5]
            expected = np.roll(samples, (whole, whole), (0, 1))[inner]
            np.testing.assert_array_equal(made[inner], expected, repr(shift))


class Singular(Driven):
    IMAGE = np.arange(64, dtype="<f4").reshape(8, 8)

    def refused(self, text, samples=None):
        message = self.warp(self.IMAGE if samples is None else samples, "--matrix", text, code=2)
        self.assertTrue(message.startswith("edgewise: "), message)
        return message

    def test_S10_singular_matrices(self):
        for text in ("0,0,0,0", "1,2,2,4", "1,0,0,0", "0,0,0,1", "1,1,1,1",
                     "1,0,0,1,0,0,0,0,0", "1,2,3,4,5,6,7,8,9", "0.1,0.2,0.3,0.6"):
            self.assertRegex(self.refused(text), "singular|flatten")
        for text in ("1,0,0,0,1,0,0,0,0", "1,2,3,4,5,6,7,8,9"):
            self.assertRegex(self.refused(text, np.zeros((4, 4, 4), "u1")), "singular|flatten")

    def test_S10_numbers_that_are_none(self):
        for text in ("nan,0,0,1", "inf,0,0,1", "1,0,0,-inf", "1e400,0,0,1"):
            self.assertIn("finite", self.refused(text))
        self.refused("1,0,0")

    def test_S10_denormal_and_huge_matrices(self):
        for text in ("1e-310,0,0,1", "1,0,0,1e-310", "1e-200,0,0,1e200", "1,0,0,1e-17"):
            self.assertRegex(self.refused(text), "singular|flatten")
        for text in ("1e-310,0,0,1e-310", "1e300,0,0,1e300"):
            made, done = self.warp(self.IMAGE, "--matrix", text, code=None)
            self.assertIn(done.returncode, (0, 2))
            if made is not None:
                self.assertTrue(np.all(np.isfinite(made)))

    def test_S10_steps_that_flatten_together(self):
        """Each step is harmless."""
        message = self.warp(self.IMAGE, *["--scale", "1e4,1e-4"] * 2, code=2)
        self.assertRegex(message, r"condition 1e\+16")

    def test_S10_condition_is_told(self):
        """diag(1, 1/c) turned by 30 degrees: within the limits the answer is right, near them it
        comes with a warning, beyond them it is refused with the number."""
        away, back = turn(30), turn(-30)
        for power in range(1, 18):
            condition = 10.0 ** power
            linear = away @ np.diag([1, 1 / condition]) @ back
            text = ",".join(map(repr, map(float, linear.ravel())))
            made, done = self.warp(self.IMAGE, "--matrix", text, *via("warp.backward/filter=foh"),
                                   code=None)
            if power > 12:
                self.assertEqual(done.returncode, 2, text)
                self.assertRegex(done.stderr, "flattens the image")
                continue
            if power == 12:
                continue  # the limit itself, either side of it by rounding
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("nearly singular" in done.stderr, power >= 7, text)
            x, y = np.linalg.solve(linear, grid((8, 8)).reshape(2, -1)).reshape(2, 8, 8) + 3.5
            expected = linear_at(self.IMAGE, x, y)
            # Places are off by 2^-53 times the condition times 8 samples; the image climbs by 9 a
            # sample at most. What lies that close to the border may be in or out.
            off = 2.0 ** -50 * condition * 8 + 1e-9
            sure = np.all([np.abs(np.abs(p - 3.5) - 4) > off for p in (x, y)], 0)
            np.testing.assert_allclose(made[sure], expected[sure], atol=9 * off + 4e-6)

    def test_S10_reflections_are_fine(self):
        for text, expected in (("-1,0,0,1", self.IMAGE[:, ::-1]), ("1,0,0,-1", self.IMAGE[::-1]),
                               ("0,1,1,0", self.IMAGE.T)):
            for path in ("warp.backward/filter=foh", "warp.permutation/filter=me",
                         "warp.axis_permutation/to=screen"):
                np.testing.assert_array_equal(
                    self.warp(self.IMAGE, "--matrix", text, *via(path)), expected)


class Horizon(Driven):
    SIZE = 64

    def expected(self, samples, matrix):
        """One policy, in f64: where w <= 0 is nothing, and nothing folds over."""
        inverse = np.linalg.inv(matrix)
        if matrix[2, 2] < 0:  # H and -H are one map; the held point lies in front
            inverse = -inverse
        y, x = np.indices(samples.shape, float)
        u, v, w = np.einsum("ij,jyx->iyx", inverse, np.stack([x, y, np.ones_like(x)]))
        with np.errstate(all="ignore"):
            value = linear_at(samples, np.where(w > 0, u / w, -9), np.where(w > 0, v / w, -9))
        return value, w

    def test_S11_horizon_inside_the_image(self):
        random = np.random.default_rng(1)
        samples = (1 + random.random((self.SIZE, self.SIZE))).astype("<f4")
        behind = 0
        for tilt in (0.01, 0.02, 1 / 32, 0.05, 0.2, -0.05):
            for sign in (1, -1):
                matrix = sign * np.array([[1, 0.1, 3], [0, 1, 2], [tilt, tilt / 2, 1]])
                text = ",".join(map(repr, map(float, matrix.ravel())))
                made = self.warp(samples, "--matrix", text, "--about", "0,0", "--outside", "0",
                                 *via("warp.backward/filter=foh"))
                expected, w = self.expected(samples, matrix)
                self.assertTrue(np.all(np.isfinite(made)))
                self.assertTrue(np.all(made[w <= 0] == 0))
                behind += np.sum(w <= 0)
                # Next to the border or the horizon a rounding decides; elsewhere places are right
                # to 2^-20, and neighbours differ by up to 1.
                differ = np.abs(made - expected) > 1e-5
                self.assertLessEqual(differ.sum(), 3, (tilt, sign))
        self.assertGreater(behind, 1000)

    def test_S11_nothing_folds_over(self):
        """So steep that a division by negative w would read inside the image once more."""
        samples = np.ones((self.SIZE, self.SIZE), "f4")
        x, y = grid(samples.shape)
        for tilt in ((0, 0.12), (0.12, 0.05), (-0.2, 0)):
            matrix = np.array([[1, 0, 0], [0, 1, 0], [*tilt, 1]])
            inverse = np.linalg.inv(matrix)
            u, v, w = np.einsum("ij,jyx->iyx", inverse, np.stack([x, y, np.ones_like(x)]))
            with np.errstate(all="ignore"):
                again = (w < 0) & (np.abs(u / w) < 31) & (np.abs(v / w) < 31)
            self.assertGreater(again.sum(), 100)
            text = ",".join(map(repr, map(float, matrix.ravel())))
            for hold in ("zoh", "foh", "bspline3"):
                made = self.warp(samples, "--matrix", text, *via(f"warp.backward/filter={hold}"))
                self.assertTrue(np.all(made[w <= 0] == 0))
                self.assertGreater(made.sum(), 100)

    def test_S11_pixels_on_the_horizon_itself(self):
        """w = 0 exactly in one column."""
        samples = np.ones((16, 16), "f4")
        inverse = np.array([[1, 0, 0], [0, 1, 0], [-1 / 8, 0, 1]])
        text = ",".join(map(repr, map(float, np.linalg.inv(inverse).ravel())))
        for path in ("zoh", "foh", "bspline3"):
            made = self.warp(samples, "--matrix", text, "--about", "0,0",
                             *via(f"warp.backward/filter={path}"))
            self.assertTrue(np.all(np.isfinite(made)))
            self.assertTrue(np.all(made[:, 8:] == 0))
            self.assertTrue(np.all(made[:6, :5] > 0.99))

    def test_S11_other_edges_refuse_a_horizon(self):
        text = "1,0,0,0,1,0,0.02,0,1"
        for path in self.paths("screen/scalar"):
            if "backward" not in path:
                message = self.warp(np.ones((16, 16), "f4"), "--matrix", text, *via(path), code=3)
                self.assertIn(path.split("/")[0] + ": ", message)
        self.warp(np.ones((4, 4, 4), "f4"), "--matrix", "1,0,0,0,0,1,0,0,0,0,1,0,0.1,0,0,1", code=2)


class Drift(Driven):
    """Places along a row: a sawtooth tells them, since first-order hold of a ramp is the place."""

    def places(self, width, height, words, path, period=64):
        saw = np.tile(np.arange(width) % period, (height, 1)).astype("<f4")
        return self.warp(saw, *words, *via(path)), period

    def expect_places(self, made, x, period, inside):
        at = np.mod(x, period)
        smooth = inside & (at < period - 2) & (at > 1)
        self.assertGreater(smooth.sum(), made.size / 3)
        self.assertLessEqual(np.abs(made - at)[smooth].max(), 1 / 512)

    def test_S12_rows_of_65536_samples(self):
        """Adding the step again and again in f32 is off by more than a sample at their end."""
        width, height = 65536, 5
        for linear in (np.array([[1.0003, 0.01], [1e-6, 1.0]]), np.array([[0.7, 0], [0, 1.0]]),
                       np.array([[1, 0.3], [0, 1.0]])):
            text = ",".join(map(repr, map(float, linear.ravel())))
            x, y = seen_at((height, width), linear)
            inside = (np.abs(x) < width / 2 - 2) & (np.abs(y) < height / 2 - 1)
            made, period = self.places(width, height, ["--matrix", text],
                                       "warp.backward/filter=foh")
            self.expect_places(made, x + (width - 1) / 2, period, inside)

    def test_S12_shears_of_long_rows(self):
        width, height = 65536, 9
        linear = np.array([[1, 0.3], [0, 1.0]])
        x, y = seen_at((height, width), linear)
        inside = np.abs(x) < width / 2 - 4
        for path in ("warp.shear/filter=foh", "warp.permutation/filter=foh"):
            made, period = self.places(width, height, ["--shear", "xy=0.3"], path)
            self.expect_places(made, x + (width - 1) / 2, period, inside)

    def test_S12_columns_of_65536_samples(self):
        width, height = 3, 65536
        saw = np.tile((np.arange(height) % 64)[:, None], (1, width)).astype("<f4")
        for scale in (1.0003, 0.7):
            made = self.warp(saw, "--scale", f"1,{scale}", *via("warp.backward/filter=foh"))
            y = (np.arange(height) - (height - 1) / 2) / scale + (height - 1) / 2
            inside = np.tile(((y > 1) & (y < height - 2))[:, None], (1, width))
            self.expect_places(made, np.tile(y[:, None], (1, width)), 64, inside)

    def test_S12_extents_beyond_32767_are_ordinary(self):
        row = np.random.default_rng(6).integers(0, 255, (2, 70001)).astype("u1")
        np.testing.assert_array_equal(
            self.warp(row, "--rotate", "180", *via("warp.backward/filter=foh")), row[::-1, ::-1])
        np.testing.assert_array_equal(
            self.warp(row, "--rotate", "90", "--size", "2x70001", "--spacing", "1"),
            np.rot90(row, -1))


class Exact(Sampling):
    def test_S13_copies_are_copies(self):
        """Identity, whole shifts, flips and quarter turns through every edge and every filter."""
        random = np.random.default_rng(7)
        moves = [([], lambda a: a),
                 (["--rotate", "90"], lambda a: np.rot90(a, -1)),
                 (["--rotate", "180"], lambda a: np.rot90(a, 2)),
                 (["--rotate", "-90"], lambda a: np.rot90(a, 1)),
                 (["--matrix", "-1,0,0,1"], lambda a: a[:, ::-1]),
                 (["--matrix", "0,1,1,0"], lambda a: a.T),
                 (["--translate", "2,0"], lambda a: np.pad(a, ((0, 0), (2, 0)))[:, :-2]),
                 (["--translate", "0,-1"], lambda a: np.pad(a, ((0, 1), (0, 0)))[1:])]
        for kind in TYPES:
            most = 1 if kind == "f4" else 250
            samples = (random.random((9, 9)) * most).astype("<" + kind)
            for path in self.warps():
                for words, expected in moves:
                    made = self.warp(samples, *words, *via(path))
                    if "bspline3" in path and kind == "f4":
                        # f32 coefficients: twice 2^-24 an axis and a pass at most 5 of them.
                        np.testing.assert_allclose(made, expected(samples), atol=6e-7)
                    else:
                        np.testing.assert_array_equal(made, expected(samples), f"{path} {words}")

    def test_S13_all_48_ways_to_lay_a_volume(self):
        samples = np.random.default_rng(8).integers(0, 9999, (5, 5, 5)).astype("<i2")
        for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
            for signs in range(8):
                sign = [1 - 2 * (signs >> k & 1) for k in range(3)]
                matrix = np.zeros((3, 3))
                for row in range(3):
                    matrix[row, order[row]] = sign[row]
                # Screen axis r takes input axis order[r]; arrays have z first.
                expected = samples.transpose([2 - order[2], 2 - order[1], 2 - order[0]])
                expected = expected[tuple(slice(None, None, s) for s in sign[::-1])]
                text = ",".join(str(int(entry)) for entry in matrix.ravel())
                for path in ("warp.axis_permutation/to=screen", "warp.shear/filter=foh",
                             "warp.permutation/filter=me", "warp.backward/filter=foh"):
                    if path.startswith("warp.shear") and signs % 3:
                        continue  # seen for images and for the other signs
                    made = self.warp(samples, "--matrix", text, *via(path))
                    np.testing.assert_array_equal(made, expected, f"{path} {text}")


def bumps(at, size):
    x, y = at[0] / size, at[1] / size
    return (np.exp(-30 * ((x - 0.08) ** 2 + 1.5 * (y + 0.05) ** 2))
            + 0.5 * np.cos(9 * x + 4 * y) * np.exp(-30 * (x ** 2 + y ** 2)))


class Orders(Driven):
    def errors(self, path, sizes):
        found = []
        for size in sizes:
            shape = (size, size)
            made = self.warp(bumps(grid(shape), size).astype("<f4"), "--rotate", "17", *via(path))
            seen = seen_at(shape, turn(17))
            inner = np.hypot(*seen) < 0.42 * size
            found.append(rms((made - bumps(seen, size))[inner]))
        return np.array(found)

    def test_S15_orders_of_convergence(self):
        """Errors of h, h/2 and h/4: zero-order hold 1, linear 2, cubic B-spline 4."""
        for path, order, sizes in (
                ("warp.backward/filter=zoh", 1, (64, 128, 256)),
                ("warp.backward/filter=foh", 2, (64, 128, 256)),
                ("warp.backward/filter=bspline3", 4, (32, 64, 128)),
                ("warp.permutation/filter=me", 1, (64, 128, 256)),
                ("warp.permutation/filter=zoh", 1, (64, 128, 256)),
                ("warp.permutation/filter=foh", 2, (64, 128, 256)),
                ("warp.shear/filter=foh", 2, (64, 128, 256)),
                ("warp.shear/filter=bspline3", 4, (32, 64, 128))):
            errors = self.errors(path, sizes)
            slopes = np.log2(errors[:-1] / errors[1:])
            with self.subTest(path=path, slopes=slopes):
                self.assertLess(np.abs(slopes - order).max(), 0.2)

    def test_S14_twelve_turns_by_30_degrees(self):
        """What a round trip leaves, by filter: recorded in docs/stability.md [dB of the range]."""
        size = 96
        samples = bumps(grid((size, size)), size).astype("<f4")
        inside = np.hypot(*grid((size, size))) < size / 2 - 6
        kept = {}
        for path in ("warp.backward/filter=zoh", "warp.backward/filter=foh",
                     "warp.backward/filter=bspline3", "warp.shear/filter=foh",
                     "warp.shear/filter=bspline3", "warp.permutation/filter=me"):
            now = samples
            for _ in range(12):
                now = self.warp(now, "--rotate", "30", *via(path))
            kept[path] = -20 * np.log10(rms((now - samples)[inside]) / np.ptp(samples))
        self.assertGreater(kept["warp.backward/filter=bspline3"], 75)
        self.assertGreater(kept["warp.shear/filter=bspline3"], 75)
        self.assertGreater(kept["warp.backward/filter=bspline3"],
                           kept["warp.backward/filter=foh"] + 30)
        self.assertGreater(kept["warp.permutation/filter=me"],
                           28)  # each turn moves by less than a sample, and loses nothing

    def test_S13_S14_four_quarter_turns_give_the_bytes(self):
        samples = np.random.default_rng(9).integers(0, 65535, (24, 24)).astype("<u2")
        for path in self.paths("screen/scalar"):
            now = samples
            for _ in range(4):
                now = self.warp(now, "--rotate", "90", *via(path))
            np.testing.assert_array_equal(now, samples, path)


class Lobes(Driven):
    def test_S16_overshoot_of_a_step(self):
        """The cardinal cubic spline overshoots a unit step by at most 0.0755 (searched here in
        f64); holds of lower order never do."""
        edge = np.repeat([0.0, 1.0], 24)
        coefficients = spline_row(edge)
        fine = np.linspace(10, 37, 20001)
        most = spline_at(coefficients, fine).max() - 1
        samples = np.tile(edge, (6, 1)).astype("<f4")
        for shift in (0.1, 0.25, 0.4, 0.5, 0.6):
            words = ["--translate", f"{shift},0"]
            made = self.warp(samples, *words, *via("warp.backward/filter=bspline3"))
            x = np.arange(48) - shift
            inner = np.s_[:, 1:]
            expected = np.tile(spline_at(coefficients, x), (6, 1))
            np.testing.assert_allclose(made[inner], expected[inner], atol=1e-6)
            self.assertLessEqual(made.max(), 1 + most + 1e-6)
            self.assertGreaterEqual(made.min(), -most - 1e-6)
            for path in ("warp.backward/filter=foh", "warp.shear/filter=foh",
                         "warp.permutation/filter=foh", "warp.backward/filter=zoh"):
                made = self.warp(samples, *words, *via(path))
                self.assertTrue(made.min() >= 0 and made.max() <= 1, path)

    def test_S16_integers_do_not_wrap(self):
        for kind, most in (("u1", 255), ("u2", 65535), ("i2", 32767)):
            least = -32768 if kind == "i2" else 0
            edge = np.repeat([float(least), float(most)], 24)
            coefficients = spline_row(edge)
            samples = np.tile(edge, (6, 1)).astype("<" + kind)
            for shift in (0.3, 0.5, -0.3):
                made = self.warp(samples, "--translate", f"{shift},0",
                                 *via("warp.backward/filter=bspline3"))
                x = np.arange(2, 46) - shift
                expected = np.clip(np.rint(spline_at(coefficients, x)), least, most)
                # f32 coefficients of 2^16: a half may round either way.
                self.assertLessEqual(np.abs(made[3, 2:46].astype("f8") - expected).max(), 1, kind)
                self.assertEqual(made.max(), most)
                self.assertEqual(made.min(), least)

    def test_S16_checkerboard(self):
        checker = (np.indices((32, 32)).sum(0) % 2).astype("<f4")
        rows = np.array([spline_row(row) for row in checker.astype("f8")])
        coefficients = np.array([spline_row(column) for column in rows.T]).T
        # Weights are positive and sum to 1, so nothing exceeds the coefficients.
        made = self.warp(checker, "--rotate", "31", *via("warp.backward/filter=bspline3"))
        self.assertLessEqual(made.max(), coefficients.max() + 1e-5)
        self.assertGreaterEqual(made.min(), coefficients.min() - 1e-5)
        made = self.warp(checker, "--rotate", "31", *via("warp.backward/filter=foh"))
        self.assertTrue(made.min() >= 0 and made.max() <= 1)


class Tails(Driven):
    def test_S17_a_large_impulse_in_a_field_of_zeros(self):
        """Against all equations solved at once; the pole's powers must end where f64 says."""
        for width in (5, 17, 64, 300):
            for place in {0, 1, width // 2, width - 1}:
                row = np.zeros(width)
                row[place] = 1e6
                coefficients = spline_row(row)
                shift = 0.37
                made = self.warp(np.tile(row, (3, 1)).astype("<f4"), "--translate", f"{shift},0",
                                 *via("warp.backward/filter=bspline3"))[1]
                x = np.arange(width) - shift
                expected = spline_at(coefficients, np.maximum(x, 0))
                inner = x >= 0  # left of sample 0 the nearest one continues
                # Rounding is relative to the largest coefficient that a recursion has passed.
                np.testing.assert_allclose(made[inner], expected[inner],
                                           atol=1e6 * 2 ** -22, err_msg=f"{width} {place}")
                far = np.abs(x - place) > 40
                self.assertTrue(np.all(np.abs(made[far]) < 1e-12))

    def test_S17_every_border_is_mirrored(self):
        random = np.random.default_rng(10)
        for width in (2, 3, 4, 9):
            row = random.random(width)
            coefficients = spline_row(row.astype("f4"))
            for shift in (0.2, -0.4, 0.5):
                made = self.warp(np.tile(row, (2, 1)).astype("<f4"), "--translate", f"{shift},0",
                                 *via("warp.backward/filter=bspline3"))[0]
                x = np.arange(width) - shift
                inner = (x >= 0) & (x <= width - 1)
                np.testing.assert_allclose(made[inner], spline_at(coefficients, x)[inner],
                                           atol=1e-6)


class Constants(Sampling):
    def test_S18_constants_stay_constant_through_every_warp(self):
        """Large enough for several tiles and ends of vectors; what lies outside has the value too,
        so that nothing may show."""
        for shape, words in (((211, 301), ["--rotate", "23"]), ((211, 301), ["--scale", "1.3"]),
                             ((21, 70, 67), ["--rotate", "10,20,30"])):
            for kind, value in (("u1", 77), ("i2", -1234), ("f4", 0.7)):
                samples = np.full(shape, value, "<" + kind)
                for path in self.warps():
                    beyond = ["--outside", repr(float(samples.flat[0]))]
                    made, done = self.warp(samples, *words, *beyond, *via(path), code=None)
                    if made is None:
                        self.assertEqual(done.returncode, 3)
                        continue
                    # Of f32: three roundings of weights and sums, twice that with a prefilter.
                    most = 0 if kind != "f4" else 0.7 * 2 ** -24 * (16 if "bspline" in path else 6)
                    self.assertLessEqual(np.abs(made.astype("f8") - samples).max(), most,
                                         f"{path} {words} {kind}")


class NotFinite(Sampling):
    def test_S20_nothing_spreads_beyond_the_footprint(self):
        shape = (24, 25, 26)
        samples = np.random.default_rng(11).random(shape, "f4")
        angles = (14, -33, 21)
        seen = seen_at(shape, turn3(*angles))
        words = ["--rotate", ",".join(map(str, angles))]
        site = (12, 11, 13)
        centre = np.array(site[::-1]) - (np.array(shape[::-1]) - 1) / 2
        away = np.abs(seen - centre[:, None, None, None]).max(0)
        for path in self.warps():
            clean, done = self.warp(samples, *words, *via(path), code=None)
            if clean is None:
                self.assertEqual(done.returncode, 3, done.stderr)
                continue
            for bad in (np.nan, np.inf, -np.inf):
                spoilt = samples.copy()
                spoilt[site] = bad
                made, done = self.warp(spoilt, *words, *via(path), code=None)
                if made is None:  # refused: by the edge, or as its prefilter is
                    self.assertEqual(done.returncode, 3)
                    self.assertRegex(done.stderr, "not finite|reads the coefficients")
                    continue
                self.assertIn("1 values are not finite", done.stderr)
                # A hold reads one sample to each side; a rule moves by up to 1.104 besides.
                reach = 1.105 if "me" in path.split("=")[-1] else 1
                touched = ~((made == clean) | (np.isnan(made) & np.isnan(clean)))
                self.assertLessEqual(away[touched].max(initial=0), reach + 1e-6, path)
                self.assertTrue(np.all(np.isfinite(made[away > reach + 1e-6])))

    def test_S20_the_planner_goes_another_way(self):
        samples = np.random.default_rng(12).random((20, 20, 20)).astype("<f4")
        samples[3, 4, 5] = np.nan
        report = self.report("warp", self.saved(samples), "-o", "null:", "--rotate", "5,6,7",
                             "--minimize", "error")
        steps = [step["transition"] for step in report["plan"]["steps"]]
        self.assertNotIn("filter.prefilter", steps)
        self.assertNotIn("warp.shear", steps)
        self.assertTrue(any("not finite" in refusal["reason"] for refusal in report["refused"]))
        self.assertTrue(any("not finite" in warning for warning in report["warnings"]))

    def saved(self, samples):
        write_nrrd(self.folder / "saved.nrrd", samples)
        return self.folder / "saved.nrrd"

    def test_S20_denormal_samples_take_no_slow_path(self):
        shape = (48, 96, 96)
        plain = np.random.default_rng(13).random(shape, "f4")
        small = (plain * np.float32(1e-41)).astype("<f4")
        for path in ("warp.backward/filter=foh", "warp.backward/filter=bspline3",
                     "warp.shear/filter=foh"):
            least = []
            for samples in (plain, small):
                report = self.report("warp", self.saved(samples), "-o", "null:", "--rotate",
                                     "10,20,30", "--repeat", 7, "--threads", 1, *via(path))
                least.append(min(report["measured"]["seconds"]))
            self.assertLess(least[1], 10 * least[0], path)


if __name__ == "__main__":
    main()
