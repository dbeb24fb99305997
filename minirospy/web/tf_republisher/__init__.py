"""tf2_web_republisher: sends selected transforms to rosbridge clients, at a limited rate and only if they have changed."""
