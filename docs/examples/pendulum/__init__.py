"""A pendulum that swings freely, recorded by others.

python -m docs.examples.pendulum --data FOLDER --out DIR, from the repository's root.
"""
