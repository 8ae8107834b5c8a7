"""What a reader must know before using the numbers: findings, statements, state of the validation."""
