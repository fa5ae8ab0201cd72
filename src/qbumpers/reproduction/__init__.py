"""Published experiments: a folder for each, with its settings, numbers, claims and figures."""
