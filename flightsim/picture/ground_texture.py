"""The grain of the ground: a periodic patch of noise and its smaller copies (MIP pyramid; Williams, 1983)."""

import numpy as np
from numpy.typing import NDArray

TEXELS = 512
LEVELS = 10  # 512, 256, ... 1


def ground_texture(seed: int = 1) -> NDArray[np.float32]:
    """Levels (LEVELS, TEXELS, TEXELS); level n fills its first TEXELS >> n.

    The noise has mean 0, at the finest level a deviation of 1, a falling spectrum as grass and soil have, and
    no seam: the patch can be repeated.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    frequency = np.fft.fftfreq(TEXELS) * TEXELS
    radius = np.hypot(frequency[:, None], frequency[None, :])
    radius[0, 0] = np.inf
    spectrum = np.fft.fft2(rng.standard_normal((TEXELS, TEXELS))) / radius
    patch = np.fft.ifft2(spectrum).real
    patch = patch / patch.std()
    levels = np.zeros((LEVELS, TEXELS, TEXELS), dtype=np.float32)
    for level in range(LEVELS):
        size = TEXELS >> level
        levels[level, :size, :size] = patch
        patch = 0.25 * (patch[::2, ::2] + patch[1::2, ::2] + patch[::2, 1::2] + patch[1::2, 1::2])
        if size == 1:
            break
    return levels
