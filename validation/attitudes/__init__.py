"""The expected distance of a single M107 over cell sizes and over its attitude: both must leave it well-posed."""
