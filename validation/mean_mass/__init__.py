"""Mean mass of fragments: every law against published shells and cylinders, and with the speeds of our own bursts."""
