"""The report's Tables 2 and 3."""

from docs.studies.reproduction.study import PRINTED
from identification.quality.channel import DescriptiveStatistics

TREND_SLOPES, TREND_OFFSETS = PRINTED["table2"]["slope"], PRINTED["table2"]["offset"]
"""Table 2 [unit/s], [unit]."""

NAMES = DescriptiveStatistics.__dataclass_fields__
STATISTICS = {
    channel: DescriptiveStatistics(**dict(zip(NAMES, column, strict=True)))
    for channel, column in PRINTED["table3"].items()
}
"""Table 3 by channel."""
