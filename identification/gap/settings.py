"""All settings of a diagnosis, one record per stage."""

from dataclasses import dataclass, field

from identification.gap.design.settings import DesignSettings
from identification.gap.locate.settings import LocalisationSettings
from identification.gap.rank.settings import RankingSettings
from identification.gap.reduce.settings import ReductionSettings


@dataclass(frozen=True, kw_only=True)
class ReportSettings:
    """Judgement in what the report and gap.json show and say."""

    judged_runners_up: int = 3
    """Number of single causes beyond the ambiguity set whose discrepancy reduction is measured too;
    computing time and length of the tables."""

    listed_causes: int = 10
    """Most causes in gap.json; the others are the least probable."""

    systematic_form_error: float = 0.07
    """Relative standard deviation of a cause's parameter by errors of its form that the recordings
    cannot show [1]: an error that is the same everywhere looks like another value of the parameter."""

    bound_tolerance: float = 1e-6
    """Share of a range [1] within which a parameter is reported as lying at the end of its range."""

    likely_probability: float = 0.5
    """Probability above which the report states no gap without reservation."""

    mentioned_probability: float = 0.01
    """Probability from which the report mentions a cause."""

    listed_inclusion: float = 0.001
    """Probability that an effect is part of the gap from which gap.json lists it (contract)."""

    mentioned_discrepancy: float = 0.3
    """Standard deviation of a disturbance [noise deviations] from which the verdict mentions it: less
    adds under 5 % to the readings' scatter."""

    drawn_term_share: float = 0.2
    """Share of the missing term that a state must explain [1] for the term to be drawn over it."""

    heat_map_range: float = 10.0
    """Upper end of the heat map's colours, unless a gap is larger [noise deviations]."""


@dataclass(frozen=True, kw_only=True)
class DiagnosisSettings:
    """Judgement of every stage of a diagnosis."""

    ranking: RankingSettings = field(default_factory=RankingSettings)
    localisation: LocalisationSettings = field(default_factory=LocalisationSettings)
    reduction: ReductionSettings = field(default_factory=ReductionSettings)
    design: DesignSettings = field(default_factory=DesignSettings)
    report: ReportSettings = field(default_factory=ReportSettings)
