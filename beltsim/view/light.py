"""How surfaces look: a key light with soft shadow, and the light of sky and ground that reaches each point.

Rays for shadows and sky are spread by fixed sequences, turned from pixel to pixel by Jimenez's interleaved gradient
noise (SIGGRAPH 2014): the same scenery gives the same bytes, whatever the chunks and threads.
"""

from __future__ import annotations

import numpy as np

from .scenery import Cylinders
from .trace import Caster, Hits

KEY = 0.88  # share of the key light at normal incidence
SKY, BOUNCE = 0.48, 0.18  # light from straight above and from below
OPEN = BOUNCE + (SKY - BOUNCE) * 5 / 6  # what reaches a horizontal face under a free sky
SUN_RADIUS = 0.035  # rad: softness of the shadow's edge
SKY_RAYS = 12  # a sample; four samples a pixel


def key_direction(back: np.ndarray) -> np.ndarray:
    """Unit vector to the key light: 62 deg left of the camera, 40 deg above the horizon."""
    turn = np.radians(-62.0) + np.arctan2(back[1], back[0])
    rise = np.radians(40.0)
    return np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])


def turns(column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """A fixed angle (n,) in rad for each pixel that differs much between neighbours."""
    return 2 * np.pi * ((52.9829189 * ((0.06711056 * column + 0.00583715 * row) % 1.0)) % 1.0)


def frames(normal: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (n, 3) across each normal, turned about it."""
    helper = np.where(np.abs(normal[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    a = np.cross(helper, normal)
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = np.cross(normal, a)
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    return cos * a + sin * b, cos * b - sin * a


def disc(count: int, sample: int, samples: int) -> np.ndarray:
    """Points (count, 2) evenly spread over the unit disc (golden-angle spiral), those of one sample of several."""
    k = np.arange(count) * samples + sample
    radius, angle = np.sqrt((k + 0.5) / (count * samples)), k * 2.399963229728653
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def sunlit(caster: Caster, point, key, turn, sample: int, samples: int) -> np.ndarray:
    """Whether (n,) the key light reaches each point, one ray to a place on its disc."""
    x, y = SUN_RADIUS * disc(1, sample, samples)[0]
    a, b = frames(np.tile(key, (len(point), 1)), turn)
    direction = key + x * a + y * b
    return ~caster.blocked(point, _unit(direction), 2 * caster.size)


def skylight(caster: Caster, point, normal, turn, sample: int, samples: int, reach: float) -> np.ndarray:
    """Light (n,) of sky and ground that reaches each point; only what lies within `reach` m takes it away."""
    light = np.zeros(len(point))
    a, b = frames(normal, turn)
    for x, y in disc(SKY_RAYS, sample, samples):
        direction = x * a + y * b + np.sqrt(1 - x * x - y * y) * normal
        free = ~caster.blocked(point, direction, reach)
        light += free * (BOUNCE + (SKY - BOUNCE) * (0.5 + 0.5 * direction[:, 2]))
    return light / SKY_RAYS


def shade(
    caster: Caster, hits: Hits, colour, normal, point, direction, key, turn, sample, samples
) -> np.ndarray:
    """Light (n, 3) that comes back to the viewer from each hit; `colour`: share (n, 3) of light that is not taken."""
    facing = np.clip(normal @ key, 0, None)
    sun = np.zeros(len(point))
    lit = np.flatnonzero(facing > 0)
    sun[lit] = facing[lit] * sunlit(caster, point[lit], key, turn[lit], sample, samples)
    sky = skylight(caster, point, normal, turn, sample, samples, 0.35 * caster.size)
    light = colour * (KEY * sun + sky)[:, None]
    return light + glint(caster, hits, normal, direction, key, sun)[:, None]


def glint(caster: Caster, hits: Hits, normal, direction, key, sun) -> np.ndarray:
    """The key light's reflection (Blinn), strong and narrow on cylinders, which are metal; faint elsewhere."""
    metal = np.array([isinstance(item, Cylinders) for item in caster.items])[hits.item]
    halfway = _unit(key - direction)
    cosine = np.clip(np.einsum("ni,ni->n", normal, halfway), 0, 1)
    return (sun > 0) * np.where(metal, 0.28 * cosine**40, 0.05 * cosine**12)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
