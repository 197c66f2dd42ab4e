"""The diagnosis as HTML sections, figures, sentences and JSON."""
