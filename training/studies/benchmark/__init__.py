"""The benchmark of algorithms: result files, tables and figure."""
