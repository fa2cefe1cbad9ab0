"""What `info` measures of samples beside their range: histogram, power by frequency, dynamic range. Compared with
numpy's FFT of the whole data, and with spectra that are known."""
import itertools
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

EDGEWISE = os.environ["EDGEWISE"]
RING = 1 / 32  # cycles a sample
# A Hann window makes neighbouring frequencies alike: the variance of a mean of powers grows by 1.94 an axis
# (sum over all distances d of the correlation r(d)^2 = 1, 4/9, 1/36 for d = 0, 1, 2, on both sides).
ALIKE = 1 + 2 * (4 / 9 + 1 / 36)


def ring_of(lengths):
    """Ring of every frequency of an FFT."""
    f = np.meshgrid(*(np.fft.fftfreq(n) for n in lengths), indexing="ij")
    return np.floor(np.sqrt(sum(x * x for x in f)) / RING + 0.5).astype(int)


def expected_power(volume, side):
    """Mean power by ring of windowed bricks at all places of a periodic volume: its autocorrelation, from the FFT of
    all of it, times that of the window."""
    n = volume.size
    correlation = np.fft.ifftn(np.abs(np.fft.fftn(volume - volume.mean())) ** 2).real / n
    window = np.sin(np.pi * (np.arange(side) + 0.5) / side) ** 2
    lags = np.correlate(window, window, "full")
    folded = correlation
    for axis in range(volume.ndim):
        taken = np.take(folded, np.arange(1 - side, side), axis=axis)
        shape = [1] * volume.ndim
        shape[axis] = -1
        taken = taken * lags.reshape(shape) / lags[side - 1]
        positive = np.take(taken, np.arange(side - 1, 2 * side - 1), axis=axis)
        negative = np.take(taken, np.arange(0, side - 1), axis=axis)  # lags 1 - side ... -1 are 1 ... side - 1
        pad = [(0, 0)] * volume.ndim
        pad[axis] = (1, 0)
        folded = positive + np.pad(negative, pad)
    power = np.fft.fftn(folded).real / side ** volume.ndim
    return np.bincount(ring_of(power.shape).ravel(), power.ravel())


def filtered_noise(shape, seed):
    """Random numbers whose power falls with frequency, periodic."""
    f = np.meshgrid(*(np.fft.fftfreq(n) for n in shape), indexing="ij")
    fall = 1 / (1 + (sum(x * x for x in f)) / 0.1 ** 2)
    noise = np.random.default_rng(seed).standard_normal(shape)
    return np.fft.ifftn(np.fft.fftn(noise) * fall).real


