"""Where filters fail: running sums that drift, integers through transforms, borders that depend on the algorithm (S41)."""

import json

import numpy as np
from driving import Driven, main, read_nrrd, write_nrrd
from scipy import ndimage


class Neighbourhoods(Driven):
    def filtered(self, a, *words):
        source, out = self.folder / "in.nrrd", self.folder / "out.nrrd"
        write_nrrd(source, a)
        done = self.run_it("filter", source, "-o", out, "--json", "-", "--quiet", *words)
        self.path = [step["transition"] for step in json.loads(done.stdout)["plan"]["steps"]]
        return read_nrrd(out).reshape(a.shape)

    def test_S41_running_sums_do_not_drift(self):
        """A large value that leaves the box leaves nothing behind (opencv#7127: sums that go negative)."""
        a = np.zeros((1, 40, 400), "<f4")
        a[0, 20, 30] = 3e7
        a[0, :, 200:] = 1e-3
        got = self.filtered(a, "--op", "convolve", "--kernel", "box:4", "--via", "filter.running")
        self.assertTrue((got[0, :, 40:190] == 0).all())
        self.assertTrue((got >= 0).all())
        np.testing.assert_allclose(got[0, :, 210:390], 1e-3, rtol=1e-6)

    def test_S41_integers_through_a_transform_are_exact(self):
        """Whole weights on integers give integers (opencv#22243)."""
        random = np.random.default_rng(3)
        a = random.integers(0, 255, (1, 120, 150)).astype("u1")
        weights = random.integers(0, 2, (1, 15, 15)).astype("<f4")
        write_nrrd(self.folder / "k.nrrd", weights)
        words = ["--op", "correlate", "--kernel", self.folder / "k.nrrd", "--via", "filter.fourier"]
        want = ndimage.correlate(a.astype("f8"), weights.astype("f8"), mode="mirror")
        np.testing.assert_array_equal(self.filtered(a, *words), np.clip(want, 0, 255))
        np.testing.assert_array_equal(self.filtered(a // 64, *words), np.clip(ndimage.correlate((a // 64).astype("f8"), weights.astype("f8"), mode="mirror"), 0, 255))

    def test_S41_borders_do_not_depend_on_the_size(self):
        """Small and large kernels go other ways and see the same samples beyond the border (opencv#10683)."""
        a = np.random.default_rng(4).random((1, 60, 70)).astype("<f4")
        paths = set()
        for k in (3, 9, 11, 13, 31):
            weights = np.random.default_rng(k).random((1, k, k)).astype("<f4") / k**2
            write_nrrd(self.folder / "k.nrrd", weights)
            for border, mode in (("mirror", "mirror"), ("clamp", "nearest"), ("wrap", "wrap"), ("zero", "constant")):
                got = self.filtered(a, "--op", "correlate", "--kernel", self.folder / "k.nrrd", "--border", border)
                np.testing.assert_allclose(got, ndimage.correlate(a.astype("f8"), weights.astype("f8"), mode=mode), atol=2e-6)
                paths.update(self.path)
        self.assertGreaterEqual(len(paths), 2, paths)

    def test_S41_extremes_at_borders_are_those_of_samples(self):
        a = np.random.default_rng(5).integers(50, 200, (1, 30, 33)).astype("u1")
        for edge in ("backward", "runs", "van_herk"):
            for op, function in (("dilate", ndimage.grey_dilation), ("erode", ndimage.grey_erosion)):
                got = self.filtered(a, "--op", op, "--kernel", "box:20", "--border", "clamp", "--via", f"filter.{edge}")
                np.testing.assert_array_equal(got[0], function(a[0], size=(41, 41), mode="nearest"))


if __name__ == "__main__":
    main()
