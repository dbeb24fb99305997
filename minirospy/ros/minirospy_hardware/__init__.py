"""Hardware for the controller manager: a loopback, which needs no robot."""
