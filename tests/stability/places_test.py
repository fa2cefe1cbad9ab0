"""Where warps read: ties, singular maps, horizons, drift, copies."""

import numpy as np
from driving import Driven, grid, main, numbered, seen_at, turn, via

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


class Ties(Driven):
    def test_S4_halves_round_upward_on_either_side_of_zero(self):
        """Output i reads at i - s; a half belongs to the sample above it, floor(x + 1/2), wherever
        it lies: rounding to even would repeat every other sample."""
        width, height = 37, 23

        def read_at(size, shift):
            at = np.arange(size) - shift
            return (np.clip(np.floor(at + 0.5).astype(int), 0, size - 1),
                    (at >= -0.5) & (at <= size - 0.5))
        for kind in TYPES:
            samples = (np.add.outer(np.arange(height) * 6, np.arange(width) * 3) + 1)
            samples = samples.astype("<" + kind)  # 241 at most
            # Two of the six shifts in a run, along x and along y.
            for shifts in ((0.5, -0.5), (1.5, -2.5), (-7.5, 7.5)):
                (i, in_x), (j, in_y) = read_at(width, shifts[0]), read_at(height, shifts[1])
                expected = np.where(np.logical_and.outer(in_y, in_x), samples[np.ix_(j, i)], 0)
                for path in ("warp.backward/filter=zoh", "warp.permutation/filter=zoh"):
                    made = self.warp(samples, "--translate", f"{shifts[0]},{shifts[1]}", *via(path))
                    np.testing.assert_array_equal(made, expected, f"{path} {kind} {shifts}")

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
        """w = 0 exactly in one column. The picture is so wide that an image which is mirrored at
        the horizon would show in it."""
        samples = np.ones((16, 16), "f4")
        inverse = np.array([[1, 0, 0], [0, 1, 0], [-1 / 8, 0, 1]])
        text = ",".join(map(repr, map(float, np.linalg.inv(inverse).ravel())))
        for path in ("zoh", "foh", "bspline3"):
            made = self.warp(samples, "--matrix", text, "--about", "0,0", "--size", "64x16",
                             *via(f"warp.backward/filter={path}"))
            # The frame begins 24 pixels before the image.
            self.assertTrue(np.all(np.isfinite(made)))
            self.assertTrue(np.all(made[:, 24 + 8:] == 0))
            self.assertTrue(np.all(made[:6, 24:24 + 5] > 0.99))

    def test_S11_other_edges_refuse_a_horizon(self):
        # About the image's corner its affine part is the identity, which any edge could do.
        for words in ([], ["--about", "0,0"]):
            for path in self.warps():
                if "backward" not in path:
                    message = self.warp(np.ones((16, 16), "f4"), "--matrix", "1,0,0,0,1,0,0.02,0,1",
                                        *words, *via(path), code=3)
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


class Exact(Driven):
    def test_S13_copies_are_copies(self):
        """Identity, whole shifts, flips and quarter turns through every edge and every filter; every
        edge has every type, and so has every move."""
        random = np.random.default_rng(7)
        moves = [([], lambda a: a),
                 (["--rotate", "90"], lambda a: np.rot90(a, -1)),
                 (["--rotate", "180"], lambda a: np.rot90(a, 2)),
                 (["--rotate", "-90"], lambda a: np.rot90(a, 1)),
                 (["--matrix", "-1,0,0,1"], lambda a: a[:, ::-1]),
                 (["--matrix", "0,1,1,0"], lambda a: a.T),
                 (["--translate", "2,0"], lambda a: np.pad(a, ((0, 0), (2, 0)))[:, :-2]),
                 (["--translate", "0,-1"], lambda a: np.pad(a, ((0, 1), (0, 0)))[1:])]
        of_kind = {kind: (random.random((9, 9)) * (1 if kind == "f4" else 250)).astype("<" + kind)
                   for kind in TYPES}
        for i, path in enumerate(self.warps()):
            for j, (words, expected) in enumerate(moves):
                # Kinds go round once for the first four moves, and from another one on for the rest.
                kind = TYPES[(i + j + j // 4) % 4]
                samples = of_kind[kind]
                made = self.warp(samples, *words, *via(path))
                if "bspline3" in path and kind == "f4":
                    # f32 coefficients: twice 2^-24 an axis and a pass at most 5 of them.
                    np.testing.assert_allclose(made, expected(samples), atol=6e-7)
                else:
                    np.testing.assert_array_equal(made, expected(samples), f"{path} {words} {kind}")

    def test_S13_all_48_ways_to_lay_a_volume(self):
        """Each by the edge that is made for it, and by one of three more, which see every order of
        axes and every choice of signs."""
        samples = np.random.default_rng(8).integers(0, 9999, (5, 5, 5)).astype("<i2")
        others = ("warp.shear/filter=foh", "warp.permutation/filter=me", "warp.backward/filter=foh")
        for nth, order in enumerate(((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))):
            for signs in range(8):
                sign = [1 - 2 * (signs >> k & 1) for k in range(3)]
                matrix = np.zeros((3, 3))
                for row in range(3):
                    matrix[row, order[row]] = sign[row]
                # Screen axis r takes input axis order[r]; arrays have z first.
                expected = samples.transpose([2 - order[2], 2 - order[1], 2 - order[0]])
                expected = expected[tuple(slice(None, None, s) for s in sign[::-1])]
                text = ",".join(str(int(entry)) for entry in matrix.ravel())
                for path in ("warp.axis_permutation/to=screen", others[(nth + signs) % 3]):
                    made = self.warp(samples, "--matrix", text, *via(path))
                    np.testing.assert_array_equal(made, expected, f"{path} {text}")


if __name__ == "__main__":
    main()
