"""A virtual bench: campaigns of recordings from a plant whose truth is known."""
