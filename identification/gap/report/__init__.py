"""The diagnosis for programs and for readers."""
