"""Trajectories and atmosphere beside py_ballisticcalc and RocketPy, installed in an environment of their own."""
