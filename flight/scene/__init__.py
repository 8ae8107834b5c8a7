"""What a fragment flies through and may meet: air, wind, ground, obstacles, walls, witness surfaces."""
