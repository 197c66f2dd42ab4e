"""What `gymnasium.make_vec` calls: the vector environment on the processor or on an accelerator."""

from functools import partial
from typing import Any

from epv_env.common.field_types import shown
from epv_env.signals import OptionError
from epv_env.vector_env import EPValvePWMVectorEnv, EPValveVectorEnv


def check_device(device: str) -> None:
    """Raises OptionError unless the device is "cpu", or "cuda" and there is an accelerator."""
    if device == "cpu":
        return
    if device != "cuda":
        raise OptionError(f"device = {shown(device)}: give 'cpu' or 'cuda'")
    from epv_env.device.vector_env import check_available

    check_available()


def make_vector(
    environment: type[EPValveVectorEnv] | type[EPValvePWMVectorEnv],
    *,
    device: str = "cpu",
    to_host: bool = False,
    **arguments: Any,
) -> Any:
    """The vector environment on the processor ("cpu") or on an NVIDIA accelerator ("cuda").

    environment: EPValveVectorEnv or EPValvePWMVectorEnv. to_host: whether results of an accelerator are
    copied to NumPy's arrays, with infos as on the processor. Raises OptionError.
    """
    if device == "cpu":
        if "starts" in arguments:
            raise OptionError('starts is an option of device="cuda": leave it out on the CPU')
        return environment(**arguments)
    check_device(device)
    from epv_env.device import vector_env  # compiles for an accelerator: of no use elsewhere
    from epv_env.device.on_host import OnHost

    made = vector_env.ON_DEVICE[environment](**arguments)
    return OnHost(made) if to_host else made


make_on_off, make_pwm = (partial(make_vector, e) for e in (EPValveVectorEnv, EPValvePWMVectorEnv))
"""EPValve-v0 and EPValvePWM-v0 for `gymnasium.make_vec`."""
