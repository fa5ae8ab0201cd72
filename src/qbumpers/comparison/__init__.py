"""All assistants on several tasks and learners, compared at equal amounts of help."""
