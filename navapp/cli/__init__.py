"""The command line: one module per command, with parsing and printing only."""
