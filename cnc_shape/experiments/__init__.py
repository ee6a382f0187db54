"""Experiments: the papers' tables and figures, run again; one package a paper."""
