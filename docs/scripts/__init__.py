"""Scripts that make figures, films and tables of the documentation."""
