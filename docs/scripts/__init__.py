"""Scripts that make the documentation's pictures and generated pages."""
