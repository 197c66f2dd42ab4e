"""The public benchmark of a valve with impacts: a pressure relief valve on its seat."""
