"""What `gymnasium.make_vec` calls: the vector environment on the processor or on an accelerator."""

from typing import Any

from epv_env.common.field_types import shown
from epv_env.signals import OptionError
from epv_env.vector_env import EPValvePWMVectorEnv, EPValveVectorEnv


def make_vector(
    environment: type[EPValveVectorEnv] | type[EPValvePWMVectorEnv],
    *,
    device: str = "cpu",
    **arguments: Any,
) -> Any:
    """The vector environment on the processor ("cpu") or on an NVIDIA accelerator ("cuda").

    environment: EPValveVectorEnv or EPValvePWMVectorEnv. Raises OptionError.
    """
    if device == "cpu":
        return environment(**arguments)
    if device != "cuda":
        raise OptionError(f"device = {shown(device)}: give 'cpu' or 'cuda'")
    from epv_env.device import vector_env  # compiles for an accelerator: of no use elsewhere

    return vector_env.ON_DEVICE[environment](**arguments)


def make_on_off(**arguments: Any) -> Any:
    """EPValve-v0 for `gymnasium.make_vec`; arguments as of EPValveVectorEnv, and `device`."""
    return make_vector(EPValveVectorEnv, **arguments)


def make_pwm(**arguments: Any) -> Any:
    """EPValvePWM-v0 for `gymnasium.make_vec`; arguments as of EPValvePWMVectorEnv, and `device`."""
    return make_vector(EPValvePWMVectorEnv, **arguments)
