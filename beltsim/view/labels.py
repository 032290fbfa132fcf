"""Text on a picture: the caption and the colour bar."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from .colours import colour_map
from .scenery import Legend, Scenery

INK = (45, 50, 58)


def annotate(image: Image.Image, scenery: Scenery) -> Image.Image:
    """Write the scenery's caption at the lower left and its colour bar at the right; text is 1/42 of the height."""
    font = ImageFont.load_default(max(9, round(image.height / 42)))
    draw = ImageDraw.Draw(image)
    if scenery.caption:
        draw.text((0.02 * image.width, 0.97 * image.height), scenery.caption, INK, font, anchor="ld")
    if scenery.legend:
        _colour_bar(image, draw, font, scenery.legend)
    return image


def _colour_bar(image: Image.Image, draw: ImageDraw.ImageDraw, font, legend: Legend) -> None:
    left, top = round(0.915 * image.width), round(0.25 * image.height)
    width, height = max(4, round(0.013 * image.width)), round(0.5 * image.height)
    panel = (0.9 * image.width, top - 0.08 * image.height, 0.99 * image.width, 0.79 * image.height)
    ImageDraw.Draw(image, "RGBA").rounded_rectangle(panel, font.size // 2, (255, 255, 255, 190))
    ramp = colour_map(legend.colour_map, np.linspace(1, 0, height), 0, 1)
    bar = np.repeat(np.rint(ramp * 255).astype(np.uint8)[:, None], width, axis=1)
    image.paste(Image.fromarray(bar), (left, top))
    draw.rectangle((left, top, left + width - 1, top + height - 1), outline=INK)
    for place, value in zip(np.linspace(1, 0, 5), np.linspace(legend.low, legend.high, 5)):
        y = top + place * (height - 1)
        draw.line((left + width, y, left + 1.3 * width, y), INK)
        draw.text((left + 1.5 * width, y), f"{value:.3g}", INK, font, anchor="lm")
    right = 0.985 * image.width
    draw.text((right, top - 0.6 * font.size), legend.label, INK, font, anchor="rd")
