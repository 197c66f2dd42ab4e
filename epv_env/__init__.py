"""Gymnasium environments of an electro-pneumatic protection valve.

```python
import gymnasium, epv_env

env = gymnasium.make("EPValve-v0")
```
"""

from gymnasium.envs.registration import register, registry

MAX_EPISODE_STEPS = {"EPValve-v0": 2000, "EPValvePWM-v0": 500}
"""Control periods of an episode: 10 s each."""


def register_envs() -> None:
    """Register the environments' ids; harmless when repeated."""
    for identifier, name, vector in (
        ("EPValve-v0", "EPValve", "make_on_off"),
        ("EPValvePWM-v0", "EPValvePWM", "make_pwm"),
    ):
        if identifier not in registry:
            register(
                id=identifier,
                entry_point=f"epv_env.env:{name}Env",
                vector_entry_point=f"epv_env.vector_entry:{vector}",
                max_episode_steps=MAX_EPISODE_STEPS[identifier],
            )


register_envs()
