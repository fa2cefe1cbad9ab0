"""Pictures of the bundled heads by forward algorithms: samples scaled to equal spacing, moved by a permutation, combined.

Their voxels are no cubes, so views scale volume (by 4.55 the CT's, by 1.11 the MR's), and no permutation fits before a grid of equal
spacing has been made ([W93] 3.7). Pictures are compared with numpy and scipy, errors with what was predicted: of a corner of either head, and once of
all of the CT's, since work in numpy grows with the cube of a side. Needs EDGEWISE and EDGEWISE_DATA."""

import json
import struct
import unittest

import files
import numpy as np
from running import DATA, Running, corner_of_mr_head
from scipy import ndimage

EPS = 2.0**-24
POINTS = [(150.0, 0.0, (0.9, 0.2, 0.1)), (400.0, 0.02, (0.9, 0.5, 0.3)), (3000.0, 0.2, (1.0, 1.0, 0.9))]
TURNS = [(0, 0, 0), (30, 20, 10), (200, -75, 130)]
COMBINED = ["warp.permutation/filter={}", "project.combine"]
PRODUCT = ["project.parallel_product/filter={}"]


def ct_head():
    """Samples [z, y, x] and their spacing, x first."""
    slices = [np.frombuffer((DATA / f"ct_head/quarter.{i}").read_bytes(), "<i2").reshape(64, 64) for i in range(1, 94)]
    return np.stack(slices).astype(float), np.array([3.2, 3.2, 1.5])


def write_nrrd(path, volume, spacing):
    path.write_bytes(f"NRRD0004\ntype: int16\ndimension: 3\nsizes: {' '.join(map(str, volume.shape[::-1]))}\n"
                     f"spacings: {' '.join(map(str, spacing))}\nendian: little\nencoding: raw\n\n".encode() + volume.tobytes())


def nifti(path):
    """Samples [z, y, x] and their spacing, x first."""
    data = path.read_bytes()
    n, spacing = struct.unpack_from("<8h", data, 40)[1:4], struct.unpack_from("<8f", data, 76)[1:4]
    offset, slope, inter = struct.unpack_from("<3f", data, 108)
    volume = np.frombuffer(data, "u1", int(np.prod(n)), int(offset)).reshape(n[::-1])
    return volume * float(slope) + float(inter), np.array(spacing, float)


CT, MR = DATA / "ct_head/quarter.nhdr", DATA / "mr_brain/MR.nii.gz"


