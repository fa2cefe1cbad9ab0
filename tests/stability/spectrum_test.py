"""Where projections by slices of a spectrum fail: ghosts, odd lengths, offsets, small values."""

import numpy as np
from driving import Driven, main, rms, turn3

WINDOWS = [(4, 1.25), (4, 1.5), (4, 2), (6, 1.25), (6, 1.5), (6, 2)]
# Largest ghost of a point over the point, by window: of Jackson's and Beatty's windows of least
# mean ghost, at the edge of the field, where it is largest.
GHOSTS = {(4, 1.25): 0.05, (4, 1.5): 0.012, (4, 2): 0.004, (6, 1.25): 0.008, (6, 1.5): 4e-4,
          (6, 2): 1e-4}


class Spectrum(Driven):
    def slices(self, samples, words=(), window=(6, 2), **more):
        width, padding = window
        return self.render(samples, "--mode", "xray", "--spacing", "1", *words, "--via",
                           f"spectrum.forward/width={width}/padding={padding}", "--via",
                           "spectrum.slice/band=volume", "--without", "store", **more)


def padded(samples, by=5):
    """With nothing at the faces, where the field would be continued."""
    return np.pad(samples, by)


class Replication(Spectrum):
    def test_S34_a_point_swept_to_the_edge_of_the_field(self):
        """Slices that are interpolated between samples of the spectrum repeat the volume: a point
        at the edge then comes back, linearly interpolated without padding, at 0.4 of itself."""
        side = 24
        pictures = {}
        for window in WINDOWS:
            for x in (12, 18, 20):
                samples = np.zeros((side,) * 3, "f4")
                samples[12, 11, x] = 1
                pictures[window, x] = self.slices(samples, ["--size", "24x24"], window)
                gain = pictures[window, x][11, x]
                # Deapodised: 1 again, but for the spline's tails beyond the bands that are folded.
                self.assertLess(abs(gain - 1), 0.011 + GHOSTS[window], window)
        for window in WINDOWS:
            for x in (12, 18, 20):
                ghosts = np.abs(pictures[window, x] - pictures[(6, 2), x]).max()
                self.assertLess(ghosts, GHOSTS[window], (window, x))

    def test_S34_padding_and_width_pay(self):
        samples = padded(np.random.default_rng(1).random((14, 14, 14)).astype("<f4"))
        best = self.slices(samples, ["--size", "24x24"], (6, 2))
        errors = {window: rms(self.slices(samples, ["--size", "24x24"], window) - best)
                  for window in WINDOWS[:-1]}
        self.assertGreater(errors[4, 1.25], 2 * errors[4, 2])
        self.assertGreater(errors[4, 1.25], 5 * errors[6, 1.25])
        self.assertGreater(errors[4, 1.5], 20 * errors[6, 1.5])
        self.assertLess(errors[6, 1.5], 2e-5 * best.max())


