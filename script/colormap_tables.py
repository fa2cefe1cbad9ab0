#!/usr/bin/env python3
"""Writes presentation/colormap_tables.inc from matplotlib (CC0): script/colormap_tables.py > presentation/colormap_tables.inc"""
import matplotlib
import numpy as np

print("""// Made by script/colormap_tables.py from matplotlib's tables, which are in the public domain (CC0):
// 256 rows of red, green and blue, two hexadecimal digits each.""")
for name in ("viridis", "magma", "inferno", "plasma"):
    rows = np.rint(255 * np.array(matplotlib.colormaps[name].colors)).astype(int)
    text = "".join("%02x%02x%02x" % tuple(row) for row in rows)
    lines = ["    \"%s\"" % text[i:i + 90] for i in range(0, len(text), 90)]
    print("constexpr const char* k%s =\n%s;" % (name.capitalize(), "\n".join(lines)))
