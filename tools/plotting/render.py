"""A lit picture of a cloud of particles: spheres in a depth buffer, shaded by the surface they form together."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

# Radius [pixels] from which drawing one particle at a time is the quicker way.
LARGE_DISC = 8.0


@dataclass
class View:
    """A camera that looks along one axis. Right, up and towards us are unit vectors, half is half the width [m]."""

    centre: np.ndarray
    right: np.ndarray
    up: np.ndarray
    half: float

    @property
    def towards(self):
        return np.cross(self.right, self.up)


@dataclass
class Surface:
    """What each pixel sees: the depth [pixels] and the particle's index, -1 where there is none."""

    depth: np.ndarray
    particle: np.ndarray

    @property
    def seen(self):
        return self.particle >= 0


def project(view, position, pixels):
    """Column, row and depth in pixels; row 0 is the top."""
    scale = pixels / (2.0 * view.half)
    offset = (position - view.centre) * scale
    column = offset @ view.right + pixels / 2
    row = pixels / 2 - offset @ view.up
    return column, row, offset @ view.towards


def surface(view, position, radius, pixels):
    """The front of all particles, each a sphere of `radius` [m], at least one pixel wide."""
    column, row, depth = project(view, position, pixels)
    r = max(0.75, radius * pixels / (2.0 * view.half))
    inside = np.flatnonzero((column > -r) & (column < pixels + r) & (row > -r) & (row < pixels + r))
    draw = _draw_disc_by_disc if r > LARGE_DISC else _draw_pixel_by_pixel
    buffer, particle = draw(column[inside], row[inside], depth[inside], r, pixels)
    return Surface(buffer, np.where(particle >= 0, inside[particle], -1) if len(inside) else particle)


def _draw_disc_by_disc(column, row, depth, r, pixels):
    """Few and large: one particle after the other, each all its pixels."""
    buffer = np.full((pixels, pixels), -np.inf)
    particle = np.full((pixels, pixels), -1)
    for index in range(len(depth)):
        x = np.arange(max(0, int(column[index] - r)), min(pixels, int(column[index] + r) + 1))
        y = np.arange(max(0, int(row[index] - r)), min(pixels, int(row[index] + r) + 1))[:, None]
        off2 = (x + 0.5 - column[index]) ** 2 + (y + 0.5 - row[index]) ** 2
        front = depth[index] + np.sqrt(np.maximum(r * r - off2, 0.0))
        patch = np.ix_(y.ravel(), x)
        closer = (off2 < r * r) & (front > buffer[patch])
        buffer[patch] = np.where(closer, front, buffer[patch])
        particle[patch] = np.where(closer, index, particle[patch])
    return buffer, particle


def _draw_pixel_by_pixel(column, row, depth, r, pixels):
    """Many and small: one pixel of the disc after the other, each for all particles."""
    reach = int(np.ceil(r))
    # Far ones first: numpy lets the last assignment to a pixel win.
    order = np.argsort(depth, kind="stable")
    column, row, depth = column[order], row[order], depth[order]
    buffer = np.full(pixels * pixels, -np.inf)
    particle = np.full(pixels * pixels, -1)
    base_column, base_row = np.floor(column).astype(int), np.floor(row).astype(int)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            x, y = base_column + dx, base_row + dy
            off2 = (x + 0.5 - column) ** 2 + (y + 0.5 - row) ** 2
            hit = (off2 < r * r) & (x >= 0) & (x < pixels) & (y >= 0) & (y < pixels)
            pixel = y[hit] * pixels + x[hit]
            front = depth[hit] + np.sqrt(r * r - off2[hit])
            by_depth = np.argsort(front, kind="stable")
            pixel, front, who = pixel[by_depth], front[by_depth], order[hit][by_depth]
            nearest = np.full(pixels * pixels, -np.inf)
            winner = np.full(pixels * pixels, -1)
            nearest[pixel], winner[pixel] = front, who
            closer = nearest > buffer
            buffer[closer], particle[closer] = nearest[closer], winner[closer]
    shape = (pixels, pixels)
    return buffer.reshape(shape), particle.reshape(shape)


def _blur(image, sigma):
    """Gaussian blur, not wider than the picture; the outside counts as zero."""
    return gaussian_filter(image, min(sigma, min(image.shape) / 8), mode="constant", truncate=3.0)


def _blur_seen(values, seen, sigma):
    """Blur of the pixels that see something, from those only."""
    weight = _blur(seen.astype(float), sigma)
    return np.where(seen, _blur(np.where(seen, values, 0.0), sigma) / np.maximum(weight, 1e-9), 0.0)


def _light_on(depth):
    """Light of a lamp from the upper left on the surface given by its depth, 0 to 1."""
    d_row, d_column = np.gradient(depth)
    normal = np.stack([-d_column, d_row, np.ones_like(depth)])
    normal /= np.linalg.norm(normal, axis=0)
    lamp = np.array([-0.50, 0.55, 0.67])
    return np.clip(np.tensordot(lamp / np.linalg.norm(lamp), normal, axes=1), 0.0, 1.0)


def shade(front, grain):
    """Brightness (0 to about 1.2) of every pixel: lit from the upper left, darker in hollows; lone particles flat.

    `grain` is the radius of a particle in pixels: the surface is what remains when single particles are smoothed."""
    seen = front.seen
    depth = np.where(seen, front.depth, 0.0)
    spread = max(2.0, 2.0 * grain)
    # A far particle behind a gap is no part of the surface in front of it: steps are limited before smoothing.
    coarse = _blur_seen(depth, seen, 3.0 * spread)
    limited = np.clip(depth, coarse - 8 * spread, coarse + 8 * spread)
    direct = 0.45 * _light_on(_blur_seen(limited, seen, spread)) + 0.55 * _light_on(coarse)
    hollow = np.clip((depth - _blur_seen(depth, seen, 6.0 * spread)) / (14.0 * spread), -1.0, 0.6)
    surface_light = (0.20 + 0.90 * direct**0.9) * (1.0 + 0.30 * hollow)
    crowd = np.clip(2.5 * _blur(seen.astype(float), 3.0 * spread) - 0.25, 0.0, 1.0)
    return np.where(seen, crowd * surface_light + (1.0 - crowd) * 0.78, 0.0)


def picture(front, colours, grain, background, contrast=1.0):
    """RGB image (pixels, pixels, 3) of a surface; `colours` (N,3) of the particles, each dimmed by the light on it.

    `contrast` below 1 dims less, so that colours which mean numbers stay legible."""
    brightness = 1.0 - contrast * (1.0 - shade(front, grain)[..., None])
    rgb = np.zeros((*front.depth.shape, 3)) + np.asarray(background)
    seen = front.seen
    lit = colours[front.particle[seen]] * brightness[seen]
    rgb[seen] = np.clip(lit, 0.0, 1.0)
    return rgb
