"""The parts of every command: its parser, its verbs, its errors and exit statuses."""
