"""The sim-to-real loop: train, deploy on a bench, diagnose, retrain, deploy again."""