class Slices(Spectrum):
    def test_S35_axis_views_are_sums(self):
        """Odd and even lengths, and views from behind."""
        random = np.random.default_rng(2)
        for shape in ((16, 16, 16), (17, 17, 17), (9, 16, 23), (16, 9, 8), (1, 12, 11), (7, 1, 9)):
            samples = padded(random.random(shape).astype("<f4"))
            size = f"{samples.shape[2]}x{samples.shape[1]}"
            exact = samples.astype("f8").sum(0)
            for angles, expected in (("0,0,0", exact), ("0,0,180", exact[::-1, ::-1]),
                                     ("0,180,0", exact[:, ::-1])):
                made = self.slices(samples, ["--rotate", angles, "--size", size])
                # White noise is the worst there is: tails of the spline beyond the bands that are
                # folded are 1 % of a point.
                self.assertLess(np.abs(made - expected).max(), 0.015 * exact.max(), (shape, angles))
                self.assertLess(rms(made - expected), 0.004 * exact.max(), (shape, angles))

    def blob(self, shape, at, width, spacing):
        z, y, x = [(np.arange(n) - (n - 1) / 2) * s for n, s in zip(shape, spacing[::-1])]
        return np.exp(-((x - at[0]) ** 2 + (y[:, None] - at[1]) ** 2
                        + (z[:, None, None] - at[2]) ** 2) / (2 * width ** 2)).astype("<f4")

    def test_S35_oblique_views_of_a_gaussian_are_gaussians(self):
        """Off the centre, spacings that differ, 45 degrees and others, odd and even lengths: the
        projection is known, sqrt(2 pi) times the width."""
        for shape, spacing in (((40, 41, 42), (1, 1, 1)), ((31, 32, 33), (1.5, 1.25, 1))):
            width, at = 2.6, np.array([3.1, -2.2, 4.3])
            samples = self.blob(shape, at, width, spacing)
            for angles in ((0, 45, 0), (45, 0, 0), (45, 45, 45), (0, 90, 0), (13, -101, 7)):
                size = 61
                made = self.slices(samples, ["--rotate", ",".join(map(str, angles)), "--size",
                                             f"{size}x{size}", ], spacing=spacing)
                u = np.arange(size) - (size - 1) / 2
                seen = turn3(*angles) @ at
                exact = np.sqrt(2 * np.pi) * width * np.exp(
                    -((u - seen[0]) ** 2 + (u[:, None] - seen[1]) ** 2) / (2 * width ** 2))
                # The Gaussian itself is cut off at its spectrum's ends (2e-5 at 1.5 a sample) and
                # at the volume's (6e-7).
                self.assertLess(np.abs(made - exact).max(), 1e-3 * exact.max(), (angles, spacing))

    def test_S35_views_from_behind_are_mirrored(self):
        """Odd symmetry: a sign lost in half of the spectrum shows here."""
        samples = np.random.default_rng(3).random((15, 16, 17)).astype("<f4")
        for angles in ("0,20,0", "33,10,-5"):
            x, y, z = map(float, angles.split(","))
            front = self.slices(samples, ["--rotate", angles, "--size", "33x33"])
            matrix = np.diag([-1, 1, -1]) @ turn3(x, y, z)
            text = ",".join(map(repr, map(float, matrix.ravel())))
            back = self.slices(samples, ["--matrix", text, "--size", "33x33"])
            # Ghosts differ from side to side.
            self.assertLess(np.abs(back - front[:, ::-1]).max(), 2e-4 * front.max())

    def test_S8_S9_the_picture_does_not_wrap_around(self):
        """A volume larger than the picture: what lies beyond its frame must not come in at the
        other side, whole or by Nyquist's share (even periods, lattices shifted by half a pixel)."""
        samples = np.zeros((24, 24, 24), "f4")
        samples[:, 2, :] = 1
        samples[:, :, 21] = 1
        for size in ((8, 8), (9, 8), (24, 9)):
            made = self.slices(samples, ["--size", f"{size[0]}x{size[1]}"])
            exact = self.render(samples, "--mode", "xray", "--spacing", "1", "--size",
                                f"{size[0]}x{size[1]}", "--via",
                                "project.ray_cast/filter=foh/step=1")
            self.assertLess(np.abs(made - exact).max(), 0.01 * 24)


class Ranges(Spectrum):
    def test_S38_detail_of_1_on_an_offset_of_a_million(self):
        """f32 holds 2^19 to 1/16; the commonest value is taken out before anything is summed."""
        random = np.random.default_rng(4)
        detail = np.zeros((24, 24, 24))
        detail[6:18, 6:18, 6:18] = random.integers(0, 16, (12, 12, 12)) / 16
        large = 2.0 ** 19
        words = ["--size", "24x24", "--rotate", "10,20,30"]
        alone = self.slices(detail.astype("<f4"), words)
        made = self.slices((detail + large).astype("<f4"), [*words, "--zero", repr(large)])
        self.assertLess(np.abs(made - alone).max(), 1e-4 * alone.max())

    def test_S38_rays_over_the_same_offset(self):
        random = np.random.default_rng(5)
        detail = random.integers(0, 16, (64, 12, 12)) / 16
        large = 2.0 ** 19
        for edge in ("project.ray_cast/filter=foh/step=1", "project.combine",
                     "project.shear_warp/filter=zoh"):
            made = self.render((detail + large).astype("<f4"), "--mode", "xray", "--zero",
                               repr(large), "--via", edge, "--without", "store")
            self.assertLess(np.abs(made - detail.sum(0)).max(), 1e-3 * detail.sum(0).max(), edge)

    def test_S38_scale_does_not_matter(self):
        samples = np.random.default_rng(6).random((12, 13, 14)).astype("<f4")
        plain = self.slices(samples, ["--rotate", "10,20,30"])
        for scale in (1e-20, 1e-6, 1e6, 1e20):
            scaled = self.slices((samples * np.float32(scale)).astype("<f4"),
                                 ["--rotate", "10,20,30"])
            np.testing.assert_allclose(scaled / scale, plain, atol=2e-5 * plain.max())


class Refused(Spectrum):
    def test_S20_S37_what_no_slice_can_give_is_refused(self):
        samples = np.random.default_rng(7).random((8, 8, 8)).astype("<f4")
        for mode in ("mip", "composite"):
            message = self.render(samples, "--mode", mode, "--via", "spectrum.slice", code=3)
            self.assertIn("does not commute", message)
        message = self.render(samples, "--mode", "xray", "--perspective", "30", "--via",
                              "spectrum.slice", code=3)
        self.assertIn("spectrum.slice: ", message)
        samples[1, 2, 3] = np.nan  # would be everywhere
        message = self.render(samples, "--mode", "xray", "--via", "spectrum.slice", code=3)
        self.assertIn("finite", message)


if __name__ == "__main__":
    main()
