"""Simulation of a plant from its plain ordinary differential equations."""
