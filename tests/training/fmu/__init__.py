"""Tests of the Functional Mock-up Units."""
