"""Training with other libraries: one short script each, run by tests/test_research_examples.py."""