def turn_of(a, b, c):
    """Rz(c) Ry(b) Rx(a) [degree]."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.radians([a, b, c])), np.sin(np.radians([a, b, c]))
    return (np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]]) @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]]) @
            np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]))


class Scaled:
    """A volume on a grid of its smallest spacing, as many places as cover it, about its middle."""

    def __init__(self, volume, spacing):
        self.unit = spacing.min()
        self.n = np.array(volume.shape[::-1])
        self.steps = self.unit / spacing  # from place to place [sample]
        self.extent = np.ceil(self.n / self.steps - 1e-9).astype(int)
        at = [np.clip((np.arange(m) - (m - 1) / 2) * step + (n - 1) / 2, 0, n - 1)
              for m, step, n in zip(self.extent, self.steps, self.n)]
        z, y, x = np.meshgrid(at[2], at[1], at[0], indexing="ij")
        self.volume, self.source = ndimage.map_coordinates(volume, [z, y, x], order=1, mode="nearest"), volume

    def rays(self, turn, screen):
        """Of the samples of a screen [z, y, x]: places in the grid and in the volume, x first, and what each stands for along
        its ray, from the part of the ray inside the volume; 0 where it lies outside of it."""
        z, y, x = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in screen[::-1]), indexing="ij")
        from_middle = np.stack([x, y, z], -1) @ turn  # the inverse of a turn is its transpose
        at = from_middle * self.steps + (self.n - 1) / 2
        # The slabs of the faces, along z of the screen.
        along = turn[2] * self.steps
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = ((face - at[0]) / along for face in (-0.5, self.n - 0.5))
            parallel = np.abs(along) < 1e-12
            within = (at[0] >= -0.5) & (at[0] <= self.n - 0.5)
            low = np.where(parallel, np.where(within, -np.inf, np.inf), np.minimum(one, other)).max(-1) + 1e-6
            high = np.where(parallel, np.where(within, np.inf, -np.inf), np.maximum(one, other)).min(-1) - 1e-6
        k = np.arange(screen[2])[:, None, None]
        inside = (k >= low) & (k <= high)
        begin, end = np.where(k - 1 < low, low, k - 0.5), np.where(k + 1 > high, high, k + 0.5)
        return from_middle + (self.extent - 1) / 2, at, np.where(inside, end - begin, 0)


def read(volume, at, order=1):
    """Trilinear, x first."""
    return ndimage.map_coordinates(volume, at[..., ::-1].reshape(-1, 3).T, order=order, mode="nearest").reshape(at.shape[:-1])


def picture_of(mode, values, lengths, unit, least):
    """What a mode makes of samples [z, y, x] and the lengths that they stand for [unit]."""
    if mode == "mip":
        return np.where(lengths > 0, values, least).max(0)
    if mode == "xray":
        return (values * lengths).sum(0) * unit
    if mode == "mean":
        length = lengths.sum(0)
        return np.where(length > 0, (values * lengths).sum(0) / np.where(length > 0, length, 1), least)
    at = np.array([p[0] for p in POINTS])
    opacity = np.interp(values, at, [p[1] for p in POINTS])
    light, left = np.zeros(values.shape[1:] + (3,)), np.ones(values.shape[1:])
    for plane, alpha, length in zip(values, opacity, lengths):
        kept = (1 - alpha) ** (length * unit)
        colour = np.stack([np.interp(plane, at, [p[2][c] for p in POINTS]) for c in range(3)], -1)
        light += (left * (1 - kept))[..., None] * colour
        left = left * kept
    return light


class Forward(Running):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        volume, spacing = ct_head()
        # Odd sides, and air beside skull and brain as in the head.
        part = volume[31:, 9:52, :35]
        cls.ct, cls.mr = cls.folder / "ct.nrrd", corner_of_mr_head(cls.folder)
        write_nrrd(cls.ct, part.astype("<i2"), spacing)
        cls.whole = Scaled(volume, spacing)
        cls.heads = {cls.ct: Scaled(part, spacing), cls.mr: Scaled(*nifti(cls.mr))}
        cls.transfer = cls.folder / "transfer.json"
        cls.transfer.write_text(json.dumps({"points": [{"value": v, "opacity": a, "color": c} for v, a, c in POINTS], "unit": 1.0}))

    def request(self, head, mode, turn, via, filter="foh", scale="foh"):
        words = ["render", head, "--mode", mode, "--view", "z", "--rotate", ",".join(map(str, turn)), "--max-error", "9",
                 "--size", "native", "--via", f"warp.scale/filter={scale}"]
        if mode == "composite":
            words += ["--transfer", self.transfer]
        if mode == "xray":
            words += ["--zero", "0"]
        return words + [word for edge in via for word in ("--via", edge.format(filter))]

    def rendered(self, *words):
        """The picture as a file has it, and the report."""
        out = self.folder / "p.nrrd"
        report = json.loads(self.run_it(*words, "-o", out, "--quiet", "--json", "-").stdout)
        return files.read(out)[0].astype(float), report

    def screen_of(self, head, turn):
        report = self.rendered(*self.request(head, "mip", turn, COMBINED))[1]
        step = next(s for s in report["plan"]["steps"] if s["transition"] == "warp.permutation")
        return tuple(map(int, step["to"].split("/")[-1].split("x")))

    def test_pictures_are_those_of_brute_force(self):
        for name, head, turns in ((self.ct, self.heads[self.ct], TURNS), (self.mr, self.heads[self.mr], TURNS[1:2]), (CT, self.whole, TURNS[1:2])):
            least, most = head.source.min(), head.source.max()
            for turn in turns:
                screen = self.screen_of(name, turn)
                at, _, lengths = head.rays(turn_of(*turn), screen)
                values = read(head.volume, at)
                # Positions are kept to 2^-22 of a sample, along which three axes change by the range at most; scaling rounds
                # some twenty numbers by 2^-24, the permutation's sums as many.
                sample = (12 + 20 + 20) * EPS * (most - least)
                bounds = {"mip": sample, "mean": sample + screen[2] * EPS * most,
                          "xray": screen[2] * head.unit * (sample + screen[2] * EPS * most),
                          # Light that is left behind 1 - 2^-12 of it ends a ray; opacities grow by 0.02 in 250 at most, and
                          # all of a ray's samples may be off.
                          "composite": 2.0**-12 + screen[2] * head.unit * 0.02 / 250 * sample + 1e-5}
                for mode, bound in bounds.items():
                    expected = picture_of(mode, values, lengths, head.unit, least)
                    for via in (COMBINED, PRODUCT):
                        got, _ = self.rendered(*self.request(name, mode, turn, via))
                        got = got if mode == "composite" else got[..., 0]
                        self.assertEqual(got.shape, expected.shape)
                        self.assertLessEqual(np.abs(got - expected).max(), bound, (name, mode, turn, via))

    def test_two_linear_holds_stay_near_one(self):
        # Between places of the grid, a step h <= 1 apart, a linear hold of the volume is straight but for one sample, where its
        # slope changes by the second difference D. A line past such a corner is off by h |D| / 4 at most. The operators of
        # three axes average, so their errors add up to the sum of these, of samples nearby.
        turn = (30, 20, 10)
        for name, head in self.heads.items():
            _, at, lengths = head.rays(turn_of(*turn), self.screen_of(name, turn))
            padded = np.pad(head.source, 1, mode="edge")
            off = np.zeros_like(head.source)
            for axis, step in enumerate(head.steps):
                if abs(step - 1) > 1e-9:
                    second = np.abs(np.diff(padded, 2, axis=2 - axis))
                    cut = tuple(slice(None) if k == 2 - axis else slice(1, -1) for k in range(3))
                    off += step / 4 * second[cut]
            off = read(ndimage.maximum_filter(off, 5), at, 0)
            values = read(head.source, at)
            for mode in ("mip", "mean"):
                got, _ = self.rendered(*self.request(name, mode, turn, PRODUCT))
                one = picture_of(mode, values, lengths, head.unit, head.source.min())
                bound = picture_of(mode, off, lengths, head.unit, 0) + 1e-4 * head.source.max()
                self.assertTrue(np.all(np.abs(got[..., 0] - one) <= bound), (name, mode))

    def test_errors_are_within_what_is_predicted(self):
        turn = (30, 20, 10)
        for name in self.heads:
            for mode in ("mip", "xray", "mean", "composite") if name == self.ct else ("mip", "composite"):
                for filters, via in ((("foh", "foh"), COMBINED), (("foh", "zoh"), PRODUCT), (("bspline3", "foh"), PRODUCT)):
                    _, report = self.rendered(*self.request(name, mode, turn, via, filters[1], filters[0]), "--verify")
                    predicted, measured = report["plan"]["predicted"]["error"], report["measured"]["error"]
                    self.assertLessEqual(measured["low"], predicted, (name, mode, filters, via))
                    # Nor is it so large that it says nothing.
                    self.assertLessEqual(predicted, 6 * measured["high"] + 1e-3, (name, mode, filters, via))

    def test_errors_of_enlarged_views_are_too(self):
        for name in (self.ct,):
            for mode in ("mip", "xray"):
                for filters in (("bspline3", "foh"), ("bspline3", "zoh"), ("foh", "foh")):
                    words = self.request(name, mode, (30, 20, 10), PRODUCT, filters[1], filters[0]) + ["--size", "300x300", "--zoom", "2"]
                    _, report = self.rendered(*words, "--verify")
                    self.assertLessEqual(report["measured"]["error"]["low"], report["plan"]["predicted"]["error"], (name, mode, filters))

    def test_bytes_do_not_depend_on_threads(self):
        for name in (CT,):
            for mode, via in (("mip", COMBINED), ("xray", PRODUCT), ("mean", PRODUCT), ("composite", PRODUCT)):
                pictures = []
                for threads in (1, 2, 7):
                    self.rendered(*self.request(name, mode, (30, 20, 10), via), "--threads", threads)
                    pictures.append((self.folder / "p.nrrd").read_bytes())
                self.assertEqual(pictures[0], pictures[1])
                self.assertEqual(pictures[0], pictures[2])

    def test_the_product_needs_less_memory_than_a_volume_on_the_screen(self):
        request = [self.rendered(*self.request(self.mr, "mip", (30, 20, 10), via))[1]["plan"]["predicted"]["bytes"]
                   for via in (COMBINED, PRODUCT)]
        self.assertLess(request[1], request[0])

    def test_unasked_nothing_is_scaled(self):
        for name in (CT, MR):
            for mode in ("mip", "xray", "mean", "composite"):
                words = ["render", name, "--mode", mode, "--rotate", "30,20,10"]
                _, report = self.rendered(*words)
                used = {step["transition"] for step in report["plan"]["steps"]}
                self.assertFalse(used & {"warp.scale", "warp.permutation", "project.parallel_product"}, used)

    def test_refusals_say_why(self):
        def reason(source, *words):
            return self.run_it("render", source, "-o", "null:", *words, code=3).stderr.decode()
        scale = ("--via", "warp.scale")
        self.assertIn("equally spaced", reason("phantom:gaussians:24", "--rotate", "0,0,30", *scale))
        self.assertIn("would skip samples that lie 1.5 apart", reason(CT, "--spacing", "4", *scale))
        self.assertIn("finite distance", reason(CT, "--perspective", "30", *scale))
        self.assertIn("light", reason(CT, "--mode", "shaded", *scale))
        self.assertIn("clip", reason(CT, "--clip", "5,5,5,40,40,40", *scale))
        self.assertIn("project.parallel_product", reason(CT, "--clip", "5,5,5,40,40,40", "--via", "project.parallel_product"))


if __name__ == "__main__":
    unittest.main()
