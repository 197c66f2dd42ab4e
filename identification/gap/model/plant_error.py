"""The error that says what is wrong with the description of a plant."""


class PlantError(ValueError):
    """A plant or its recordings cannot be diagnosed; one sentence per finding, one finding per line."""
