"""Studies with participants: their file, what participants go through, and what comes of it."""
