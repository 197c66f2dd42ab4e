"""The valve as the diagnosis knows it: the grey-box protocol over plant, recordings and replay."""
