"""Contact: which faces a node may meet, springs and friction there, rigid planes, sliding on the casing."""
