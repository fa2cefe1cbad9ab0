"""Orders of convergence of pictures, as Etiene et al. 2014 measure them: the grid and the pixel are refined (rays_test.py: the step).

The field is a sum of Gaussians that is next to zero at the faces, so that no border takes part."""

import json

import numpy as np
from driving import Driven, main, rms, turn3
from scipy.ndimage import map_coordinates

BALLS = ((1.0, 0.09, (0.05, -0.04, 0.02)), (0.7, 0.08, (-0.08, 0.06, -0.05)), (0.5, 0.085, (0.02, 0.09, 0.08)))  # height, width, x y z
TURN = (20, 30, 0)
PIXELS, PIXEL = 24, 1 / 32
ROUNDING = 5e-7  # of f32: the light of a ray is a sum of some hundred numbers up to 1
# Errors of reconstruction fall as h^order. Cubic convolution has order 3 at points; its leading term has alternating signs, so
# integrals have order 4.
ORDERS = {"foh": 2, "keys": 4, "bspline3": 4}


def field(x, y, z):
    return sum(height * np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / (2 * width ** 2)) for height, width, (a, b, c) in BALLS)


def sampled(n):
    """A cube of side 1, voxel centres."""
    at = (np.arange(n) + 0.5) / n - 0.5
    return field(at[None, None, :], at[None, :, None], at[:, None, None]).astype("f4")


def across(pixels, pixel):
    return (np.arange(pixels) - (pixels - 1) / 2) * pixel


def exact(mode, pixels=PIXELS, pixel=PIXEL):
    """Of rays through pixel centres, in f64: 2000 samples a ray."""
    back = turn3(*TURN).T
    u, v = across(pixels, pixel)[None, :], across(pixels, pixel)[:, None]
    depth = np.linspace(-0.8, 0.8, 2001)
    light, left = np.zeros((pixels, pixels)), np.ones((pixels, pixels))
    for w in (depth[:-1] + depth[1:]) / 2:
        value = field(*(row[0] * u + row[1] * v + row[2] * w for row in back))
        if mode == "mip":
            light = np.maximum(light, value)
        elif mode == "xray":
            light += value * (depth[1] - depth[0])
        else:  # opacity 0.4 value over a length of 0.1, grey that is the value
            through = (1 - np.clip(0.4 * value, 0, 0.4)) ** ((depth[1] - depth[0]) / 0.1)
            light += left * (1 - through) * np.clip(value, 0, 1)
            left *= through
    return light


def slopes_of(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


class Convergence(Driven):
    def picture(self, n, mode, pixels, pixel, *path):
        words = ["--mode", mode, "--rotate", ",".join(map(str, TURN)), "--size", f"{pixels}x{pixels}", "--spacing", repr(pixel), "--max-error", "9"]
        if mode == "composite":
            file = self.folder / "t.json"
            file.write_text(json.dumps({"unit": 0.1, "points": [{"value": 0, "opacity": 0, "color": [0, 0, 0]},
                                                                {"value": 1, "opacity": 0.4, "color": [1, 1, 1]}]}))
            words += ["--transfer", file]
        made = self.render(sampled(n), *words, *(word for edge in path for word in ("--via", edge)), spacing=(1 / n,) * 3)
        return (made if made.ndim == 2 else made[..., 0]).astype("f8")

    def test_in_the_grid(self):
        sides = (24, 48, 96)
        for mode in ("xray", "composite"):
            truth = exact(mode)
            for hold, order in ORDERS.items():
                # The midpoint rule is of second order: steps that get shorter twice as fast leave the filter's own order.
                errors = [rms(self.picture(n, mode, PIXELS, PIXEL, f"project.ray_cast/filter={hold}/step={0.25 * 24 / n}") - truth)
                          for n in sides]
                slopes = slopes_of([error for error in errors if error > ROUNDING])
                # Of a high order the coarsest grid, with 2 samples in a ball's width, still shows the next one.
                self.assertLess(np.abs(slopes - order).max(), 0.3 if order == 4 else 0.2, f"{mode} {hold} {errors} {slopes}")
            # The same field by other ways, one sample a voxel along the ray. Of xrays this is exact next to the filter.
            for path in ("project.shear_warp/filter=foh", "warp.backward/filter=foh"):
                errors = [rms(self.picture(n, mode, PIXELS, PIXEL, path) - truth) for n in sides]
                slopes = slopes_of(errors)
                self.assertLess(np.abs(slopes - 2).max(), 0.2, f"{mode} {path} {errors} {slopes}")

    def test_in_the_pixel(self):
        """Pixels are points, at their centres: linear interpolation between them errs by the second order, half a pixel's shift by the
        first."""
        for mode in ("mip", "xray", "composite"):
            at = across(61, 1 / 96)
            truth = exact(mode, 61, 1 / 96)
            errors = []
            for k in (0, 1, 2):
                pixels, pixel = 24 * 2 ** k, PIXEL / 2 ** k
                made = self.picture(96, mode, pixels, pixel, "project.ray_cast/filter=bspline3/step=0.25")
                places = at / pixel + (pixels - 1) / 2
                errors.append(rms(map_coordinates(made, np.stack(np.meshgrid(places, places, indexing="ij")), order=1) - truth))
            slopes = slopes_of(errors)
            self.assertLess(np.abs(slopes - 2).max(), 0.2, f"{mode} {errors} {slopes}")


if __name__ == "__main__":
    main()
