"""Models of the tests' own, each in one module, as `docs/developer/adding.md` says."""
