#!/usr/bin/python3
"""Writes scipy_fixtures.bin: images and volumes warped by scipy.ndimage in f64, which backward_test.cpp compares with.

    tests/transitions/warp/make_scipy_fixtures.py

One record a case, little-endian, axes in the order x, y, z:
    i32[7]      axes, extent of the input (3), extent of the output (3)
    f64[16]     object -> screen, row-major, indices with centres at integers
    f32[...]    the input, x fastest
    f32[...]    the output by linear interpolation
    f32[...]    the output by the cubic spline
Positions more than half a sample beyond the outermost centres give 0. Up to there the outermost sample continues
(positions are clamped), and within the samples the cubic spline mirrors them at the outermost centres.
"""
import pathlib

import numpy as np
import scipy.ndimage

FILE = pathlib.Path(__file__).with_name("scipy_fixtures.bin")


def rotation(x, y, z):
    """EQ 37: Rz Ry Rx, degrees."""
    x, y, z = np.radians([x, y, z])
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    return (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


def about_centres(linear, source, target):
    """4x4 map that applies `linear` and takes the centre of one grid to that of the other."""
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = (np.array(target) - 1) / 2 - linear @ ((np.array(source) - 1) / 2)
    return matrix


def warp(samples, matrix, order, extent):
    """Samples in the order [z, y, x]; the answer in f64."""
    grid = np.indices(extent[::-1])[::-1].reshape(3, -1)
    place = np.linalg.inv(matrix) @ np.vstack([grid, np.ones(grid.shape[1])])
    w = place[3]
    at = place[:3] / w
    size = np.array(samples.shape)[::-1, None]
    axes = 2 if samples.shape[0] == 1 else 3
    inside = (w > 0) & ((at >= -0.5) & (at <= size - 0.5))[:axes].all(0)
    clamped = np.clip(at, 0, size - 1)[:axes][::-1]
    source = samples[0] if axes == 2 else samples
    values = scipy.ndimage.map_coordinates(source.astype("f8"), clamped, output="f8", order=order, mode="mirror")
    return np.where(inside, values, 0).reshape(extent[::-1])


def check_against_affine_transform(samples, matrix, order, extent, values):
    """The same by scipy's own affine transform, where no border rule is at work."""
    inverse = np.linalg.inv(matrix)
    linear, shift = inverse[:3, :3][::-1, ::-1], inverse[:3, 3][::-1]
    if samples.shape[0] == 1:
        linear, shift, samples, values = linear[1:, 1:], shift[1:], samples[0], values[0]
    direct = scipy.ndimage.affine_transform(samples.astype("f8"), linear, shift, output_shape=values.shape, output="f8",
                                            order=order, mode="mirror")
    at = linear @ np.indices(values.shape).reshape(values.ndim, -1) + shift[:, None]
    inner = ((at >= 0) & (at <= np.array(samples.shape)[:, None] - 1)).all(0).reshape(values.shape)
    assert inner.mean() > 0.1 and np.abs(direct - values)[inner].max() < 1e-9 * np.ptp(samples)


def cases():
    image, picture = (36, 31, 1), (32, 33, 1)
    for linear in (rotation(0, 0, 30), rotation(0, 0, -104.7), rotation(0, 0, 11) @ np.diag([1.7, 1.4, 1]),
                   np.array([[0.8, 0.45, 0], [-0.2, -1.1, 0], [0, 0, 1]])):
        yield image, picture, about_centres(linear, image, picture)
    tilt = about_centres(rotation(0, 0, 12), image, picture)
    tilt[3, :2] = 8e-3, -5e-3
    yield image, picture, tilt
    volume, box = (18, 15, 14), (13, 12, 11)
    for linear in (rotation(30, 30, 30), rotation(-75, 12, 160), rotation(5, 40, -20) @ np.diag([0.6, 1.3, 0.9])):
        yield volume, box, about_centres(linear, volume, box)


def main():
    random = np.random.default_rng(20)
    with FILE.open("wb") as out:
        for source, target, matrix in cases():
            samples = (random.random(source[::-1]) * 1500 - 500).astype("f4")
            out.write(np.array([2 if source[2] == 1 else 3, *source, *target], "<i4").tobytes())
            out.write(matrix.astype("<f8").tobytes())
            out.write(samples.astype("<f4").tobytes())
            for order in (1, 3):
                values = warp(samples, matrix, order, target)
                if (matrix[3] == [0, 0, 0, 1]).all():
                    check_against_affine_transform(samples, matrix, order, target, values)
                out.write(values.astype("<f4").tobytes())


if __name__ == "__main__":
    main()
