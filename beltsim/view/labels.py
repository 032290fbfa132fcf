"""Text on a picture: the caption and the colour bar."""

from __future__ import annotations

import math

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from .colours import colour_map
from .scenery import Legend, Scenery

INK = (45, 50, 58)
PANEL = (255, 255, 255, 190)


def text_height(height: int) -> int:
    """Size of the text in a picture of `height` pixels: 1/42, at least 9 pixels."""
    return max(9, round(height / 42))


def annotate(image: Image.Image, scenery: Scenery) -> Image.Image:
    """Write the scenery's caption at the lower left and its colour bar at the right."""
    font = ImageFont.load_default(text_height(image.height))
    if scenery.caption:
        place = (0.02 * image.width, image.height - font.size)
        ImageDraw.Draw(image).text(place, scenery.caption, INK, font, anchor="ld")
    if scenery.legend:
        _colour_bar(image, font, scenery.legend)
    return image


def _colour_bar(image: Image.Image, font: ImageFont.FreeTypeFont, legend: Legend) -> None:
    """A panel in the middle of the right edge: the label, and below it the bar with five values."""
    em = font.size
    values = tick_texts(legend.low, legend.high)
    widest = max(font.getlength(legend.label), 1.8 * em + max(map(font.getlength, values)))
    right, top, bottom = image.width - 0.7 * em, 0.2 * image.height, 0.8 * image.height
    left = right - widest - 1.4 * em
    draw = ImageDraw.Draw(image, "RGBA")
    draw.rounded_rectangle((left, top, right, bottom), em // 2, PANEL)
    draw.text((left + 0.7 * em, top + 0.5 * em), legend.label, INK, font, anchor="la")
    _bar(image, (round(left + 0.7 * em), round(top + 2.4 * em), em, round(bottom - top - 3.3 * em)), legend)
    for place, value in zip(np.linspace(top + 2.4 * em, bottom - 0.9 * em, 5), values):
        draw.line((left + 1.7 * em, place, left + 2.1 * em, place), INK)
        draw.text((left + 2.4 * em, place), value, INK, font, anchor="lm")


def tick_texts(low: float, high: float) -> list[str]:
    """Five values from high to low, with the digits that their distance needs: 1.015 beside 1.03, not 1.02."""
    step = (high - low) / 4.0
    size = max(abs(low), abs(high))
    digits = 3 if step <= 0.0 or size == 0.0 else max(3, 2 + math.ceil(math.log10(size / step)))
    return [f"{value:.{min(digits, 9)}g}" for value in np.linspace(high, low, 5)]


def _bar(image: Image.Image, place: tuple[int, int, int, int], legend: Legend) -> None:
    left, top, width, height = place
    ramp = colour_map(legend.colour_map, np.linspace(1, 0, height), 0, 1)
    pixels = np.repeat(np.rint(ramp * 255).astype(np.uint8)[:, None], width, axis=1)
    image.paste(Image.fromarray(pixels), (left, top))
    ImageDraw.Draw(image).rectangle((left, top, left + width - 1, top + height - 1), outline=INK)
