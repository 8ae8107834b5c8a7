"""Studies of several runs: comparison of two, sweeps over keys, and uncertainty of the inputs."""
