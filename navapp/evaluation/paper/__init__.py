"""The paper's tables: cases, tests on simulated knees, rows, tables and report."""
