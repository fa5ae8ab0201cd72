"""What a study is: its file, its words, its conditions, who gets which, and freezing it."""
