"""Writes the inputs of docs/everyday.md that are not bundled. FOLDER: where to. Needs numpy.

cells.tif   an ImageJ hyperstack: 2 channels, 6 slices of 48 x 40, 0.2 x 0.2 x 0.6 micrometres
atlas.nii   a label map with labels of up to 30 bits, as brain atlases have them
"""

import pathlib
import struct
import sys

import numpy as np


def ball(z, y, x, centre, radius):
    return ((np.array([z, y, x]).T - centre) ** 2).sum(-1).T < radius * radius


def hyperstack(path):
    channels, slices, height, width = 2, 6, 40, 48
    z, y, x = np.mgrid[0:slices, 0:height, 0:width].astype(float)
    bodies = np.zeros((slices, height, width))
    nuclei = np.zeros_like(bodies)
    for centre, radius in (((2, 14, 14), 9), ((3, 26, 32), 11)):
        distance = np.sqrt((3 * (z - centre[0])) ** 2 + (y - centre[1]) ** 2 + (x - centre[2]) ** 2)
        bodies += 900 * np.clip(radius - distance, 0, 2)
        nuclei += 2500 * np.exp(-((distance / (0.35 * radius)) ** 2))
    # ImageJ: channels run fastest, then slices, then frames.
    pages = np.stack([bodies, nuclei], axis=1).reshape(-1, height, width).round().astype("<u2")
    text = (f"ImageJ=1.53t\nimages={channels * slices}\nchannels={channels}\nslices={slices}\n"
            "hyperstack=true\nunit=micron\nspacing=0.6\n").encode() + b"\0"
    out = bytearray(struct.pack("<2sHI", b"II", 42, 8))
    for page, pixels in enumerate(pages):
        description = text if page == 0 else b""
        entries = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, 16), (259, 3, 1, 1),
                   (262, 3, 1, 1), (277, 3, 1, 1), (278, 4, 1, height),
                   (279, 4, 1, pixels.nbytes)]
        count = len(entries) + 3 + bool(description)
        here = len(out)
        data = here + 2 + 12 * count + 4
        ratio, words = data, data + 8
        strip = words + len(description)
        entries += [(273, 4, 1, strip), (282, 5, 1, ratio), (283, 5, 1, ratio)]
        if description:
            entries.append((270, 2, len(description), words))
        last = page == len(pages) - 1
        out += struct.pack("<H", count)
        for tag, kind, many, value in sorted(entries):
            out += struct.pack("<HHII" if kind == 4 or many > 1 or kind == 5 else "<HHIHxx",
                               tag, kind, many, value)
        out += struct.pack("<I", 0 if last else strip + pixels.nbytes)
        out += struct.pack("<II", 5, 1) + description + pixels.tobytes()  # 5 pixels a micrometre
    path.write_bytes(out)


def atlas(path):
    labels = np.zeros((24, 28, 32), "<i4")
    z, y, x = np.mgrid[0:24, 0:28, 0:32].astype(float)
    for value, centre, radius in ((576073732, (12, 14, 10), 7), (614454277, (12, 14, 22), 6),
                                  (16777217, (6, 8, 16), 4), (312782599, (18, 20, 16), 4)):
        labels[ball(z, y, x, centre, radius)] = value
    header = bytearray(348)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, 32, 28, 24, 1, 1, 1, 1)
    struct.pack_into("<h", header, 68, 1002)  # intent: label
    struct.pack_into("<hh", header, 70, 8, 32)
    struct.pack_into("<8f", header, 76, 1, 1, 1, 1.5, 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352)
    header[123] = 2  # mm
    struct.pack_into("<hh", header, 252, 0, 1)
    struct.pack_into("<12f", header, 280, 1, 0, 0, -16, 0, 1, 0, -14, 0, 0, 1.5, -18)
    header[344:348] = b"n+1\0"
    path.write_bytes(bytes(header) + b"\0" * 4 + labels.tobytes())


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    hyperstack(folder / "cells.tif")
    atlas(folder / "atlas.nii")
