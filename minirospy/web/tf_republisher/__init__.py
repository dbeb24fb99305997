"""tf2_web_republisher: chosen transforms for clients of rosbridge, at a rate of their own and only if they changed."""
