"""cv_bridge.boost: what cv_bridge has in C++, here in Python."""
