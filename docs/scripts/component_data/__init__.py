"""Effects compared with public measurements of components (docs/results/component-data.md).

python -m docs.scripts.component_data --data FOLDER --out docs/images, from the repository's root.

FOLDER holds friction/, chambers/ and solenoids/ as that page lists them; nothing of it is kept here.
"""
