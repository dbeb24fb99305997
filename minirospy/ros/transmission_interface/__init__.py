"""Maps between actuators and joints."""
