"""Displays, one file per kind of task; `by_environment` finds those of Gymnasium's environments."""
