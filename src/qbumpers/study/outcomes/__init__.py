"""What comes of a study: its data for everybody, flags, estimates, power, and what is owed."""
