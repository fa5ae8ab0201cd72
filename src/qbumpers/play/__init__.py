"""Play in the browser: a participant and an assistant at any task that has a display."""
