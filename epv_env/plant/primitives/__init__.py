"""What equations and effects are made of: compilation, orifice flow, geometry, the type of a value."""
