"""From a resolved case to the inputs of each stage."""
