"""The M107 of 1944, twice: with the law and speed that the table gives, and from the burst with nothing prescribed."""
