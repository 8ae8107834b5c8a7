"""The detonation products by themselves: energy, effective Gurney velocity, work in a progressive detonation."""
