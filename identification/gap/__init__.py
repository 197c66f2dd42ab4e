"""Diagnosis of the gap between a grey-box model and recordings: where, which cause, how far reduced.

The diagnosis knows no particular plant: every access goes through the protocol of plant.py. Its steps
are folders, in this order: prepare, fit, search, locate, judge, report.
"""
