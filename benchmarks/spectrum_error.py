#!/usr/bin/python3
"""What windows of a spectrum get wrong, by width and padding: measured, predicted and bounded. For docs/spectrum.md.

    EDGEWISE=build/release/bin/edgewise benchmarks/spectrum_error.py [--side N] [--out docs/spectrum]

Prints a Markdown table and draws windows.svg. The volume is made here: soft blobs all over a field of N^3, seen from a
direction that no axis has. Every pixel is compared with the reference. Needs numpy and matplotlib; script/setup --bench
installs both.
"""
import argparse
import pathlib
import sys

import numpy as np
from drawing import NAIVE, OTHER, OURS, ROOT, edgewise, panels, save
from spectrum_windows_test import PADDINGS, WINDOWS, blobs, faded  # drawing leads to tests/stability


def ghosts(width, padding, shape):
    """Root mean square over the field, and the largest sum, of the ghosts of a sample along one axis."""
    x = np.linspace(0, 0.5 / padding, 401)
    far = np.arange(1, 257)[:, None]
    here, away = faded(width, shape, x), np.concatenate([faded(width, shape, x + far), faded(width, shape, x - far)])
    return np.sqrt(np.mean((away ** 2).sum(0) / here ** 2)), (np.abs(away).sum(0) / np.abs(here)).max()


def best_shape(width, padding):
    """b of least mean ghost, as Jackson's and Beatty's; the program has the same to 1 %."""
    if padding == 1:
        return 0
    shapes = np.arange(1.4, 2.6, 0.01) * width
    return min(shapes, key=lambda shape: ghosts(width, padding, shape)[0])


def measure(volume, width, padding):
    """Predicted and measured NRMSE."""
    size = f"{volume.shape[0] * 3 // 2}x{volume.shape[0] * 3 // 2}"
    _, report = edgewise("render", volume, "--mode", "xray", "--reference", "spline", "--rotate", "20,30,10", "--size",
                         size, "--spacing", 1, "--via", f"spectrum.forward/width={width}/padding={padding}", "--via",
                         "spectrum.slice/band=volume", "--max-error", 10, "--verify=all")
    if not report.get("measured"):
        sys.exit(f"{width} {padding}: {report.get('error')}")
    return report["plan"]["predicted"]["error"], report["measured"]["error"]["nrmse"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--side", type=int, default=64)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/spectrum")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    volume = np.ascontiguousarray(blobs(options.side, 2.2, 60).T)
    rows = {}
    print("| width | padding | mean ghost | bound | predicted | measured |\n|---|---|---|---|---|---|")
    for width, padding in WINDOWS:
        mean, bound = ghosts(width, padding, best_shape(width, padding))
        predicted, measured = measure(volume, width, padding)
        rows[width, padding] = mean, bound, predicted, measured
        print(f"| {width} | {padding} | {mean:.1e} | {bound:.1e} | {predicted:.1e} | {measured:.1e} |", flush=True)
    figure, axes = panels(3, 3.6)
    for axis, padding in zip(axes, PADDINGS):
        widths = range(2, 9)
        columns = np.array([rows[width, padding] for width in widths])
        axis.semilogy(widths, 3 * columns[:, 1], label="bound, three axes", **NAIVE)
        axis.semilogy(widths, columns[:, 2], label="predicted", **OTHER)
        axis.semilogy(widths, columns[:, 3], label="measured", **OURS)
        axis.set(title=f"padding {padding}", xlabel="taps along each axis", ylim=(1e-8, 10))
    axes[0].plot(2, rows[2, 1][3], "s", color="black", markersize=5)
    axes[0].annotate("linear, no padding", (2, rows[2, 1][3]), (2.4, 1.6 * rows[2, 1][3]), fontsize=8)
    axes[0].set(ylabel="NRMSE of an X-ray")
    axes[0].legend(loc="lower left", fontsize=8)
    save(figure, options.out / "windows.svg")


if __name__ == "__main__":
    main()
