"""A second plant for the diagnosis of a gap (docs/explanation/diagnosis.md): a tank that may leak.

python -m docs.examples.tank --out DIR, from the repository's root.

simulator.py is the model, recordings.py reads and writes files, and plant.py connects both to the
diagnosis through the protocol `GreyBox`.
"""
