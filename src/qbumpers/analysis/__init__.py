"""From results in files to measures, statistics, figures and a report."""
