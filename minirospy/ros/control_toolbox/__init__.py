"""PID controllers whose gains are parameters."""
