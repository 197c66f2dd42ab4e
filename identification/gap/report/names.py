"""Names of causes as people read them."""

from identification.gap.diagnosis import Diagnosis


def in_words(diagnosis: Diagnosis, label: str) -> str:
    """A cause's name or label, or several joined by ' + ', for people; any other text unchanged."""
    words = {
        name: cause.words
        for cause in diagnosis.ranking.problem.plant.causes
        if cause.words
        for name in (cause.name, cause.label)
    }
    return " + ".join(words.get(part, part) for part in label.split(" + "))
