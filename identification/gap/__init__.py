"""Diagnosis of the gap between a grey-box model and recordings: where, which cause, how far it shrinks.

Nothing here knows the valve: everything goes through the protocol of model.py.
"""
