"""The drive of a toy car of 1:10 (DART), recorded by others.

python -m docs.examples.toy_car --data FOLDER --out DIR, from the repository's root.
"""
