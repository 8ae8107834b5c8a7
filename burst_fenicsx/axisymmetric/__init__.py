"""The burst of one round in its meridian: quadrilaterals of the half plane (r, z) that stand for rings.

Kernels are in `burst_fenicsx.kernels.axisymmetric`; materials, products, burn, steps, ledger, output and snapshot are
those of the three-dimensional burst. In this package a round stands on the origin with its axis along z; nodes have the
coordinates (r, 0, z).
"""
