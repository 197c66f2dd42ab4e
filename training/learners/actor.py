"""The policy as stable-baselines3 trains it: a net that corrects the advice of the adaptive pulse."""

from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor

from controllers.network import Network

TRUST = 1.5
"""Weight of the advice in the logits before training [1]: the policy follows it in 95 % of periods."""


class AdviceBeside(MlpExtractor):
    """Hidden layers, with the advice (the last input) handed on beside the actor's."""

    def __init__(self, *arguments: Any, **keywords: Any):
        super().__init__(*arguments, **keywords)
        self.latent_dim_pi += 1

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Of the actor and of the critic; features: inputs (n, all)."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Hidden signals and the advice, (n, width + 1)."""
        return torch.cat([self.policy_net(features), features[:, -1:]], dim=1)


class AdvisedPolicy(ActorCriticPolicy):
    """Actor and critic without common layers; the actor begins as the advice with some exploration."""

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = AdviceBeside(
            self.features_dim,
            net_arch=self.net_arch,
            activation_fn=self.activation_fn,
            device=self.device,
        )

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        assert isinstance(self.action_net, torch.nn.Linear)
        with torch.no_grad():
            self.action_net.weight[:, -1] = torch.tensor([-TRUST, TRUST])


def network_of(model: PPO) -> Network:
    """The model's actor: a copy of its weights."""
    layers = [layer for layer in model.policy.mlp_extractor.policy_net if hasattr(layer, "weight")]
    arrays = [(_array(layer.weight), _array(layer.bias)) for layer in layers]
    weight, bias = _array(model.policy.action_net.weight), _array(model.policy.action_net.bias)
    return Network(
        layers=[*arrays, (np.ascontiguousarray(weight[:, :-1]), bias)],
        advice_weight=np.ascontiguousarray(weight[:, -1]),
    )


def _array(parameter: Any) -> np.ndarray:
    return parameter.detach().cpu().numpy().copy()
