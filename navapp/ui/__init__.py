"""The operator's screen: a terminal client that reads snapshots and submits commands."""
