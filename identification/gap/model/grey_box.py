"""The protocol by which the diagnosis knows a plant: channels, parameters, causes, a simulator."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter
from identification.gap.model.recorded_run import Channel, Run
from identification.gap.model.state_equation import StateEquation, StateTrace


class GreyBox(Protocol):
    """A plant with recordings. Values are SI; n candidates are simulated side by side.

    Candidate values are a mapping from symbol to an array: (n,), or (n, runs) for a parameter that takes
    a separate value in every run. A symbol that is left out has its nominal value.
    """

    @property
    def channels(self) -> Sequence[Channel]:
        """Measured outputs, in the order of the first axis of every output array."""
        ...

    @property
    def runs(self) -> Sequence[Run]:
        """Recordings; at least one of them is held out."""
        ...

    @property
    def parameters(self) -> Sequence[FreeParameter]:
        """Calibrated parameters; calibration begins at their nominal values."""
        ...

    @property
    def causes(self) -> Sequence[Cause]:
        """Catalogue of what may be wrong with the model."""
        ...

    @property
    def tolerances(self) -> Sequence[NuisanceParameter]:
        """Other parameters with their scatter from unit to unit; the same in every run."""
        ...

    @property
    def run_offsets(self) -> Sequence[NuisanceParameter]:
        """Nuisance parameters with a value per run: initial states, zeros of that day's sensors."""
        ...

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """Simulate the runs with the given indices.

        Args:
            values: candidate values by symbol, (n,) or (n, runs) [SI].
            runs: indices into `self.runs`.

        Returns:
            Model outputs of each of these runs, (channels, samples, n) [SI]; NaN where it fails.
        """
        ...

    @property
    def equations(self) -> Sequence[StateEquation]:
        """The model's state equations."""
        ...

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """States that a missing term may depend on, by name.

        values: by symbol, (n,) or (n, runs) [SI]; the first candidate counts. run: index of the run.
        """
        ...

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """Samples in each regime of the model, boolean (samples,) by name; regimes may overlap.

        values: by symbol, (n,) or (n, runs) [SI]; the first candidate counts. run: index of the run.
        """
        ...

    def forced(
        self, values: Mapping[str, NDArray], equation: StateEquation, run: int, edges: NDArray
    ) -> NDArray:
        """Change of the outputs under a forcing of the equation's step, window by window.

        Args:
            values: values of one candidate by symbol, (1,) or (1, runs) [SI].
            equation: the equation to which the forcing is added.
            run: index into `self.runs`.
            edges: first sample of each window, and the end of the last one, (windows + 1,).

        Returns:
            Change of the outputs, (channels, samples, windows) [SI].
        """
        ...


def noise_weighted(plant: GreyBox, run: int, values: NDArray) -> NDArray:
    """Values (channels, samples, ...) [SI] in noise standard deviations, 0 at untrusted readings.

    Raises ValueError where the noise of a channel is not known: see `prepared`.
    """
    trusted = plant.runs[run].trusted
    noise = np.array([channel.known_noise for channel in plant.channels])
    mask = trusted / noise[:, None]
    weighted = values * mask.reshape(*mask.shape, *[1] * (values.ndim - 2))
    weighted[~trusted] = 0.0  # NaN times 0 is NaN
    return weighted
