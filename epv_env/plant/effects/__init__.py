"""Physical effects that the nominal model leaves out: one record each, beside its compiled functions.

An effect is an `Effect` record (record.py) in the file of its component, one line in registry.py, and
the line of equations.py that calls its function behind `if extended is not None`. Everything else
reads the record: the parameter table, the plant file, the catalogue of the diagnosis, sealed trials,
sweeps and docs.

The kernels of integrate.py come in forms compiled from the same source: `extended=None`, where every
effect is compiled away and costs nothing; `extended=FEW_LAWS`, where each acts with its size and a size
of zero is off; and `extended=True`, where more laws may act.
"""
