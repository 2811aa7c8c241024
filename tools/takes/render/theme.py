"""Colours and lights of a picture.  Colours are given as sRGB, #rrggbb, and used as linear light."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Floats32

Bgr = tuple[int, int, int]

GAMMA = 2.2


def linear(colour: str) -> tuple[float, float, float]:
    """Linear blue, green, red in [0, 1] of "#rrggbb"."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return blue**GAMMA, green**GAMMA, red**GAMMA


def bgr(colour: str) -> Bgr:
    """sRGB blue, green, red in [0, 255] of "#rrggbb"."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return blue, green, red


@dataclass(frozen=True)
class Theme:
    """Colours and lights.

    body: colours of the shades of `surfaces`, in their order.  floor, fine, bold: floor and its grid lines.
    low, high: background at the horizon and above.

    sun, sky, ground, rim: colour and strength of the lights.  shadow, contact: share of the light on the floor that the
    body blocks.  text, faint, accent: colours of the captions.  All chosen by hand.
    """

    body: tuple[str, str, str, str, str, str]
    floor: str
    fine: str
    bold: str
    low: str
    high: str
    sun: tuple[str, float]
    sky: tuple[str, float]
    ground: tuple[str, float]
    rim: tuple[str, float]
    shadow: float
    contact: float
    text: str
    faint: str
    accent: str

    def palette(self) -> Floats32:
        """Return linear colours (shades, 3)."""
        return np.array([linear(colour) for colour in self.body], dtype=np.float32)

    def lights(self, towards: Floats) -> Floats32:
        """Return the lights (6, 3) of `rasterizer.light_body`.  towards: (3,) unit vector to the sun."""
        colours = [np.array(linear(colour)) * factor for colour, factor in (self.sun, self.sky, self.ground, self.rim)]
        return np.array([towards, *colours, (0.10, 34.0, 0.80)], dtype=np.float32)


THEMES: Mapping[str, Theme] = {
    "light": Theme(
        body=("#dfe3e8", "#f08a3c", "#3f9ae0", "#eceff2", "#30363f", "#a3a9b1"),
        floor="#e6e9ee", fine="#d8dce3", bold="#c3c9d3", low="#f3f5f8", high="#dfe5ee",
        sun=("#fff4e2", 0.80), sky=("#dfeaff", 0.50), ground=("#cfc8c0", 0.26), rim=("#ffffff", 0.10),
        shadow=0.52, contact=0.45, text="#2b313b", faint="#8b93a1", accent="#3f7fe0",
    ),
    "dark": Theme(
        body=("#c9d0da", "#f6923f", "#44a4f0", "#d7dde5", "#12161d", "#6a727e"),
        floor="#20262f", fine="#28303b", bold="#3a4453", low="#161b22", high="#0d1117",
        sun=("#fff4e6", 1.20), sky=("#a9c0e8", 0.34), ground=("#39424f", 0.30), rim=("#7fb2ff", 0.16),
        shadow=0.66, contact=0.55, text="#e6ebf2", faint="#7d8794", accent="#5aa2ff",
    ),
}  # fmt: skip
