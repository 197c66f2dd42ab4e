"""A second plant for the diagnosis of a gap (docs/gap.md): a tank that may leak.

python -m docs.examples.tank --out DIR, from the repository's root.

simulator.py is what one has before any diagnosis, recordings.py reads files, plant.py brings both
behind the protocol that the diagnosis knows.
"""