def tiles_of(n, side):
    """First samples of tiles along an axis; where they do not fit, they overlap."""
    count = -(-n // side)
    return [i * (n - side) // (count - 1) if count > 1 else 0 for i in range(count)]


def power_of_all_bricks(volume, side=32):
    """Power by ring of every windowed brick in which something varies."""
    ring = ring_of((side,) * 3).ravel()
    powers = []
    for first in itertools.product(*(tiles_of(n, side) for n in volume.shape)):
        brick = volume[tuple(slice(at, at + side) for at in first)].astype("f8")
        if brick.min() == brick.max():
            continue
        window = np.ones(())
        for n in brick.shape:
            window = window[..., None] * np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
        varying = (brick - (brick * window).sum() / window.sum()) * window
        power = np.abs(np.fft.fftn(varying, (side,) * 3)) ** 2 / ((window ** 2).sum() * side ** 3)
        powers.append(np.bincount(ring, power.ravel()))
    return np.array(powers)


def by_octave(power):
    """Columns: the parts up to 1/16, 1/8, 1/4, 1/2 cycles a sample and beyond."""
    f = RING * np.arange(power.shape[-1])
    ends = [-1, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 2]
    return np.stack([power[..., (f > low) & (f <= high)].sum(-1) for low, high in zip(ends, ends[1:])], -1)


class Info(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def report(self, name):
        run = subprocess.run([EDGEWISE, "info", name, "--json", "-"], capture_output=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        return json.loads(run.stdout)

    def info(self, samples, kind):
        path = pathlib.Path(self.folder.name) / "a.raw"
        samples.tofile(path)
        extent = "x".join(str(n) for n in reversed(samples.shape))
        return self.report(f"raw:{path}:{extent}:{kind}")

    def test_rings_hold_the_power_that_the_fft_of_the_whole_volume_has(self):
        for shape, side in (((96, 64, 64), 32), ((256, 384), 128)):
            with self.subTest(shape=shape):
                volume = filtered_noise(shape, 5) * 40 + 7
                spectrum = self.info(volume.astype("<f4"), "f32")["spectrum"]
                power = np.array(spectrum["power"])
                expected = expected_power(volume, side)
                self.assertEqual(len(power), len(expected))
                np.testing.assert_allclose(spectrum["frequency"], RING * np.arange(len(power)))
                rings = np.bincount(ring_of((side,) * len(shape)).ravel())
                np.testing.assert_allclose(spectrum["share"], rings / rings.sum())
                self.assertEqual(spectrum["empty"], 0)
                # A power varies by itself, a ring has half as many independent ones as frequencies, in each brick;
                # 4 standard deviations. A brick's mean is taken away: what the window makes of it is in rings 0 to 2.
                spread = np.sqrt(ALIKE ** len(shape) * 2 / (rings * spectrum["bricks"]))
                for ring in range(3, len(power)):
                    self.assertLess(abs(power[ring] / expected[ring] - 1), 4 * spread[ring], ring)

    def test_a_few_bricks_tell_where_in_the_band_the_power_of_scans_lies(self):
        """Against all bricks: 4 standard errors of a share that is a ratio of means over as many bricks, drawn
        without putting back (Cochran 1977, 6.4 and 2.6)."""
        shared = os.environ.get("EDGEWISE_SHARED")
        if not shared or not pathlib.Path(shared, "data").is_dir():
            self.skipTest("no shared data")
        types = {"uint8": "u1", "int16": "<i2", "uint16": "<u2", "float": "<f4"}
        # The first is a neuron: a thousandth of its samples are not 0.
        for name in ("mic_neuron_tiff/neuron.tif", "mr_angio_nifti/chris_MRA.nii.gz", "ct_stent_raw/stent.json",
                     "mr_brain_nifti/MR.nii.gz", "ct_engine_nifti/engine.nii.gz"):
            with self.subTest(name=name):
                file, out = pathlib.Path(shared, "data", name), pathlib.Path(self.folder.name, "a.nrrd")
                subprocess.run([EDGEWISE, "warp", file, "-o", out, "--reference", "nearest", "--quiet"], check=True)
                head, _, samples = out.read_bytes().partition(b"\n\n")
                head = dict(line.split(": ", 1) for line in head.decode().split("\n") if ": " in line)
                self.assertEqual(head["encoding"], "raw")
                extent = [int(n) for n in head["sizes"].split()]
                volume = np.frombuffer(samples, types[head["type"]]).reshape(extent[::-1])
                powers = by_octave(power_of_all_bricks(volume))
                expected = powers.mean(0) / powers.sum(1).mean()
                spectrum = self.report(str(file))["spectrum"]
                bricks, all_bricks = spectrum["bricks"], len(powers)
                self.assertEqual(bricks, min(16, all_bricks))
                found = by_octave(np.array(spectrum["power"]))
                away = powers - expected * powers.sum(1, keepdims=True)
                error = away.std(0) / np.sqrt(bricks) / powers.sum(1).mean() * np.sqrt(1 - bricks / all_bricks)
                for share, right, spread in zip(found / found.sum(), expected, error):
                    self.assertLess(abs(share - right), 4 * spread)

    def test_nothing_varies_only_where_it_is_true(self):
        # One sample of a large volume; and two halves that meet where bricks do.
        one = np.zeros((200, 200, 200), "u1")
        one[77, 191, 130] = 9
        halves = np.zeros((64, 96, 128), "<f4")
        halves[:, :, 64:] = 1
        for volume, kind in ((one, "u1"), (halves, "<f4")):
            report = self.info(volume, {"u1": "u8", "<f4": "f32"}[kind])
            self.assertGreater(report["spectrum"]["bricks"], 0)
            self.assertGreater(sum(report["spectrum"]["power"]), 0)
        # All waves of a single sample are alike: what its brick's mean takes away is in rings 0 to 2.
        spectrum = self.info(one, "u8")["spectrum"]
        power, share = np.array(spectrum["power"]), np.array(spectrum["share"])
        self.assertEqual(spectrum["bricks"], 1)
        np.testing.assert_allclose(power[4:] / share[4:], power[-1] / share[-1], rtol=1e-4)

    def test_band_limited_phantoms_have_nothing_above_their_band(self):
        # Waves of up to 0.2 cycles a sample. A Hann window's side lobes fall as (pi d^3)^-2 / 2 with the distance d in
        # frequencies of the brick; beyond 3/8 lie those of d > 5: 1e-5 of the power for each axis.
        noise = self.report("phantom:noise:96")["spectrum"]
        power, f = np.array(noise["power"]), np.array(noise["frequency"])
        self.assertLess(power[f > 3 / 8].sum(), 1e-4 * power.sum())
        self.assertGreater(power[f <= 0.2 + 2 * RING].sum(), 0.99 * power.sum())
        # 24 cosines of amplitude 1/48 have a mean square of 24/48^2/2; a brick sees them with weights, a quarter more
        # or less.
        self.assertAlmostEqual(power.sum() / (24 / 48 ** 2 / 2), 1, delta=0.25)

        # Gaussians of standard deviations from 0.03 * 128 samples: at 3/16 cycles a sample exp(-2 (pi 3.84 3/16)^2)
        # of them is left, 4e-5 in power.
        smooth = self.report("phantom:gaussians:128")["spectrum"]
        power, f = np.array(smooth["power"]), np.array(smooth["frequency"])
        self.assertLess(power[f > 3 / 8].sum(), 1e-5 * power.sum())
        self.assertGreater(power[f <= 3 / 16].sum(), 0.999 * power.sum())

    def test_white_noise_is_white_and_has_the_dynamic_range_of_its_deviation(self):
        volume = np.random.default_rng(3).integers(0, 256, (64, 64, 64), dtype="u1")
        report = self.info(volume, "u8")
        power, share = (np.array(report["spectrum"][key]) for key in ("power", "share"))
        variance = (256 ** 2 - 1) / 12
        rings = share * 32 ** 3
        spread = np.sqrt(ALIKE ** 3 * 2 / (rings * 8))
        for ring in range(3, len(power)):
            self.assertLess(abs(power[ring] / (share[ring] * variance) - 1), 4 * spread[ring])
        # All frequencies beyond 3/8, some 70 % of 8 * 32^3: 4 standard deviations are 3 % of the power, 0.15 dB.
        self.assertAlmostEqual(report["dynamic_range"], 20 * np.log10(255 / np.sqrt(variance)), delta=0.15)

    def test_histograms_count(self):
        random = np.random.default_rng(9)
        small = random.integers(3, 200, (40, 50, 60), dtype="u1")
        histogram = self.info(small, "u8")["histogram"]
        self.assertEqual((histogram["low"], histogram["high"]), (2.5, 199.5))
        self.assertEqual(histogram["counts"], np.bincount(small.ravel(), minlength=200)[3:].tolist())

        wide = (random.standard_normal((40, 50, 60)) * 3000).clip(-20000, 20000).astype("<i2")
        histogram = self.info(wide, "i16")["histogram"]
        edges = np.linspace(histogram["low"], histogram["high"], len(histogram["counts"]) + 1)
        self.assertEqual(histogram["counts"], np.histogram(wide, edges)[0].tolist())
        self.assertEqual((edges[1] - edges[0]) % 1, 0)  # whole numbers, as many in each bin
        self.assertLessEqual(len(histogram["counts"]), 256)

        large = random.random((120, 128, 128)).astype("<f4") ** 2
        histogram = self.info(large, "f32")["histogram"]
        counts = np.array(histogram["counts"])
        self.assertEqual(len(counts), 256)
        self.assertEqual(counts.sum(), histogram["samples"])
        self.assertLess(counts.sum(), large.size)
        edges = np.linspace(histogram["low"], histogram["high"], 257)
        share = np.histogram(large.astype("f8"), edges)[0] / large.size
        # A drawn count varies as its root; 5 standard deviations for 256 bins at once, and one for rounded edges.
        self.assertTrue((abs(counts - share * counts.sum()) < 5 * np.sqrt(share * counts.sum()) + 1).all())

    def test_what_is_not_finite_or_empty_does_not_spread(self):
        volume = np.zeros((96, 64, 64), "<f4")
        volume[:40, :40, :40] = filtered_noise((40, 40, 40), 1) * 5
        clean = self.info(volume, "f32")
        self.assertGreater(clean["spectrum"]["empty"], 0)
        self.assertEqual(clean["spectrum"]["bricks"] + clean["spectrum"]["empty"], 12)
        holes = volume.copy()
        holes[5, 6, 7], holes[20, 3, 30], holes[90, 60, 60] = np.nan, np.inf, -np.inf
        report = self.info(holes, "f32")
        self.assertEqual(report["non_finite"], 3)
        counts = report["histogram"]["counts"]
        self.assertEqual(sum(counts), report["histogram"]["samples"] - 3 if holes.size <= 2 ** 18 else sum(counts))
        power, before = (np.array(r["spectrum"]["power"]) for r in (report, clean))
        self.assertTrue(np.isfinite(power).all())
        # Two samples become the mean of their brick: what is taken away is less than 2 squares of the greatest
        # deviation over the 32^3 * 0.375^3 that a window weighs, of two bricks of those that count.
        most = 2 * (abs(volume).max() * 2) ** 2 / (32 ** 3 * 0.375 ** 3) / clean["spectrum"]["bricks"] * 2
        self.assertLess(abs(power.sum() - before.sum()), 2 * np.sqrt(most * before.sum()) + most)

        for constant in (np.full((9, 8, 7), 3, "<f4"), np.full((9, 8, 7), np.nan, "<f4"), np.full((1, 1, 1), 2, "<f4")):
            report = self.info(constant, "f32")
            self.assertEqual(report["spectrum"]["bricks"], 0)
            self.assertEqual(sum(report["spectrum"]["power"]), 0)
            self.assertIsNone(report["dynamic_range"])
        self.assertEqual(self.info(np.full((9, 8, 7), np.nan, "<f4"), "f32")["histogram"]["counts"], [])

    def test_the_cost_has_a_limit_and_the_answer_is_the_same_again(self):
        for name in ("phantom:shepp-logan:40", "phantom:marschner-lobb:150"):
            report = self.report(name)
            self.assertLessEqual(report["spectrum"]["samples"], 32 * 32 ** 3)
            self.assertLessEqual(report["histogram"]["samples"], 2 ** 18)
            self.assertEqual(report, self.report(name))


if __name__ == "__main__":
    unittest.main()
