"""How often confidence intervals hold the truth, over campaigns of a virtual bench."""
