"""Volumes and images from k-space, beside numpy's transforms. Needs EDGEWISE."""

import json
import unittest

import files
import numpy as np
from running import Running


def kspace_of(samples):
    """Frequency 0, and the sample that phases count from, are number n / 2."""
    return np.fft.fftshift(np.fft.fftn(np.fft.ifftshift(samples)))


class KSpace(Running):
    def written(self, numbers, name="k:space.bin", kind="<c8", before=b""):
        path = self.folder / name
        path.write_bytes(before + numbers.astype(kind).tobytes())
        return path

    def read(self, source, *words):
        out = self.folder / "out.nrrd"
        self.run_it("warp", source, "-o", out, "--quiet", *words)
        return files.read(out)[..., 0].astype(float)

    def test_magnitudes_of_volumes_and_images(self):
        random = np.random.default_rng(2)
        for shape in ((6, 9, 12), (7, 5, 11), (1, 8, 9), (10, 13)):
            samples = random.uniform(0, 1000, shape)
            # A phase that varies smoothly, as a coil's does: magnitudes do not see it.
            phase = np.exp(2j * np.pi * np.indices(shape).sum(0) / 20)
            size = "x".join(map(str, shape[::-1]))
            for numbers, options, kind, before in ((samples, "", "<c8", b""), (samples * phase, ":big", ">c8", b""),
                                                   (samples * phase, ":little:7", "<c8", b"headers")):
                path = self.written(kspace_of(numbers), kind=kind, before=before)
                got = self.read(f"kspace:{path}:{size}{options}")
                np.testing.assert_allclose(got.reshape(shape), samples, rtol=0, atol=1e-3)

    def test_all_commands_read_it(self):
        samples = np.zeros((16, 18, 20))
        samples[5:11, 6:12, 7:15] = 100
        source = f"kspace:{self.written(kspace_of(samples))}:20x18x16"
        info = json.loads(self.run_it("info", source, "--json", "-").stdout)
        self.assertEqual(info["extent"], [20, 18, 16])
        out = self.folder / "x.nrrd"
        done = self.run_it("render", source, "-o", out, "--mode", "xray", "--view", "z", "--size", "native", "--verify", "--json", "-", "--quiet")
        self.assertLess(json.loads(done.stdout)["measured"]["error"]["nrmse"], 1e-2)
        np.testing.assert_allclose(files.read(out)[0, ..., 0], samples.sum(0), rtol=0, atol=0.1)
        spectra = self.run_it("render", source, "-o", out, "--mode", "xray", "--size", "native", "--via", "spectrum.slice", "--max-error", "9", "--json", "-", "--quiet")
        self.assertIn("spectrum.forward", spectra.stdout.decode())

    def test_refusals(self):
        path = self.written(kspace_of(np.ones((4, 4, 4))))
        for source, code, says in ((f"kspace:{path}", 2, "no extent"), (f"kspace:{path}:4x4x4:f32", 2, "expected"),
                                   (f"kspace:{path}:0x4x4", 2, "'0x4x4' is no extent"), (f"kspace:{path}:4x4x4x4", 2, "axes"),
                                   (f"kspace:{path}:4x4x5", 4, ""), (f"kspace:{path}:99999999999999999999x4", 2, "no extent"),
                                   (f"kspace:{self.folder}/none:4x4x4", 4, "none")):
            done = self.run_it("warp", source, "-o", self.folder / "o.nrrd", code=code)
            self.assertIn(says, done.stderr.decode(), source)
        numbers = kspace_of(np.ones((4, 4, 4)))
        numbers[1, 2, 3] = np.nan
        done = self.run_it("warp", f"kspace:{self.written(numbers)}:4x4x4", "-o", self.folder / "o.nrrd", code=4)
        self.assertIn("sample 27 is not finite", done.stderr.decode())
        self.assertFalse((self.folder / "o.nrrd").exists())


if __name__ == "__main__":
    unittest.main()
