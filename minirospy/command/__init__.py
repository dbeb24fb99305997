"""The parts that all commands share: parser, verbs, errors and exit statuses."""
