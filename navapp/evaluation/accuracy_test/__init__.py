"""Figures and report of an accuracy test."""
