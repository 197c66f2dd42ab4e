"""Training and honest comparison of controllers."""
