"""Samples that are rounded to 8 or 16 bits on the way: promises of pictures hold, also where a level decides what a
pixel shows. The reference is linear, so that rounding is most of the error. Needs EDGEWISE."""

import json
import unittest

import numpy as np
from files import write_nrrd
from running import Running


def lumps(shape, seed):
    """Smooth bumps between 0 and 1, f32."""
    draw = np.random.default_rng(seed)
    z, y, x = np.indices(shape).astype(float)
    field = np.zeros(shape)
    for _ in range(14):
        at = draw.uniform(0.15, 0.85, 3) * shape
        away = (z - at[0]) ** 2 + (y - at[1]) ** 2 + (x - at[2]) ** 2
        field = np.maximum(field, np.exp(-away / (2 * draw.uniform(3, 7) ** 2)))
    return field.astype(np.float32)


class RoundedSamples(Running):
    def picture(self, file, *options):
        done = self.run_it("render", file, "--size", "96", "--rotate", "20,30,10", "--reference", "linear", "-o",
                           "null:", "--verify=100000", "--max-error", "10", *options, "--json", "-")
        made = json.loads(done.stdout)
        return made["plan"]["predicted"]["error"], made["measured"]["error"]["nrmse"]

    def test_promises_hold(self):
        cast = ("--via", "project.ray_cast/filter=foh/step=0.25")
        for seed, shape in ((1, (40, 44, 48)), (2, (30, 52, 36))):
            file = self.folder / f"{seed}.nrrd"
            write_nrrd(file, lumps(shape, seed))
            for mode in (("--mode", "surface", "--isovalue", "0.4"),
                         ("--mode", "binary", "--isovalue", "0.4"), ("--mode", "mip"),
                         ("--mode", "composite")):
                for bits in ("u8", "i16"):
                    by = ("--via", f"store.precision/type={bits}")
                    promised, measured = self.picture(file, *mode, *by, *cast)
                    with self.subTest(mode=mode[1], type=bits, shape=shape):
                        self.assertLessEqual(measured, promised)

    def test_an_edge_that_is_measured_by_running_it(self):
        """u8 rounds to a step of 1/254: noise of 0.0011 in samples, of which a mean keeps less."""
        file = self.folder / "a.nrrd"
        write_nrrd(file, lumps((40, 44, 48), 3))
        for edge in ("project.splat_ewa_sheets", "project.trapezoid_cast/filter=foh/step=0.25", "project.importance_cast/filter=foh"):
            promised, measured = self.picture(file, "--mode", "composite", "--via", "store.precision/type=u8", "--via", edge)
            with self.subTest(edge=edge):
                self.assertLessEqual(measured, promised)
                self.assertGreaterEqual(measured, promised / 2)


if __name__ == "__main__":
    unittest.main()
