"""Labels and diagnoses made by hand."""


def label(kind="one", effects=("eddy_current",), visible=None, explainable=2.0, trial=0):
    """Content of sealed.json, as far as scores read it."""
    return {
        "trial": trial, "kind": kind, "effects": list(effects),
        "visible": list(effects if visible is None else visible),
        "gap": {"explainable": explainable},
    }  # fmt: skip


NOTHING = label("none", (), explainable=1.0)


def answer(verdict="known", *causes, component="solenoid", named=1, inclusion=None):
    """Content of gap.json, as far as scores read it.

    causes: (effects, probability) in order; the first `named` are the ambiguity set. inclusion: by
    effect; None: the sum over the causes that hold it.
    """
    sums: dict[str, float] = {}
    for effects, probability in causes:
        sums |= {effect: sums.get(effect, 0.0) + probability for effect in effects}
    return {
        "verdict": verdict,
        "where": {"component": {component: 0.9, "flow": 0.1} if component else {}},
        "causes": [{"effects": list(effects), "probability": p} for effects, p in causes],
        "ambiguity_set": [list(effects) for effects, _ in causes[:named]],
        "inclusion": sums if inclusion is None else inclusion,
        "seconds": 10.0,
    }


EDDY = (["eddy_current"], 0.9)
CLAMP = (["flyback_voltage"], 0.08)
