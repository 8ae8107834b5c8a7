"""`fragfield check`: derived quantities, cost and warnings of a case before anything is computed."""
