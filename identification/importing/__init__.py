"""Campaigns from a bench's own files: MDF, MATLAB, TDMS, Parquet and CSV of any dialect."""
