"""Loops over all cells and nodes: levels and colours, element forces, the step of the nodes, the ledger's sums."""
