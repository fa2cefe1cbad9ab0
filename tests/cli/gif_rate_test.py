"""Delays of animations: viewers show a picture of a GIF for 0.02 s at least, or for 0.1 s. Needs EDGEWISE."""

import json
import struct
import unittest

from running import Running

SOURCE = ("phantom:gaussians:16", "--size", "8x8", "--mode", "xray")


def gif_delays(data):
    """Hundredths of a second of each picture, by the blocks of GIF 89a."""
    at = 13 + (3 << ((data[10] & 7) + 1) if data[10] & 0x80 else 0)
    delays, pictures = [], 0
    while data[at] != 0x3b:
        if data[at] == 0x21:
            if data[at + 1] == 0xf9:
                delays.append(struct.unpack_from("<H", data, at + 4)[0])
            at += 2
        else:
            assert data[at] == 0x2c
            pictures += 1
            flags = data[at + 9]
            at += 11 + (3 << ((flags & 7) + 1) if flags & 0x80 else 0)
        while data[at]:
            at += 1 + data[at]
        at += 1
    assert pictures == len(delays)
    return delays


def apng_delays(data):
    at, delays = 8, []
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"fcTL":
            top, bottom = struct.unpack_from(">HH", data, at + 8 + 20)
            delays.append(top / bottom)
        at += 12 + length
    return delays


class GifRate(Running):
    def film(self, name, frames, fps, *more):
        done = self.run_it("render", *SOURCE, "--turntable", frames, "--fps", fps, "-o", self.folder / name, "--json", "-", *more)
        return (self.folder / name).read_bytes(), json.loads(done.stdout)

    def test_more_than_fifty_a_second_leave_frames_out_and_say_it(self):
        for fps, frames, left_out in ((60, 30, 5), (100, 10, 5), (75, 9, 3), (59.94, 12, 2)):
            with self.subTest(fps=fps):
                data, report = self.film("t.gif", frames, fps)
                delays = gif_delays(data)
                self.assertEqual(len(delays), frames - left_out)
                self.assertGreaterEqual(min(delays), 2)
                self.assertAlmostEqual(sum(delays), 100 * frames / fps, delta=.5 + 1e-9)
                self.assertEqual(report["request"]["frames"], frames)
                self.assertEqual(len(report["warnings"]), 1, report["warnings"])
                for word in (f"{left_out} of {frames} frames", "0.02 s", "--fps 50", ".apng"):
                    self.assertIn(word, report["warnings"][0])

    def test_up_to_fifty_all_frames_are_kept_and_delays_last_as_long_as_asked(self):
        for fps in (50, 40, 30, 24, 15, 7):
            with self.subTest(fps=fps):
                data, report = self.film("t.gif", 17, fps)
                delays = gif_delays(data)
                self.assertEqual((len(delays), report["warnings"]), (17, []))
                self.assertGreaterEqual(min(delays), 2)
                self.assertAlmostEqual(sum(delays), 1700 / fps, delta=.5 + 1e-9)
                self.assertLessEqual(max(delays) - min(delays), 1)

    def test_channels_in_colours_likewise(self):
        import files
        import numpy as np
        source = self.folder / "two.nrrd"
        files.write_nrrd(source, np.random.default_rng(1).integers(0, 255, (6, 7, 8, 2)).astype("u1"))
        done = self.run_it("render", source, "--channel", "0,1", "--turntable", 12, "--fps", 60, "-o", self.folder / "two.gif", "--json", "-",
                           "--size", "8x8")
        self.assertEqual(len(gif_delays((self.folder / "two.gif").read_bytes())), 10)
        self.assertTrue(any("2 of 12 frames" in w for w in json.loads(done.stdout)["warnings"]))

    def test_an_apng_keeps_all(self):
        data, report = self.film("t.apng", 12, 60)
        self.assertEqual(apng_delays(data), [1 / 60] * 12)
        self.assertEqual(report["warnings"], [])


if __name__ == "__main__":
    unittest.main()
