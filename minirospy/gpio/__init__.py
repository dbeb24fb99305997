"""The surface of RPi.GPIO on a virtual board that all processes of a user share."""
