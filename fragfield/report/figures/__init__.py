"""The figures of the report, one module for each group, and how they are drawn."""
