"""Hardware for the controller manager: a loopback that needs no robot."""
