"""Benchmarks: one script a row of the table in docs/performance.md, each against a named peer."""
