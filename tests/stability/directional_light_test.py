"""X-rays of samples that light falls on, by cast rays and through spectra of gradients, beside f64 sums of scipy's splines along the
rays and beside a blob whose integrals are known. Needs EDGEWISE."""

import numpy as np
from driving import DATA, Driven, main, turn3
from scipy.integrate import quad
from scipy.ndimage import map_coordinates

ALONE = ["--without", "store", "--max-error", "9"]
CAST = ["--via", "project.ray_cast/filter=bspline3/step=0.25"]
FINE = "width=6/padding=2"


def spectra(degree=1, window=FINE):
    return ["--via", f"spectrum.gradients/degree={degree}/{window}"]


def blobs(shape, spacing=(1, 1, 1), seed=1):
    """Smooth, and empty towards the faces."""
    random = np.random.default_rng(seed)
    z, y, x = (i * s for i, s in zip(np.indices(shape), spacing[::-1]))
    samples = np.zeros(shape)
    for _ in range(5):
        c = [n * s * random.uniform(0.38, 0.62) for n, s in zip(shape, spacing[::-1])]
        r2 = (z - c[0])**2 + (y - c[1])**2 + (x - c[2])**2
        samples += random.uniform(20, 90) * np.exp(-r2 / (2 * (2.3 * max(spacing))**2))
    samples[samples < 1e-4] = 0
    return samples.astype("<f4")


class Sums:
    """f64 sums along rays of the cubic spline through samples: of the field, of its gradient, and of what a rule makes of both."""

    def __init__(self, samples, spacing, angles, side, step=0.25):
        turn, size, apart = turn3(*angles), np.array(samples.shape[::-1]), np.array(spacing, float)
        least = apart.min()
        deep = np.abs(turn[2]) @ (size * apart) / 2
        z = np.arange(-deep + step / 2, deep, step)
        at = np.arange(side) - (side - 1) / 2
        zz, yy, xx = np.meshgrid(z, at, at, indexing="ij")
        mm = np.stack([xx, yy, zz])
        self.step = step

        def field(mm):
            p = np.tensordot(turn.T, mm, 1) / apart[:, None, None, None] + ((size - 1) / 2)[:, None, None, None]
            return map_coordinates(samples.astype(float), p[::-1], order=3, mode="grid-constant")

        self.values, h = field(mm), 1e-3
        away = h * np.eye(3)[:, :, None, None, None]
        # Per step along screen z, which is the least spacing.
        self.gradient = np.stack([least * (field(mm + a) - field(mm - a)) / (2 * h) for a in away])
        self.length = np.sqrt((self.gradient**2).sum(0))

    def along(self, light):
        """|g| N.L of each sample, N from high values to low ones."""
        return -np.tensordot(np.array(light[:3]) / np.linalg.norm(light[:3]), self.gradient, 1)

    def lit(self, rule, ambient, diffuse, lights):
        sent = 0
        for light in lights:
            c = self.along(light)
            sent = sent + light[3] * ((self.length + c) / 2 if rule == "hemisphere" else np.maximum(0, c))
        return ((ambient * self.values + diffuse * sent) * self.step).sum(0)


LIGHTS = ((-0.6, -0.3, -0.5, 0.8), (1, 0.2, 0.4, 0.5))


