"""Averages the large drawing down to the frame: this is what makes edges smooth.

Compiled, because one pass over the pixels takes 3 ms where pygame's scaling and copying take 13.
"""

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True)
def halved(drawing: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Mean of every 2 x 2 pixels, from pygame's memory to an image.

    drawing: (2 h, 2 w, 4), bytes blue, green, red, unused. Returns (h, w, 3), red, green, blue.
    """
    height, width = drawing.shape[0] // 2, drawing.shape[1] // 2
    image = np.empty((height, width, 3), np.uint8)
    for y in range(height):
        above, below = drawing[2 * y], drawing[2 * y + 1]
        for x in range(width):
            for k in range(3):
                upper = np.uint32(above[2 * x, k]) + above[2 * x + 1, k]
                lower = np.uint32(below[2 * x, k]) + below[2 * x + 1, k]
                image[y, x, 2 - k] = (upper + lower + 2) >> 2
    return image
