"""What any correct model of a stack must show: trends over gap, delay and number of rounds, and exact symmetries."""
