"""The report's error terms of a model on recordings, as in Tables 11, 13 and 15."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from identification.recordings.recording import OUTPUTS, Recording
from identification.replay.batch_simulation import Replay
from identification.replay.model_inputs import model_inputs
from identification.replay.weighted_residuals import measured_outputs
from identification.report_2003.output_error import partial_error, relative_error, total_error


@dataclass(frozen=True, kw_only=True)
class Response:
    """One recording and the model's response to its inputs."""

    recording: Recording
    measured: NDArray
    """OUTPUTS, (3, samples) [Pa, Pa, A]."""
    model: NDArray
    """OUTPUTS of the model, (3, samples) [Pa, Pa, A]."""

    @property
    def errors(self) -> dict[str, float]:
        """Eq. 19 by output, as fractions."""
        time = self.recording.time
        pairs = zip(OUTPUTS, self.measured, self.model, strict=True)
        return {output: float(relative_error(y, model, time)) for output, y, model in pairs}

    @property
    def partial(self) -> float:
        """Eq. 20, as a fraction."""
        return float(partial_error([np.array(error) for error in self.errors.values()]))


def responses(recordings: Sequence[Recording], parameters: Parameters) -> list[Response]:
    """The model's responses from each recording's steady start; nothing is fitted. parameters: [SI]."""
    replay = Replay([model_inputs(recording, parameters) for recording in recordings], parameters)
    one = {"R": np.array([parameters["R"]])}
    return [
        Response(recording=recording, measured=measured_outputs(recording), model=model[:, :, 0])
        for recording, model in zip(recordings, replay.outputs(one), strict=True)
    ]


def total_response_error(responses: Sequence[Response]) -> float:
    """Eq. 21, as a fraction."""
    return float(total_error([np.array(response.partial) for response in responses]))
