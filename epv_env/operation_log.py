"""What a control unit records of a drive, as files: log.json and one CSV per drive.

    env = OperationLog(gymnasium.make("EPValve-v0"), "logs/valve-01")

Every episode becomes a drive. docs/reference/files.md describes the format.
"""

from os import PathLike
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import NDArray

from epv_env.common.files import write_json, write_text
from epv_env.common.results_folder import LOCK_FILE
from epv_env.common.units import BAR
from epv_env.env import EPValveEnv
from epv_env.observation import INDEX, decode
from epv_env.signals import OptionError

FORMAT, FILE_NAME = "epv-log/1", "log.json"
"""Version of log.json, in its field `format`, and the file's name."""

DECIMALS = {
    "time_s": 6, "coil": 0, "U_supply_V": 2, "p1_bar": 4, "p2_bar": 4, "p3_bar": 4, "I_A": 4,
    "target_bar": 4,
}  # fmt: skip
"""Columns of a drive's file, and the decimals that are written: finer than a step of a 12-bit unit."""


class OperationLog(gymnasium.Wrapper[NDArray, Any, NDArray, Any]):
    """Records the readings and commands of one "EPValve-v0" in a folder; a drive ends with its episode.

    A row holds the readings at its time, and the command from then until the next row.
    """

    def __init__(self, env: gymnasium.Env[NDArray, Any], folder: str | PathLike[str], name: str = ""):
        """folder: new, or without files. name: of the valve, "" for the folder's.

        Raises OptionError for another environment, or a folder that holds files.
        """
        super().__init__(env)
        if not isinstance(env.unwrapped, EPValveEnv):
            raise OptionError(
                f"an operation log needs EPValve-v0, not {type(env.unwrapped).__name__}: only there one "
                "command holds for a whole control period"
            )
        self.valve = env.unwrapped
        self.folder = Path(folder)
        there = self.folder.iterdir() if self.folder.exists() else ()
        if any(path.name != LOCK_FILE for path in there):
            raise OptionError(f"{self.folder} holds files already: give another folder for the log")
        self.name = name or self.folder.resolve().name
        self._rows: list[NDArray] = []
        self._drives: list[str] = []
        self._observation = np.zeros(len(INDEX), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray, dict[str, Any]]:
        """Begin a drive; one that was going on is written. Returns the observation (entries,) [-]."""
        self._write()
        self._observation, info = self.env.reset(seed=seed, options=options)
        return self._observation, info

    def step(self, action: Any) -> tuple[NDArray, SupportsFloat, bool, bool, dict[str, Any]]:
        """Record readings and command; write the drive where it ends. Observation (entries,) [-]."""
        row = self._row(action)
        self._observation, reward, terminated, truncated, info = self.env.step(action)
        self._rows.append(row)
        if terminated or truncated:
            self._write()
        return self._observation, reward, terminated, truncated, info

    def close(self) -> None:
        """Write the drive that is going on."""
        self._write()
        super().close()

    def _row(self, action: Any) -> NDArray:
        """The columns of DECIMALS for this period."""
        settings = self.valve.settings
        read = {name: float(decode(self._observation, name)) for name in ("p1", "p3", "I", "target")}
        p2 = read["target"] + float(decode(self._observation, "p2_error"))
        time = len(self._rows) * settings.control_period
        voltage = settings.supply_voltage
        return np.array(
            [time, float(action), voltage, read["p1"], p2, read["p3"], read["I"], read["target"]]
        )

    def _write(self) -> None:
        """The drive as a file, and the manifest, which names it."""
        if not self._rows:
            return
        template = ",".join(f"%.{digits}f" for digits in DECIMALS.values())
        lines = [",".join(DECIMALS), *(template % tuple(row) for row in self._rows)]
        self._drives.append(f"drive-{len(self._drives) + 1}.csv")
        write_text(self.folder / self._drives[-1], "\n".join(lines) + "\n")
        self._rows = []
        plant = self.valve.plant.parameters
        write_json(
            self.folder / FILE_NAME,
            {
                "format": FORMAT,
                "name": self.name,
                "control_period_s": self.valve.settings.control_period,
                "environment": {
                    "temperature_K": plant["T_env"],
                    "pressure_bar": plant["p_env"] / BAR,
                },
                "drives": [{"file": file} for file in self._drives],
            },
        )
