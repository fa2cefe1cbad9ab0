#!/usr/bin/python3
"""Made the .vdb files here, by Debian's python3-openvdb (OpenVDB 10.0): formulas, free of any rights (CC0).

fog.vdb    1 - r / 6 in a ball of 6 voxels around index (10, 12, 14), nothing active outside; voxels of 0.5, at (1, -2, 3) + 0.5 index
ball.vdb   the level set of a ball of radius 4 around (5, 6, 7), voxels of 0.5: distance to its surface, at most 1.5
turned.vdb as fog.vdb, with columns (0, 0.5, 0), (-0.75, 0, 0), (0, 0, 1.25)"""

import sys

import numpy as np
import pyopenvdb as vdb


def fog(transform):
    i, j, k = np.indices((24, 26, 28))
    r = np.sqrt((i - 10) ** 2 + (j - 12) ** 2 + (k - 14) ** 2)
    grid = vdb.FloatGrid()
    grid.name = "density"
    grid.gridClass = vdb.GridClass.FOG_VOLUME
    grid.copyFromArray(np.clip(1 - r / 6, 0, 1).astype("f4"), tolerance=0)
    grid.transform = vdb.createLinearTransform(transform)
    return grid


folder = sys.argv[1] if len(sys.argv) > 1 else "."
vdb.write(folder + "/fog.vdb", grids=[fog([[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0.5, 0], [1, -2, 3, 1]])])
vdb.write(folder + "/turned.vdb", grids=[fog([[0, 0.5, 0, 0], [-0.75, 0, 0, 0], [0, 0, 1.25, 0], [0, 0, 0, 1]])])
ball = vdb.createLevelSetSphere(radius=4, center=(5, 6, 7), voxelSize=0.5, halfWidth=3)
ball.name = "ball"
vdb.write(folder + "/ball.vdb", grids=[ball])
