"""The model on recorded inputs, and how far it is from the recorded outputs."""
