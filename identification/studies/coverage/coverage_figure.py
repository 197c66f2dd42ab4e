"""The picture of the coverage study."""

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import chi2

from identification.studies.coverage.coverage import Coverage


def distance_quantiles(coverage: Coverage) -> Figure:
    """Squared distances of the truth against the quantiles of the chi-square law they should follow."""
    figure = Figure(figsize=(5.5, 4.5), layout="constrained")
    axes = figure.subplots()
    count = len(coverage.distance)
    expected = chi2.ppf((np.arange(count) + 0.5) / count, len(coverage.symbols))
    axes.plot(expected, np.sort(coverage.distance), ".", label="region of the plant file")
    axes.plot(expected, np.sort(coverage.independent), ".", label="independent residuals, exact inputs")
    axes.plot(expected, expected, color="black", linewidth=0.8)
    axes.set_xlabel(f"quantiles of chi-square with {len(coverage.symbols)} degrees of freedom")
    axes.set_ylabel("squared distance of the truth")
    axes.legend()
    axes.grid(alpha=0.3)
    return figure
