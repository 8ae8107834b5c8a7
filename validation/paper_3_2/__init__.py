"""Section 3.2 of the paper: two M107 side by side on a witness ring, beside the single round."""
