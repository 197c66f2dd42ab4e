"""The stages of an identification, run in order on one campaign."""
