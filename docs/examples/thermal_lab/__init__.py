"""Two heaters and two thermometers on a board (TCLab), recorded by others.

python -m docs.examples.thermal_lab --data FOLDER --out DIR, from the repository's root.
"""