class DirectionalLight(Driven):
    def lit(self, samples, rule, *words, lights=LIGHTS, material=(0.3, 0.9), mode="xray", **more):
        lamps = [w for light in lights for w in ("--light", ",".join(map(str, light)))]
        return self.render(samples, "--mode", mode, "--shade", rule, *lamps, "--material", f"{material[0]},{material[1]},0,1", "--spacing", "1",
                           *words, **more).astype(float)

    def views(self):
        for spacing, angles, shape, side in (((1, 1, 1), (20, 35, -10), (26, 28, 30), 34), ((1, 1, 1.6), (-50, 15, 70), (26, 42, 40), 54)):
            samples = blobs(shape, spacing)
            words = ["--rotate", ",".join(map(str, angles)), "--size", f"{side}x{side}", *ALONE]
            yield samples, spacing, words, Sums(samples, spacing, angles, side)

    def test_rays_beside_sums(self):
        """Midpoints a quarter apart, f32: of smooth samples both are far below what a rule changes."""
        for samples, spacing, words, sums in self.views():
            for rule in ("hemisphere", "lambert"):
                want = sums.lit(rule, 0.3, 0.9, LIGHTS)
                got = self.lit(samples, rule, *words, *CAST, spacing=spacing)
                self.assertLess(np.abs(got - want).max(), 2e-3 * want.max(), (rule, spacing))

    def test_spectra_beside_sums(self):
        for samples, spacing, words, sums in self.views():
            want = sums.lit("hemisphere", 0.3, 0.9, LIGHTS)
            got = self.lit(samples, "hemisphere", *words, *spectra(), spacing=spacing)
            # |g| is a cone where g vanishes, which a spline between samples rounds off.
            self.assertLess(np.abs(got - want).max(), 0.02 * want.max(), spacing)
            self.assertLess(np.sqrt(((got - want)**2).mean()), 0.004 * want.max(), spacing)

    def test_the_derivative_is_exact(self):
        """What differs between a light and its opposite is d times the sum of g.L: no length is in it."""
        light = (-0.6, -0.3, -0.5, 1)
        back = tuple(-x for x in light[:3]) + (1, )
        for samples, spacing, words, sums in self.views():
            want = 0.9 * (sums.along(light) * sums.step).sum(0)
            for extra in (spectra(), ) if spacing[2] > 1 else (spectra(), spectra(2)):
                rule = "hemisphere" if "degree=1" in extra[1] else "lambert"
                got = (self.lit(samples, rule, *words, *extra, lights=[light], spacing=spacing) -
                       self.lit(samples, rule, *words, *extra, lights=[back], spacing=spacing))
                # Ghosts, and what splines have beyond 3/4 of a cycle.
                self.assertLess(np.abs(got - want).max(), 3e-4 * np.abs(want).max(), spacing)

    def test_harmonics_keep_their_bound(self):
        samples, spacing, words, sums = next(self.views())
        lights = LIGHTS[:1]
        want, length = sums.lit("lambert", 0.3, 0.9, lights), (sums.length * sums.step).sum(0)
        errors = []
        for degree, farthest in ((1, 1 / 4), (2, 3 / 32)):
            got = self.lit(samples, "lambert", *words, *spectra(degree), lights=lights, spacing=spacing)
            bound = 0.9 * 0.8 * farthest * length + 0.02 * want.max()
            self.assertLess((np.abs(got - want) / bound).max(), 1, degree)
            errors.append(np.sqrt(((got - want)**2).mean()))
        self.assertLess(errors[1], 0.5 * errors[0])

    def test_without_diffuse_light_it_is_the_plain_picture(self):
        samples, spacing, words, _ = next(self.views())
        plain = self.render(samples, "--mode", "xray", "--spacing", "1", *words, "--via", f"spectrum.forward/{FINE}", "--via",
                            "spectrum.slice", spacing=spacing)
        got = self.lit(samples, "hemisphere", *words, *spectra(), material=(1, 0), spacing=spacing)
        np.testing.assert_allclose(got, plain, rtol=0, atol=2e-6 * plain.max())
        cast = self.lit(samples, "hemisphere", *words, *CAST, material=(0.5, 0), spacing=spacing)
        plain = self.render(samples, "--mode", "xray", "--spacing", "1", *words, *CAST, spacing=spacing)
        np.testing.assert_allclose(cast, 0.5 * plain, rtol=0, atol=2e-6 * plain.max())

    def test_a_blob_by_its_integrals(self):
        """f = exp(-r^2 / 2 s^2) has the gradient -f x / s^2 outwards; its picture is the same in each view."""
        s, n = 5.0, 56
        r2 = ((np.indices((n, n, n)) - (n - 1) / 2)**2).sum(0)
        samples = (100 * np.exp(-r2 / (2 * s * s))).astype("<f4")
        light = np.array((0.6, -0.64, -0.48))

        def integral(x, y):
            def at(z):
                p = np.array((x, y, z))
                f = 100 * np.exp(-p @ p / (2 * s * s))
                return 0.3 * f + 0.9 * f / (s * s) * (np.linalg.norm(p) + p @ light) / 2

            return quad(at, -28, 28, limit=200)[0]

        for angles in ("0,0,0", "33,-20,50"):
            for way, off in ((CAST, 1e-3), (spectra(), 4e-3)):
                got = self.lit(samples, "hemisphere", "--rotate", angles, "--size", "57x57", *ALONE, *way, lights=[(*light, 1)])
                top = got.max()
                for x, y in ((0, 0), (4, 0), (0, -7), (-6, 5), (9, 9)):
                    self.assertAlmostEqual(got[28 + y, 28 + x] / top, integral(x, y) / top, delta=off, msg=f"{angles} {way} {x} {y}")
                self.assertGreater(got[20, 34], got[36, 22])  # light comes from above and the right

    def test_means_and_constants(self):
        """A constant has no gradient. What it counts for is the ambient share, by the length inside."""
        samples = 40 + blobs((24, 26, 28))
        words = ["--rotate", "15,25,5", "--size", "30x30", *ALONE]
        for mode in ("xray", "mean"):
            cast = self.lit(samples, "hemisphere", *words, *CAST, mode=mode)
            got = self.lit(samples, "hemisphere", *words, *spectra(), mode=mode)
            inside = cast > 0.9 * np.median(cast)  # short rays divide by little
            self.assertLess(np.abs(got - cast)[inside].max(), 0.01 * cast.max(), mode)
        flat = np.full((9, 10, 11), 7, "<f4")
        for way in (CAST, spectra()):
            got = self.lit(flat, "hemisphere", "--view", "z", *ALONE, *way)
            np.testing.assert_allclose(got, 0.3 * 7 * 9, rtol=2e-6)

    def test_rays_take_a_cue_and_an_eye_as_well(self):
        samples, _, words, sums = next(self.views())
        faded = self.lit(samples, "hemisphere", *words, *CAST, "--depth-cue", "0.02,linear")
        plain = self.lit(samples, "hemisphere", *words, *CAST)
        self.assertTrue((faded <= plain + 1e-3).all() and faded.max() < 0.9 * plain.max())
        report = self.report("render", self.folder / "in.nrrd", "-o", "null:", "--mode", "xray", "--shade", "lambert", "--perspective", "30",
                             "--depth-cue", "0.01", "--size", "32x32", "--verify", "--max-error", "0.02")
        self.assertLess(report["measured"]["error"]["nrmse"], 0.02)

    def test_predicted_errors_hold(self):
        for source, rule, extra in ((f"{DATA}/mr_brain/MR.nii.gz", "hemisphere", spectra(1, "width=4/padding=1.25")),
                                    (f"{DATA}/mr_brain/MR.nii.gz", "lambert", spectra(2, "width=4/padding=1.25")),
                                    (f"{DATA}/ct_head/quarter.nhdr", "hemisphere", spectra(1)),
                                    (f"{DATA}/ct_head/quarter.nhdr", "lambert", ["--via", "project.ray_cast"])):
            report = self.report("render", source, "-o", "null:", "--mode", "xray", "--shade", rule, "--light", "-1,-1,-1", "--rotate",
                                 "20,30,10", "--size", "64x64", "--verify", "--max-error", "9", *extra)
            error, predicted = report["measured"]["error"]["nrmse"], report["plan"]["predicted"]["error"]
            self.assertLess(error, 1.2 * predicted, (source, rule))
            self.assertGreater(error, predicted / 20, (source, rule))

    def test_bytes_do_not_hang_on_threads(self):
        samples, _, words, _ = next(self.views())
        for way in (spectra(2), CAST):
            one, two = (self.lit(samples, "lambert", *words, *way, "--threads", threads) for threads in ("1", "2"))
            np.testing.assert_array_equal(one, two)

    def test_refusals(self):
        samples = blobs((12, 13, 14))
        for words, says in ((("--mode", "xray", "--shade", "phong"), "--shade: phong is not of --mode xray"),
                            (("--mode", "composite", "--shade", "hemisphere"), "--shade: hemisphere is not of --mode composite"),
                            (("--mode", "surface", "--isovalue", "9", "--shade", "particles"), "--shade: particles is not of --mode surface"),
                            (("--mode", "mip", "--shade", "hemisphere"), "--shade: of --mode"),
                            (("--mode", "xray", "--light", "1,0,0"), "--light: of --shade hemisphere, lambert only"),
                            (("--mode", "mip", "--light", "1,0,0"), "--light: of modes that light falls on"),
                            (("--mode", "xray", "--shade", "hemisphere", "--shadows"), "--shadows"),
                            (("--mode", "mean", "--shade", "lambert", "--ambient-occlusion", "4"), "--ambient-occlusion"),
                            (("--mode", "xray", "--shade", "lambert", "--phase", "0.2"), "--phase")):
            self.assertIn(says, self.render(samples, *words, code=2), words)
        lit = ("--mode", "xray", "--shade", "hemisphere")
        for words, says in (((*lit, *spectra(2)), "light from a hemisphere is of degree 1"),
                            ((*lit, "--depth-cue", "0.01", *spectra()), "light falls off along rays"),
                            ((*lit, "--perspective", "30", *spectra()), "parallel rays"),
                            ((*lit, "--via", "spectrum.slice"), "light depends on gradients"),
                            (("--mode", "xray", *spectra()), "no light falls on samples")):
            self.assertIn(says, self.render(samples, *words, code=3), words)
        # Two views, the second of which is twice as wide.
        stretched = self.folder / "views.txt"
        stretched.write_text("1 0 0 0 1 0 0 0 1\n2 0 0 0 1 0 0 0 1\n")
        said = self.run_it("render", self.folder / "in.nrrd", "-o", self.folder / "o_%d.nrrd", *lit, "--path", stretched, *spectra(), code=3).stderr
        self.assertIn("views that stretch the volume", said)


if __name__ == "__main__":
    main()
