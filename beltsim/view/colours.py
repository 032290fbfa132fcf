"""Colours: maps from numbers, one for each kind of thing, and colours that a deck names."""

from __future__ import annotations

import numpy as np

from .errors import ViewProblem

# Thirteen even steps of matplotlib's maps (viridis is CC0, coolwarm by K. Moreland, turbo by A. Mikhailov).
COLOUR_MAPS = {
    "viridis": "440154 481f70 443983 3b528b 31688e 287c8e 21918c 20a486 35b779 5ec962 90d743 c8e020 fde725",
    "coolwarm": "3b4cc0 5470de 6f92f3 8db0fe aac7fd c5d6f2 dddcdc efcebd f7b89c f4987a e7745b d1493f b40426",
    "turbo": "30123b 434eba 4685fa 28bceb 1ae4b6 55fa76 a4fc3c d9e436 faba39 fb7e21 e4450a b91e02 7a0403",
}

RUBBER = (0.37, 0.38, 0.40)
BULK = (0.52, 0.42, 0.32)
STEEL = (0.62, 0.64, 0.67)
PULLEY = (0.27, 0.44, 0.63)

# Sets that stay apart for colour-blind readers (P. Tol, "muted").
PALETTE = ("332288", "88ccee", "44aa99", "117733", "999933", "ddcc77", "cc6677", "882255", "aa4499")


def from_hex(text: str) -> np.ndarray:
    """The sRGB colour (3,) in 0..1 of a text as `#cc3333`."""
    digits = text.strip().removeprefix("#")
    try:
        if len(digits) != 6:
            raise ValueError
        return np.array(list(bytes.fromhex(digits))) / 255
    except ValueError:
        raise ViewProblem(f"colour: found {text!r}, expected one as #cc3333") from None


def colour_map(name: str, values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Colours (n, 3) of values, `low` and below at one end of the map, `high` and above at the other."""
    if name not in COLOUR_MAPS:
        raise ViewProblem(f"colour map: found {name!r}, expected one of {', '.join(COLOUR_MAPS)}")
    steps = np.array([from_hex(text) for text in COLOUR_MAPS[name].split()])
    place = np.clip((np.asarray(values, float) - low) / (high - low or 1.0), 0, 1) * (len(steps) - 1)
    return np.column_stack([np.interp(place, np.arange(len(steps)), channel) for channel in steps.T])


def distinct(count: int) -> np.ndarray:
    """Colours (count, 3) that tell `count` kinds apart; they recur after nine."""
    return np.array([from_hex(PALETTE[k % len(PALETTE)]) for k in range(count)]).reshape(-1, 3)


def to_linear(colour: np.ndarray) -> np.ndarray:
    """Light intensities of sRGB colours (gamma 2.2)."""
    return np.asarray(colour, float) ** 2.2


def to_srgb(light: np.ndarray) -> np.ndarray:
    """The sRGB colours in 0..1 of light intensities (gamma 2.2)."""
    return np.clip(light, 0, 1) ** (1 / 2.2)
