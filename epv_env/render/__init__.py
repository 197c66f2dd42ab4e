"""Showing the valve: a section that moves and a strip chart. pygame is imported on first use."""

from epv_env.render.geometry import Snapshot
from epv_env.render.window import Renderer

__all__ = ["Renderer", "Snapshot"]
