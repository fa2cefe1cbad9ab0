"""What warps make of samples: orders of convergence, lobes, tails, seams, NaN."""

import numpy as np
from driving import Driven, grid, main, rms, seen_at, turn, turn3, via, write_nrrd


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


def spline_taps(n, x):
    """Four indices, mirrored at the ends, and their weights."""
    period = 2 * max(n - 1, 1)
    i = np.floor(x).astype(int)
    t = x - i
    weights = ((1 - t) ** 3 / 6, 2 / 3 - t ** 2 + t ** 3 / 2,
               2 / 3 - (1 - t) ** 2 + (1 - t) ** 3 / 2, t ** 3 / 6)
    at = [np.abs(i - 1 + k) % period for k in range(4)]
    return [(np.where(k < n, k, period - k), weight) for k, weight in zip(at, weights)]


def spline_at(coefficients, x):
    return sum(weight * coefficients[i] for i, weight in spline_taps(len(coefficients), x))


def spline_image_at(coefficients, x, y):
    height, width = coefficients.shape
    return sum(v * u * coefficients[j, i] for j, v in spline_taps(height, y)
               for i, u in spline_taps(width, x))


def bumps(at, size):
    x, y = at[0] / size, at[1] / size
    return (np.exp(-30 * ((x - 0.08) ** 2 + 1.5 * (y + 0.05) ** 2))
            + 0.5 * np.cos(9 * x + 4 * y) * np.exp(-30 * (x ** 2 + y ** 2)))


TAPS = {"keys6": 6, "keys": 4, "lanczos3": 6}  # of filters whose weights are polynomials

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
        for path in ("warp.backward/filter=foh", "warp.backward/filter=bspline3",
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
        """Each of them gives the bytes that numpy does, so four of them give the first. Edges start at
        one turn after another; the last one goes round."""
        samples = np.random.default_rng(9).integers(0, 65535, (24, 24)).astype("<u2")
        paths = self.warps()
        for nth, path in enumerate(paths):
            now = np.rot90(samples, -nth)
            for turned in range(nth + 1, nth + (5 if path == paths[-1] else 2)):
                now = self.warp(now, "--rotate", "90", *via(path))
                np.testing.assert_array_equal(now, np.rot90(samples, -turned), path)


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
        made = self.warp(checker, "--rotate", "31", *via("warp.backward/filter=bspline3"))
        x, y = seen_at(checker.shape, turn(31)) + 15.5
        inner = (x >= 0) & (x <= 31) & (y >= 0) & (y <= 31)
        expected = spline_image_at(coefficients, x, y)[inner]
        # Coefficients are up to 9 times as large as the samples.
        np.testing.assert_allclose(made[inner], expected, atol=1e-5)
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


class Constants(Driven):
    def test_S18_constants_stay_constant_through_every_warp(self):
        """Large enough for several tiles and ends of vectors; what lies outside has the value too,
        so that nothing may show. Every edge has the three moves, each with another type."""
        kinds = (("u1", 77), ("i2", -1234), ("f4", 0.7))
        for move, (shape, words) in enumerate((((211, 301), ["--rotate", "23"]), ((211, 301), ["--scale", "1.3"]),
                                               ((21, 70, 67), ["--rotate", "10,20,30"]))):
            for nth, path in enumerate(self.warps()):
                for kind, value in (kinds[(move + nth) % 3],):
                    samples = np.full(shape, value, "<" + kind)
                    beyond = ["--outside", repr(float(samples.flat[0]))]
                    made, done = self.warp(samples, *words, *beyond, *via(path), code=None)
                    if made is None:
                        self.assertEqual(done.returncode, 3)
                        continue
                    # Of f32: three roundings of weights and sums, twice that with a prefilter. Where weights are
                    # polynomials each is off by 2^-24 of some 1, and so is each of the sums, along every axis.
                    taps = next((n for name, n in TAPS.items() if f"filter={name}" in path), 0)
                    roundings = 2 * taps * len(shape) or (16 if "bspline" in path else 6)
                    most = 0 if kind != "f4" else 0.7 * 2 ** -24 * roundings
                    self.assertLessEqual(np.abs(made.astype("f8") - samples).max(), most,
                                         f"{path} {words} {kind}")


class NotFinite(Driven):
    def test_S20_nothing_spreads_beyond_the_footprint(self):
        shape = (24, 25, 26)
        samples = np.random.default_rng(11).random(shape, "f4")
        angles = (14, -33, 21)
        seen = seen_at(shape, turn3(*angles))
        words = ["--rotate", ",".join(map(str, angles))]
        # So far apart that no sample is within reach of two.
        sites = ((12, 11, 13), (8, 14, 9), (15, 16, 17))
        away = []
        for site in sites:
            centre = np.array(site[::-1]) - (np.array(shape[::-1]) - 1) / 2
            away.append(np.abs(seen - centre[:, None, None, None]).max(0))
        spoils = [(dict(zip(sites, (np.nan, np.inf, -np.inf))), np.min(away, 0))]
        # And each alone, by one edge.
        alone = [({sites[0]: bad}, away[0]) for bad in (np.nan, np.inf, -np.inf)]
        for path in self.warps():
            clean, done = self.warp(samples, *words, *via(path), code=None)
            if clean is None:
                self.assertEqual(done.returncode, 3, done.stderr)
                continue
            for bad, away in spoils + (alone if path == "warp.backward/filter=foh" else []):
                spoilt = samples.copy()
                for site, value in bad.items():
                    spoilt[site] = value
                made, done = self.warp(spoilt, *words, *via(path), code=None)
                if made is None:  # refused: by the edge, or as its prefilter is
                    self.assertEqual(done.returncode, 3)
                    self.assertRegex(done.stderr, "not finite|reads the coefficients")
                    continue
                self.assertIn(f"{len(bad)} values are not finite", done.stderr)
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
