"""A matplotlib figure as an SVG image that stays sharp at every zoom."""

import base64
import io

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

LARGEST_CLOUD = 500
"""Points of one line with markers [1]: more are drawn as pixels, for each point costs 80 characters."""

RESOLUTION = 200
"""Of what is drawn as pixels [dots per inch]: sharp in print and at twice the screen's size."""


def as_svg(figure: Figure) -> str:
    """The figure as SVG text, always the same for the same figure; its clouds become pixels for good."""
    for line in figure.findobj(_is_cloud):
        line.set_rasterized(True)
    stream = io.StringIO()
    # Letters become paths, so that they look alike on machines without matplotlib's fonts; a fixed salt
    # makes the same names in every file; lines are simplified within a fifth of a pixel.
    with rc_context(
        {"svg.fonttype": "path", "svg.hashsalt": "epv-valve", "path.simplify_threshold": 0.2}
    ):
        figure.savefig(
            stream, format="svg", dpi=RESOLUTION, bbox_inches="tight", metadata={"Date": None}
        )
    return stream.getvalue()


def as_data_link(figure: Figure) -> str:
    """The figure as the address of an image that holds its whole content."""
    encoded = base64.b64encode(as_svg(figure).encode("utf-8")).decode("ascii")
    return f"data:image/svg+xml;base64,{encoded}"


def _is_cloud(artist: object) -> bool:
    """Whether an artist is a line with so many markers that each as a shape would fill the file."""
    if not isinstance(artist, Line2D) or artist.get_marker() in ("", " ", "None", None):
        return False
    return np.size(artist.get_xdata()) > LARGEST_CLOUD
