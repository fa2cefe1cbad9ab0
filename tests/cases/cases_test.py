"""Files that are legal and easy to get wrong (make_cases.py): each is read as its standard means it."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(here), str(here.parent / "properties")]
import files  # noqa: E402
import make_cases  # noqa: E402

COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")


class CasesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(dir=os.environ.get("EDGEWISE_SCRATCH")))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.env = {**os.environ, "XDG_CONFIG_HOME": str(cls.folder / "config"), "XDG_CACHE_HOME": str(cls.folder / "cache")}

    def run_it(self, *words, codes=(0,)):
        done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, timeout=100, env=self.env)
        self.assertIn(done.returncode, codes, f"{words}: {done.stderr.decode(errors='replace')}")
        return done

    def info(self, case, *more):
        return json.loads(self.run_it("info", case["path"], *more, "--json", "-", "--quiet").stdout)

    def output(self, verb, case, *more):
        out = self.folder / "out.nrrd"
        self.run_it(verb, case["path"], "-o", out, *more, "--quiet")
        return files.read_nrrd(out)

    def values(self, case, *more):
        return self.output("warp", case, *more)[0]

    def same(self, case, *more, values=None):
        right = np.asarray(case["values"] if values is None else values)
        given = self.values(case, *more)
        self.assertEqual(given.size, right.size)
        np.testing.assert_array_equal(given.reshape(right.shape).astype(np.float64), right.astype(np.float64))

    def spacing(self, case, told, right, unit="mm"):
        self.assertEqual(told["unit"], unit)
        np.testing.assert_allclose(told["spacing"], right, rtol=1e-6)

    def micrometres(self, case):
        told = self.info(case)
        scale = {"mm": 1000, "um": 1, "nm": .001}[told["unit"]]
        np.testing.assert_allclose(np.array(told["spacing"]) * scale, case["micrometres"], rtol=1e-5)

    def case(self, make):
        return make(self.folder)

    def test_enhanced_dicom_has_its_geometry_in_functional_groups(self):
        case = self.case(make_cases.enhanced_geometry)
        told = self.info(case)
        self.assertEqual(told["extent"], [7, 4, 5])
        self.spacing(case, told, case["spacing"])
        np.testing.assert_allclose(told["origin"], case["origin"])
        self.same(case)

    def test_a_private_sequence_of_unknown_vr_is_skipped(self):
        self.same(self.case(make_cases.private_sequence))

    def test_a_structure_set_lies_beside_the_images(self):
        case = self.case(make_cases.beside_structures)
        self.same(case, "--series", case["series"])
        self.same(case)
        self.spacing(case, self.info(case), case["spacing"])

    def test_planes_of_a_dose_lie_at_their_offsets(self):
        case = self.case(make_cases.dose_spacing)
        self.spacing(case, self.info(case), case["spacing"])
        self.same(case)

    def test_padding_is_no_measurement(self):
        case = self.case(make_cases.padding)
        picture = self.output("render", case, "--mode", "xray", "--view", "z", "--size", "native")[0]
        np.testing.assert_allclose(picture.reshape(case["xray"].shape), case["xray"], atol=1e-2)

    def test_a_stopped_scan_keeps_its_whole_times(self):
        case = self.case(make_cases.stopped_scan)
        done = self.run_it("info", case["path"], "--json", "-", "--quiet", codes=(0, 4))
        if done.returncode == 0:
            self.assertEqual(json.loads(done.stdout)["times"], case["times"])
            for time, values in enumerate(case["values"]):
                self.same(case, "--time", time, values=values)
        else:
            self.assertRegex(done.stderr.decode(), r"1 of 4")

    def test_float_pixels_are_pixels(self):
        self.same(self.case(make_cases.float_pixels))

    def test_each_slice_has_its_slope_under_run_lengths_too(self):
        self.same(self.case(make_cases.slopes_in_runs))

    def test_a_mosaic_is_taken_apart_or_named(self):
        case = self.case(make_cases.mosaic)
        done = self.run_it("info", case["path"], "--json", "-", codes=(0, 4))
        if done.returncode == 0 and json.loads(done.stdout)["extent"] == [5, 5, 7]:
            self.same(case)
        else:
            self.assertIn("mosaic", (done.stdout + done.stderr).decode().lower())

    def test_luminance_and_chroma_become_colours(self):
        case = self.case(make_cases.luminance)
        given = self.values(case).reshape(case["values"].shape).astype(float)
        np.testing.assert_allclose(given, case["values"], atol=case["tolerance"])

    def test_a_ball_on_a_sheared_grid_is_a_disc_or_refused(self):
        case = self.case(make_cases.sheared_ball)
        for view in ("front", "bottom", "left"):
            out = self.folder / "ball.nrrd"
            done = self.run_it("render", case["path"], "-o", out, "--mode", "xray", "--view", view, "--size", "native", "--quiet", codes=(0, 2, 3, 4))
            if done.returncode:
                self.assertRegex(done.stderr.decode(), "(?i)shear|lean|tilt|oblique|square")
                continue
            picture = files.read_nrrd(out)[0].astype(float)
            picture = picture.reshape(picture.shape[-2:])
            y, x = np.indices(picture.shape)
            weight = picture / picture.sum()
            off = np.stack([x - (x * weight).sum(), y - (y * weight).sum()])
            axes = np.sqrt(np.linalg.eigvalsh(np.einsum("ayx,byx,yx->ab", off, off, weight)))
            self.assertLess(axes[1] / axes[0], 1.05, view)
            # The second moment of a ball's projection along one axis is r^2 / 5.
            np.testing.assert_allclose(axes, case["radius"] / np.sqrt(5), rtol=.05)

    def test_integers_of_64_bits(self):
        self.same(self.case(make_cases.wide_integers))

    def test_large_labels_keep_their_digits(self):
        case = self.case(make_cases.large_labels)
        self.same(case)
        self.same(case, "--labels", "--rotate", "0,0,180", values=case["values"][:, ::-1, ::-1])

    def test_shears_keep_what_later_passes_bring_back(self):
        case = self.case(make_cases.anisotropic_pixels)
        words = ["--rotate", "80", "--max-error", "0.01"]
        direct = self.values(case, *words[:2], "--via", "warp.backward/filter=bspline3")
        out = self.folder / "sheared.nrrd"
        done = self.run_it("warp", case["path"], "-o", out, *words, "--via", "warp.shear/filter=bspline3", "--quiet", codes=(0, 3))
        if done.returncode == 0:
            apart = files.read_nrrd(out)[0].astype(float) - direct
            inside = direct != 0
            self.assertLess(np.sqrt(np.mean(apart[inside] ** 2)) / np.ptp(direct[inside]), .015)

    def test_microns_are_micrometres(self):
        case = self.case(make_cases.microns)
        self.micrometres(case)
        self.same(case)

    def test_units_belong_to_axes(self):
        self.micrometres(self.case(make_cases.units_by_axis))

    def test_hexadecimal_samples(self):
        self.same(self.case(make_cases.hexadecimal))

    def test_half_floats(self):
        self.same(self.case(make_cases.half_floats))

    def test_a_field_array_is_data(self):
        case = self.case(make_cases.field_array)
        self.same(case)
        np.testing.assert_allclose(self.info(case)["spacing"], case["spacing"])

    def test_points_of_64_bits(self):
        case = self.case(make_cases.wide_points)
        self.same(case)
        np.testing.assert_allclose(self.info(case)["spacing"], case["spacing"])

    def test_a_hyperstack_has_channels(self):
        case = self.case(make_cases.hyperstack)
        told = self.info(case)
        self.assertEqual((told["extent"], told["channels"]), ([5, 3, 4], 3))
        for channel, values in enumerate(case["values"]):
            self.same(case, "--channel", channel, values=values)

    def test_a_stack_has_its_voxel_size(self):
        case = self.case(make_cases.voxel_size)
        self.micrometres(case)
        self.same(case)

    def test_a_stack_of_bits(self):
        case = self.case(make_cases.bits_stack)
        given = self.values(case).reshape(case["values"].shape)
        np.testing.assert_array_equal(given != 0, case["values"])


if __name__ == "__main__":
    unittest.main()
