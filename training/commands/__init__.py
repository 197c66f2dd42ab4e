"""Commands of training, comparison, sweeps and deployment: one module each."""
