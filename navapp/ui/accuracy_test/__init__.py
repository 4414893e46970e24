"""The screen of the accuracy test."""
