"""The environments on an NVIDIA accelerator: the same compiled functions, one valve for each thread."""
