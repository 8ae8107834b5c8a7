"""The copper cylinder test: the speed of the wall as a streak camera sees it, with every product model."""
