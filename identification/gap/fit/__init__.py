"""Joint fits of parameters and causes to recordings."""
