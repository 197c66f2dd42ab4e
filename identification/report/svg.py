"""A matplotlib figure as an SVG image that stays sharp at every zoom."""

import base64
import io
from typing import TYPE_CHECKING

from matplotlib import rc_context
from matplotlib.lines import Line2D

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST_CLOUD = 500
"""Points of one line with markers [1]: more are drawn as pixels, for each point costs 80 characters."""

RESOLUTION = 200
"""Of what is drawn as pixels [dots per inch]: sharp in print and at twice the screen's size."""

STYLE = {
    "svg.hashsalt": "epv-valve",  # the same figure gives the same file
    "svg.fonttype": "path",  # letters look alike on machines without matplotlib's fonts
    "path.simplify_threshold": 0.2,  # pixels; measured lines are noise at a thousand samples a second
}
"""Settings of matplotlib while a figure is written."""


def as_svg(figure: "Figure") -> str:
    """The figure as SVG text; the figure is unchanged but for clouds, which are drawn as pixels."""
    for line in figure.findobj(Line2D):
        assert isinstance(line, Line2D)
        if line.get_marker() not in ("", " ", "None", None) and len(line.get_xdata()) > LARGEST_CLOUD:  # type: ignore[arg-type]
            line.set_rasterized(True)
    stream = io.StringIO()
    with rc_context(STYLE):
        figure.savefig(
            stream, format="svg", dpi=RESOLUTION, bbox_inches="tight", metadata={"Date": None}
        )
    return stream.getvalue()


def as_data_link(figure: "Figure") -> str:
    """The figure as the address of an image that holds its whole content."""
    encoded = base64.b64encode(as_svg(figure).encode("utf-8")).decode("ascii")
    return f"data:image/svg+xml;base64,{encoded}"
