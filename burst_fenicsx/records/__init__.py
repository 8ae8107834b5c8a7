"""What is read off the state of a burst: diameters and speeds, rounds at rupture, ignition, exposure, the summary."""
