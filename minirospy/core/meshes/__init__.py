"""Meshes in STL, OBJ and Collada files, read as numpy arrays, and their convex parts for collisions."""
