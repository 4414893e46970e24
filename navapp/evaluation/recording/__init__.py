"""Anyone's recording judged by a known truth."""
