"""The page of a report: its sentences, tables, figures and layout."""
