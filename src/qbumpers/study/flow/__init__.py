"""What a participant goes through: a log, where they are by it, their pages, and the server."""
