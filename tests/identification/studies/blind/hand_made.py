"""Labels and diagnoses made by hand."""


def label(kind="one", effects=("eddy_current",), visible=None, explainable=2.0, sizes=None, trial=0):
    """Content of sealed.json, as far as scores read it."""
    return {
        "trial": trial, "kind": kind, "effects": list(effects),
        "visible": list(effects if visible is None else visible),
        "sizes": sizes or {}, "gap": {"explainable": explainable, "recalibrated": explainable},
    }  # fmt: skip


NOTHING = label("none", (), explainable=1.0)


def answer(verdict="known", *causes, component="solenoid", named=1, seconds=10.0, **more):
    """Content of gap.json, as far as scores read it.

    causes: (effects, probability, magnitude) in order; the first `named` are the ambiguity set.
    """
    return {
        "verdict": verdict,
        "where": {"component": {component: 0.9, "flow": 0.1} if component else {}},
        "causes": [
            {"effects": list(effects), "probability": probability, "magnitude": magnitude}
            for effects, probability, magnitude in causes
        ],
        "ambiguity_set": [list(effects) for effects, *_ in causes[:named]],
        "seconds": seconds,
        **more,
    }


EDDY = (["eddy_current"], 0.9, {"G_eddy_S": [2.2e-3, 1.9e-3, 2.5e-3]})
CLAMP = (["flyback_voltage"], 0.08, {"U_clamp_V": [1.0, 0.5, 1.5]})
