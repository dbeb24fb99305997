"""What every command is made of: its parser, its verbs, its errors and exit statuses."""
