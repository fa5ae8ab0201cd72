"""Simulated learners who take part in a study as people do."""
