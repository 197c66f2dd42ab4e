"""How often confidence intervals hold the truth, over twin campaigns."""
