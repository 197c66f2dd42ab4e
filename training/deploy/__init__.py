"""A trained policy as files for an electronic control unit."""
