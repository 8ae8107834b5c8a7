"""Where fragments start and how they are oriented: placing, attitude, images behind planes of symmetry."""
