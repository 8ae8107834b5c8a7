"""Files read and written: results, ensembles, fragments, height maps; HDF5 and CSV."""
