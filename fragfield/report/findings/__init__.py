"""What a reader must know before using the numbers: findings, statements, evidence of the validation."""
