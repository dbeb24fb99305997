"""Meshes in STL, OBJ and Collada files, as numpy arrays, and their parts for collisions."""
