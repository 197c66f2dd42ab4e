"""Learning policies: PPO, imitation, distillation with a memory."""
