"""Kinds of trials of the blind check."""

NOMINAL, ONE_CAUSE, TWO_EFFECTS, EXCLUDED_EFFECT = "none", "one", "pair", "left_out"
"""Kinds as drawn, as in sealed.json and results.json.

NOMINAL: no cause. ONE_CAUSE: one effect, or one parameter off its value. TWO_EFFECTS: two effects at
once. EXCLUDED_EFFECT: one effect that the diagnosis does not have in its catalogue.
"""

ABSORBED = "absorbed"
"""Kind of a trial whose causes recalibration absorbs, so that `no_gap` is the correct verdict."""

KIND_TITLES = {
    NOMINAL: "no effect",
    ABSORBED: "absorbed by the four",
    ONE_CAUSE: "one cause",
    TWO_EFFECTS: "two effects",
    EXCLUDED_EFFECT: "effect excluded from the catalogue",
}
"""Kinds in the order of the tables, with their titles there."""

PARAMETER = "parameter:"
"""Prefix of a cause that is a parameter off its value; the symbol follows."""
